/* corners.c: contacts of convex blocks in the plane, corners of blocks on edges of others.
 *
 * Fills the rows of contact points (dem_demo/contact/rows.py) that the step in blocks.c reads. Python
 * owns every array and keeps it in place; nothing here allocates or keeps memory. layout.h, made from
 * layout.py, describes the arrays. n blocks, c corners, k contacts; SI units; vectors are pairs x, y.
 */
#include <math.h>

#include "export.h"
#include "layout.h"

#define FACE_SINE 0.03489949670250097   /* of 2 degrees: up to this tilt an edge lies on another */
#define CORNER_SINE 0.08715574274765817 /* of 5 degrees: from this tilt on only its corner touches */
#define SLIM_SINE 0.3420201433256687   /* of 20 degrees: up to it a corner bears at the end of an edge */
#define POINT_SINE 0.5                    /* of 30 degrees: from it on blocks meet in a point there */
#define MIN_OVERLAP 1e-10               /* m: shorter overlaps are rounding */
#define LEVEL_SINE 1e-6                 /* least sine of a tilt beyond the limit of a range */
#define MAX_TRANSFERS 8                 /* edges that a corner may go on by in a step */

/* ------------------------------------------------------------------------- vectors */

static inline dem_vector vector(double x, double y)
{
  const dem_vector v = {x, y};
  return v;
}
static inline dem_vector add(dem_vector p, dem_vector q) { return vector(p.x + q.x, p.y + q.y); }
static inline dem_vector subtract(dem_vector p, dem_vector q)
{
  return vector(p.x - q.x, p.y - q.y);
}
static inline dem_vector scale(double s, dem_vector p) { return vector(s * p.x, s * p.y); }
static inline double dot(dem_vector p, dem_vector q) { return p.x * q.x + p.y * q.y; }
static inline double cross(dem_vector p, dem_vector q) { return p.x * q.y - p.y * q.x; }
/* p rotated by the angle of the unit vector q */
static inline dem_vector rotate(dem_vector p, dem_vector q)
{
  return vector(p.x * q.x - p.y * q.y, p.x * q.y + p.y * q.x);
}
/* Components of p along and across the unit vector q: p rotated by minus its angle */
static inline dem_vector components(dem_vector p, dem_vector q)
{
  return vector(dot(q, p), cross(q, p));
}
static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }
static inline double sign_of(double x) { return (double) ((x > 0.0) - (x < 0.0)); }

/* ------------------------------------------------------------- a corner over an edge */

static inline dem_vector centroid(const dem_corners *plane, long long block)
{
  return vector(plane->motion[block], plane->motion[plane->n_blocks + block]);
}

/* |x| without the kink, smooth within `width` of 0; writes its derivative */
static inline double smooth_size(double x, double width, double *slope)
{
  const double size = fabs(x);
  if (size >= width) { /* most ends are farther away: no division */
    *slope = sign_of(x);
    return size;
  }
  const double part = size / width;
  *slope = sign_of(x) * part * (4.0 - 3.0 * part);
  return size * part * (2.0 - part);
}

/* Share of its length of joint that a corner keeps at the end of the edge: 1 where the side of the
 * corner along the edge is raised by up to 20 degrees, 0 from 30 degrees on. Writes its derivative by
 * the tilt (1/rad). */
static double share_at_end(double sine, double cosine, double *slope)
{
  *slope = 0.0;
  if (sine >= POINT_SINE || cosine <= 0.0) return 0.0;
  if (sine <= SLIM_SINE) return 1.0;
  const double part = (POINT_SINE - sine) / (POINT_SINE - SLIM_SINE);
  *slope = -6.0 / (POINT_SINE - SLIM_SINE) * part * (1.0 - part) * cosine;
  return part * part * (3.0 - 2.0 * part);
}

/* Length of joint (m) at a corner that stands on an edge at x (m) along it, with the share of it that
 * is kept at the end of the edge. Writes its derivatives by x and by this share. */
static double standing_length(const dem_corners *plane, double x, double edge_length, double share,
                              double *slope, double *by_share)
{
  const double width = smaller(plane->transition_length, 0.5 * edge_length);
  const double to_end = edge_length - x;
  const double part = larger(smaller(smaller(x, to_end) / width, 1.0), 0.0);
  const double length = plane->corner_length * part * part * (3.0 - 2.0 * part);
  *slope = (1.0 - share) * plane->corner_length * 6.0 * part * (1.0 - part) /
           (x < to_end ? width : -width);
  *by_share = plane->corner_length - length;
  return length + share * *by_share;
}

/* 0 for a side that lies on the edge, 1 for one that is raised; writes its derivative by the tilt
 * (1/rad) */
static inline double raised_fraction(double sine, double cosine, double *slope)
{
  const double size = fabs(sine);
  *slope = 0.0;
  if (size >= CORNER_SINE || cosine <= 0.0) return 1.0;
  if (size <= FACE_SINE) return 0.0;
  const double part = (size - FACE_SINE) / (CORNER_SINE - FACE_SINE);
  *slope = 6.0 / (CORNER_SINE - FACE_SINE) * part * (1.0 - part) * cosine;
  return part * part * (3.0 - 2.0 * part);
}

/* Area of contact i, and how closure, sliding and area follow the motions of its blocks.
 *
 * length_gradient, length_per_rotation: derivatives of its length by displacement and by rotation of
 * block b relative to block a, at the contact. */
static void fill_row(const dem_corners *plane, long long i, dem_vector length_gradient,
                     double length_per_rotation)
{
  const dem_vector normal = plane->normal[i], along = vector(normal.y, -normal.x);
  const dem_vector gradient = scale(plane->thickness, length_gradient);
  const double per_rotation = plane->thickness * length_per_rotation;
  const long long blocks[2] = {plane->block_a[i], plane->block_b[i]};
  plane->area[i] = plane->length[i] * plane->thickness;
  for (int s = 0; s < 2; s++) {
    const double sign = s ? 1.0 : -1.0; /* of the motion of b relative to a */
    const dem_vector arm = subtract(plane->position[i], centroid(plane, blocks[s]));
    double *closing = plane->kinematics + 12 * i + 3 * s, *sliding = closing + 6;
    double *area = plane->area_gradient + 6 * i + 3 * s;
    closing[0] = -sign * normal.x;
    closing[1] = -sign * normal.y;
    closing[2] = -sign * cross(arm, normal);
    sliding[0] = sign * along.x;
    sliding[1] = sign * along.y;
    sliding[2] = sign * cross(arm, along);
    area[0] = sign * gradient.x;
    area[1] = sign * gradient.y;
    area[2] = sign * (cross(arm, gradient) + per_rotation);
  }
}

/* Geometry of contact i at the present motion of the blocks.
 *
 * Vectors are in the frame of the edge, whose block is on its left. Side 0 of the corner goes ahead,
 * towards the end of the edge, side 1 towards its start. */
static void locate_contact(const dem_corners *plane, long long i)
{
  static const double ahead[2] = {1.0, -1.0};
  const long long k = plane->n_contacts;
  const long long corner = plane->corner[i], edge = plane->edge[i];
  const long long corner_block = plane->block[corner], edge_block = plane->block[edge];
  const double sign = corner_block > edge_block ? 1.0 : -1.0;
  const double width = plane->transition_length, edge_length = plane->edge_length[edge];
  const dem_vector position = plane->corner_position[corner];
  const dem_vector direction = plane->edge_direction[edge];
  const dem_vector local =
      components(subtract(position, plane->corner_position[edge]), direction);
  const long long sides[2] = {plane->previous[corner], corner};
  const dem_vector *neighbours = plane->neighbour_direction + 2 * edge;
  const dem_vector to_end[2] = {vector(edge_length - local.x, -local.y),
                                vector(-local.x, -local.y)};
  dem_vector side[2], bisector[2], mean[2], remaining[2], gradient[2];
  double raised[2], raised_slope[2], overlap_length[2], lying[2], standing[2], rotation[2], rise[2];
#pragma GCC unroll 2
  for (int s = 0; s < 2; s++) {
    side[s] = scale(-ahead[s], components(plane->edge_direction[sides[s]], direction));
    bisector[s] = vector(ahead[s] + side[s].x, side[s].y);
    mean[s] = scale(1.0 / larger(sqrt(dot(bisector[s], bisector[s])), 1e-9), bisector[s]);
    remaining[s] = components(to_end[s], mean[s]);
    rise[s] = -side[s].y;
  }
#pragma GCC unroll 2
  for (int s = 0; s < 2; s++) {
    /* Overlap of the side with the edge, along their mean direction so that the two blocks may swap
     * roles. It runs from the corner, or from the start of the edge if that comes later, to the end
     * of the edge or of the side, whichever comes first. */
    const dem_vector whole = components(scale(plane->edge_length[sides[s]], side[s]), mean[s]);
    const dem_vector back = rotate(remaining[1 - s], components(mean[1 - s], mean[s]));
    double end_slope, start_slope;
    const double end_size = smooth_size(remaining[s].x - whole.x, width, &end_slope);
    const double start_size = smooth_size(back.x, width, &start_slope);
    const double overlap = 0.5 * (remaining[s].x + whole.x - end_size - back.x - start_size);
    const double by_end = 0.5 - 0.5 * end_slope, by_start = -0.5 - 0.5 * start_slope;
    rotation[s] = 0.5 * (by_end * (remaining[s].y + whole.y) + by_start * back.y - whole.y);
    gradient[s] = scale(-(by_end + by_start), mean[s]);
    raised[s] = raised_fraction(rise[s], ahead[s] * side[s].x, &raised_slope[s]);
    overlap_length[s] = larger(overlap, 0.0);
    lying[s] = overlap > MIN_OVERLAP ? 0.5 * (1.0 - raised[s]) : 0.0;
    standing[s] = rise[s] > 0.0 ? raised[s] : 0.0;
  }
  /* Two blocks of which one stands on the end of the other, such as columns that rock, bear on each
   * other there. Blocks that are drawn with a third one in their common point, such as a wedge in the
   * opening between both, do not. Side `inward` of the corner extends from the nearer end over the
   * edge. */
  const int inward = local.x < edge_length - local.x ? 0 : 1;
  const long long end = inward ? plane->next[edge] : edge; /* corner at the nearer end */
  const int is_junction = plane->is_junction[corner] || plane->is_junction[end];
  const double both = standing[0] * standing[1];
  double corner_length = plane->corner_length, along = 0.0, by_share = 0.0, share_slope = 0.0;
  if (!(smaller(local.x, edge_length - local.x) >= width)) {
    const double cosine = ahead[inward] * side[inward].x;
    const double share = is_junction ? 0.0 : share_at_end(rise[inward], cosine, &share_slope);
    corner_length = standing_length(plane, local.x, edge_length, share, &along, &by_share);
  }
  double length_per_rotation = -ahead[inward] * both * by_share * share_slope;
  dem_vector length_gradient = vector(both * along, 0.0);
#pragma GCC unroll 2
  for (int s = 0; s < 2; s++) {
    const double up = sign_of(rise[s]);
    const double by_tilt =
        corner_length * (up > 0.0) * standing[1 - s] - 0.5 * overlap_length[s] * up;
    length_per_rotation += lying[s] * rotation[s] - ahead[s] * raised_slope[s] * by_tilt;
    length_gradient = add(length_gradient, scale(lying[s], gradient[s]));
    plane->tilt_sine[s * k + i] = rise[s];
    plane->overlap_length[s * k + i] = lying[s] * overlap_length[s];
    /* At its limit the range of the corner meets another one: of the next corner, reached along a
     * side of this corner, or of the next edge of the other block. The one that is rotated less
     * comes next, and the limit is where both are equally deep. Where a side is raised, its corner
     * comes next. Joints are drawn parallel but for rounding, which must not decide: within
     * DEM_PARALLEL_SINE they count as parallel. */
    const dem_vector beyond = scale(ahead[s], neighbours[s]);
    const int corner_next = ahead[s] * cross(side[s], beyond) <= DEM_PARALLEL_SINE ||
                            rise[1 - s] < -DEM_PARALLEL_SINE;
    const dem_vector toward = corner_next ? bisector[s] : vector(ahead[s] + beyond.x, beyond.y);
    plane->corner_takes_over[s * k + i] = (unsigned char) corner_next;
    plane->range_margin[s * k + i] =
        -dot(to_end[1 - s], toward) * (corner_next ? fabs(rise[s]) + LEVEL_SINE : 1.0);
  }
  plane->length[i] = plane->overlap_length[i] + plane->overlap_length[k + i] +
                     corner_length * both;
  plane->position[i] = position;
  plane->normal[i] = vector(sign * direction.y, -sign * direction.x);
  plane->closure[i] = local.y;
  plane->block_a[i] = corner_block < edge_block ? corner_block : edge_block;
  plane->block_b[i] = corner_block < edge_block ? edge_block : corner_block;
  fill_row(plane, i, scale(sign, rotate(length_gradient, direction)), sign * length_per_rotation);
}

/* Corners of all blocks and directions of their edges, at the present motion */
static void locate_corners(const dem_corners *plane)
{
  dem_vector unit = vector(1.0, 0.0);
  for (long long c = 0, last = -1; c < plane->n_corners; c++) {
    const long long block = plane->block[c];
    if (block != last) {
      const double angle = plane->motion[2 * plane->n_blocks + block];
      unit = vector(cos(angle), sin(angle));
      last = block;
    }
    plane->corner_position[c] = add(centroid(plane, block), rotate(plane->local_corner[c], unit));
    plane->edge_direction[c] = rotate(plane->local_direction[c], unit);
  }
}

/* Geometry of all contacts, each on its corner and edge, at the present motion */
EXPORT void dem_locate_contacts(dem_corners *plane)
{
  locate_corners(plane);
  for (long long i = 0; i < plane->n_contacts; i++) locate_contact(plane, i);
}

/* Corner and edge of the contact that comes next at the nearer limit of the range of contact i;
 * returns whether the corner at the end of the edge takes over */
static int next_contact(const dem_corners *plane, long long i, long long *next_corner,
                        long long *next_edge)
{
  const long long k = plane->n_contacts;
  const int s = plane->range_margin[k + i] < plane->range_margin[i];
  const int swaps = plane->corner_takes_over[s * k + i];
  const long long corner = plane->corner[i], edge = plane->edge[i];
  const long long beyond = s ? plane->next[edge] : edge;
  const long long neighbour = s ? plane->next[edge] : plane->previous[edge];
  const long long side = s ? corner : plane->previous[corner];
  *next_corner = swaps ? beyond : corner;
  *next_edge = swaps ? side : neighbour;
  return swaps;
}

/* Corners and edges (k,) of the contacts that come next at the nearer limits of the ranges */
EXPORT void dem_next_contacts(const dem_corners *plane, long long *next_corner, long long *next_edge)
{
  for (long long i = 0; i < plane->n_contacts; i++)
    next_contact(plane, i, next_corner + i, next_edge + i);
}

static int is_out_of_range(const dem_corners *plane, long long i)
{
  return plane->range_margin[i] < -DEM_RANGE_TOLERANCE ||
         plane->range_margin[plane->n_contacts + i] < -DEM_RANGE_TOLERANCE;
}

static int is_duplicate(const dem_corners *plane, long long i)
{
  for (long long j = 0; j < plane->n_contacts; j++)
    if (j != i && plane->corner[j] == plane->corner[i] && plane->edge[j] == plane->edge[i]) return 1;
  return 0;
}

/* Have the contacts of both blocks of contact i searched again */
static void request_rebuild(dem_corners *plane, long long i)
{
  plane->needs_rebuild[plane->block_a[i]] = 1;
  plane->needs_rebuild[plane->block_b[i]] = 1;
}

/* All contacts at the present motion. A corner that has left its range goes on to the corner or edge
 * that comes next, and its contact goes with it. Where another contact may begin beside it, the
 * contacts of its blocks are searched again. begin, end: all contacts, 0 to k; one contact may go on
 * to the place of another. Returns the number of contacts that went on. */
EXPORT long long dem_update_contacts(void *corners, long long begin, long long end)
{
  dem_corners *plane = (dem_corners *) corners;
  long long n_rows = 0;
  locate_corners(plane);
  for (long long i = begin; i < end; i++) {
    locate_contact(plane, i);
    plane->previous_length[i] = plane->length[i];
    if (is_out_of_range(plane, i)) plane->work_rows[n_rows++] = i;
  }
  const long long n_transferred = n_rows;
  for (int transfer = 0; transfer < MAX_TRANSFERS && n_rows; transfer++) {
    long long n_remaining = 0;
    for (long long j = 0; j < n_rows; j++) {
      const long long i = plane->work_rows[j];
      if (!next_contact(plane, i, plane->corner + i, plane->edge + i)) request_rebuild(plane, i);
      locate_contact(plane, i);
    }
    for (long long j = 0; j < n_rows; j++)
      if (is_duplicate(plane, plane->work_rows[j])) request_rebuild(plane, plane->work_rows[j]);
    for (long long j = 0; j < n_rows; j++)
      if (is_out_of_range(plane, plane->work_rows[j]))
        plane->work_rows[n_remaining++] = plane->work_rows[j];
    n_rows = n_remaining;
  }
  return n_transferred;
}

/* Contacts that store energy (stored_energy (k,) in J/m2) and whose length has changed as they went on
 * to other edges in the last update. Writes them to plane->work_rows; returns their number. */
EXPORT long long dem_changed_lengths(dem_corners *plane, const double *stored_energy)
{
  long long n_rows = 0;
  for (long long i = 0; i < plane->n_contacts; i++) {
    const double before = plane->previous_length[i], change = fabs(plane->length[i] - before);
    if (change > DEM_LENGTH_TOLERANCE * before && stored_energy[i] * before > 0.0)
      plane->work_rows[n_rows++] = i;
  }
  return n_rows;
}

/* Height (m) of a corner above the line of an edge */
static double height(const dem_corners *plane, long long corner, long long edge)
{
  return -cross(plane->edge_direction[edge],
                subtract(plane->corner_position[corner], plane->corner_position[edge]));
}

/* Corners over edges of pairs (p, 2) of blocks, at most `max_gap` (p,) above them and at most
 * `max_depth` (p,) below, in m.
 *
 * first_corner (n + 1,): of each block. Writes at most `capacity` candidates: corner, edge, and pair
 * (pair + p where the corner belongs to the second block); and the separation (2, p) of the blocks
 * in m, negative where they overlap. Returns the number of candidates. */
EXPORT long long dem_find_candidates(const dem_corners *plane, long long p, const long long *pairs,
                                     const long long *first_corner, const double *max_gap,
                                     const double *max_depth, long long capacity,
                                     long long *corner, long long *edge, long long *pair,
                                     double *separation)
{
  long long n_candidates = 0;
  locate_corners(plane);
  for (long long i = 0; i < 2 * p; i++) {
    const long long j = i % p;
    const long long x = pairs[2 * j + (i >= p)], y = pairs[2 * j + (i < p)];
    separation[i] = -HUGE_VAL;
    for (long long e = first_corner[y]; e < first_corner[y + 1]; e++) {
      double lowest = HUGE_VAL;
      for (long long c = first_corner[x]; c < first_corner[x + 1]; c++)
        lowest = smaller(lowest, height(plane, c, e));
      separation[i] = larger(separation[i], lowest);
    }
    for (long long c = first_corner[x]; c < first_corner[x + 1]; c++)
      for (long long e = first_corner[y]; e < first_corner[y + 1]; e++) {
        const double gap = height(plane, c, e);
        if (!(gap < max_gap[j] && gap > -max_depth[j])) continue;
        if (n_candidates < capacity) {
          corner[n_candidates] = c;
          edge[n_candidates] = e;
          pair[n_candidates] = i;
        }
        n_candidates++;
      }
  }
  return n_candidates;
}

/* ------------------------------------------------------------------------- seams */

/* The two edges whose faces meet at contact i, in the order of their blocks. Of the two sides of the
 * corner, the one with the smaller tilt. */
static void find_edge_pair(const dem_corners *plane, long long i, long long pair[2])
{
  const double *tilt = plane->tilt_sine + i;
  const long long edge = plane->edge[i], corner = plane->corner[i];
  const int first_is_flatter = tilt[0] < tilt[plane->n_contacts] - DEM_PARALLEL_SINE;
  const long long side = first_is_flatter ? plane->previous[corner] : corner;
  pair[0] = side < edge ? side : edge;
  pair[1] = side < edge ? edge : side;
}

/* The edges (k, 2) that meet at all contacts */
EXPORT void dem_edge_pairs(const dem_corners *plane, long long *pairs)
{
  for (long long i = 0; i < plane->n_contacts; i++) find_edge_pair(plane, i, pairs + 2 * i);
}

/* Number of the law between two edges that meet: of the last table in laws->tables that names their
 * blocks, else of the joint set that cut both edges, else the default */
static long long law_of(const dem_corners *plane, const dem_edge_laws *laws, const long long pair[2])
{
  const long long a = plane->block[pair[0]], b = plane->block[pair[1]];
  const long long first = laws->law_of_edge[pair[0]], second = laws->law_of_edge[pair[1]];
  for (long long t = laws->n_tables - 1; t >= 0; t--) {
    const long long *table = laws->tables + 3 * t;
    if ((table[0] < 0 || table[0] == a) && (table[1] < 0 || table[1] == b)) return table[2];
  }
  return first == second && first >= 0 ? first : laws->default_law;
}

/* Laws (m,) between pairs (m, 2) of edges */
EXPORT void dem_laws_of(const dem_corners *plane, const dem_edge_laws *laws, long long m,
                        const long long *pairs, long long *law)
{
  for (long long i = 0; i < m; i++) law[i] = law_of(plane, laws, pairs + 2 * i);
}

/* Whether an edge of another block continues an edge across a seam: parallel within 2 degrees, and
 * the ends at the seam within a skin of each other, and within DEM_MAX_SEAM_STEP of it across */
static int is_coplanar(const dem_corners *plane, long long edge, long long other, double skin)
{
  const dem_vector *start = plane->corner_position;
  const dem_vector direction = plane->edge_direction[other];
  const dem_vector angle = components(plane->edge_direction[edge], direction);
  const dem_vector to_next =
      components(subtract(start[edge], start[plane->next[other]]), direction);
  const dem_vector to_previous =
      components(subtract(start[plane->next[edge]], start[other]), direction);
  const dem_vector seam = dot(to_next, to_next) < dot(to_previous, to_previous) ? to_next : to_previous;
  return plane->block[edge] != plane->block[other] && angle.x > 0.0 && fabs(angle.y) <= FACE_SINE &&
         dot(seam, seam) <= skin * skin && fabs(seam.y) <= DEM_MAX_SEAM_STEP * skin;
}

/* Contacts whose joints continue the joints of neighbours across a seam, and these neighbours.
 *
 * Such a contact bears nothing, and is new or meets between other edges than the ones between which it
 * was found. It shares an edge with its neighbour, and their other edges belong to two blocks and are
 * coplanar. The neighbour stores energy, has the law that the edges of the contact need, and is as
 * deep within DEM_MAX_SEAM_STEP of a skin. Of several ones the nearest is taken.
 *
 * Writes contacts, their edges and their neighbours; returns the number of them. */
EXPORT long long dem_find_neighbours(dem_seams *seams)
{
  const dem_corners *plane = (const dem_corners *) seams->corners;
  long long *rows = seams->rows, *sources = seams->sources;
  long long m = 0, n_found = 0, pair[2];
  for (long long i = 0; i < plane->n_contacts; i++) {
    const double *traction = seams->traction + 2 * i;
    long long *edges = seams->edges + 2 * m;
    if (seams->stored_energy[i] != 0.0 || traction[0] != 0.0 || traction[1] != 0.0) continue;
    find_edge_pair(plane, i, edges);
    if (!seams->is_new[i] && edges[0] == seams->face_pairs[2 * i] &&
        edges[1] == seams->face_pairs[2 * i + 1])
      continue;
    rows[m] = i;
    sources[m] = -1;
    seams->distance[m++] = HUGE_VAL;
  }
  if (m == 0) return 0;
  for (long long side = 0; side < 2 * m; side++) { /* sides of these contacts by their edges */
    seams->next_side[side] = seams->first_side[seams->edges[side]];
    seams->first_side[seams->edges[side]] = side;
  }
  for (long long i = 0; i < plane->n_contacts; i++) {
    if (!(seams->stored_energy[i] > 0.0)) continue;
    find_edge_pair(plane, i, pair);
    for (int s = 0; s < 2; s++)
      for (long long side = seams->first_side[pair[s]]; side >= 0; side = seams->next_side[side]) {
        const long long j = side / 2, row = rows[j], other = seams->edges[4 * j + 1 - side];
        const double *skins = seams->skins;
        const double skin = 0.5 * (skins[plane->block_a[row]] + skins[plane->block_b[row]]);
        const dem_vector apart = subtract(plane->position[i], plane->position[row]);
        const double distance = sqrt(dot(apart, apart));
        if (distance < seams->distance[j] &&
            fabs(plane->closure[i] - plane->closure[row]) <= DEM_MAX_SEAM_STEP * skin &&
            seams->law[i] == law_of(plane, seams->laws, seams->edges + 2 * j) &&
            is_coplanar(plane, pair[1 - s], other, skins[plane->block[other]])) {
          seams->distance[j] = distance;
          sources[j] = i;
        }
      }
  }
  for (long long side = 0; side < 2 * m; side++) seams->first_side[seams->edges[side]] = -1;
  for (long long j = 0; j < m; j++) {
    if (sources[j] < 0) continue;
    rows[n_found] = rows[j];
    sources[n_found] = sources[j];
    seams->edges[2 * n_found] = seams->edges[2 * j];
    seams->edges[2 * n_found + 1] = seams->edges[2 * j + 1];
    n_found++;
  }
  return n_found;
}
