/* blocks.c: one time step of rigid blocks in two dimensions, around the step of the joint law.
 *
 * Python owns every array and keeps it in place; nothing here allocates or keeps memory. layout.h,
 * made from layout.py, describes the arrays. n blocks, c corners, k contacts; SI units; vectors are
 * pairs x, y. A time step is
 *   dem_move_blocks   positions, contacts, increments of the law
 *   the law           by jointlaw, one batch of joints for each law
 *   dem_finish_step   tractions, forces, energies, velocities
 * docs/blocks.md describes the method.
 */
#include <math.h>

#include "export.h"
#include "layout.h"

#define FACE_SINE 0.03489949670250097   /* of 2 degrees: up to this tilt an edge lies on another */
#define CORNER_SINE 0.08715574274765817 /* of 5 degrees: from this tilt on only its corner touches */
#define MIN_OVERLAP 1e-10               /* m: shorter overlaps are rounding */
#define LEVEL_SINE 1e-6                 /* least sine of a tilt beyond the limit of a range */
#define MAX_TRANSFERS 8                 /* edges that a corner may go on by in a step */

/* Hash of the sources that this library was built from */
EXPORT const char *dem_sources(void) { return DEM_SOURCES; }

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

static inline dem_vector centroid(const dem_step *sim, long long block)
{
  return vector(sim->motion[block], sim->motion[sim->n_blocks + block]);
}

/* Velocity of the point p of a block */
static inline dem_vector velocity_at(const dem_step *sim, long long block, dem_vector p)
{
  const long long n = sim->n_blocks;
  const dem_vector arm = subtract(p, centroid(sim, block));
  const double spin = sim->motion[5 * n + block];
  return vector(sim->motion[3 * n + block] - spin * arm.y,
                sim->motion[4 * n + block] + spin * arm.x);
}

/* |x| without the kink, smooth within `width` of 0; writes its derivative */
static inline double smooth_size(double x, double width, double *slope)
{
  const double size = fabs(x), part = smaller(size / width, 1.0);
  *slope = sign_of(x) * part * (4.0 - 3.0 * part);
  return size * part * (2.0 - part);
}

/* Length of joint (m) at a corner that stands on an edge at x (m) along it: none at the ends of the
 * edge, where blocks meet in a point. Writes its derivative by x. */
static double standing_length(const dem_step *sim, double x, double edge_length, double *slope)
{
  const double width = smaller(sim->transition_length, 0.5 * edge_length);
  const double to_end = edge_length - x;
  const double part = larger(smaller(smaller(x, to_end) / width, 1.0), 0.0);
  *slope = sim->corner_length * 6.0 * part * (1.0 - part) / (x < to_end ? width : -width);
  return sim->corner_length * part * part * (3.0 - 2.0 * part);
}

/* 0 for a side that lies on the edge, 1 for one that is raised; writes its derivative by the tilt
 * (1/rad) */
static inline double raised_fraction(double sine, double cosine, double *slope)
{
  double part = (fabs(sine) - FACE_SINE) / (CORNER_SINE - FACE_SINE);
  part = smaller(larger(part, cosine <= 0.0 ? 1.0 : 0.0), 1.0);
  *slope = 6.0 / (CORNER_SINE - FACE_SINE) * part * (1.0 - part) * cosine;
  return part * part * (3.0 - 2.0 * part);
}

/* Geometry and rates of contact i at the present motion of the blocks.
 *
 * Vectors are in the frame of the edge, whose block is on its left. Side 0 of the corner goes ahead,
 * towards the end of the edge, side 1 towards its start. */
static void locate_contact(const dem_step *sim, long long i)
{
  static const double ahead[2] = {1.0, -1.0};
  const long long k = sim->n_contacts;
  const long long corner = sim->corner[i], edge = sim->edge[i];
  const long long corner_block = sim->block[corner], edge_block = sim->block[edge];
  const double sign = corner_block > edge_block ? 1.0 : -1.0;
  const double width = sim->transition_length, edge_length = sim->edge_length[edge];
  const dem_vector position = sim->corner_position[corner];
  const dem_vector direction = sim->edge_direction[edge];
  const dem_vector local =
      components(subtract(position, sim->corner_position[edge]), direction);
  const long long sides[2] = {sim->previous[corner], corner};
  const long long neighbours[2] = {sim->previous[edge], sim->next[edge]};
  const dem_vector to_end[2] = {vector(edge_length - local.x, -local.y),
                                vector(-local.x, -local.y)};
  dem_vector side[2], bisector[2], mean[2], remaining[2], gradient[2];
  double raised[2], raised_slope[2], overlap_length[2], lying[2], standing[2], rotation[2], rise[2];
  for (int s = 0; s < 2; s++) {
    side[s] = scale(-ahead[s], components(sim->edge_direction[sides[s]], direction));
    bisector[s] = vector(ahead[s] + side[s].x, side[s].y);
    mean[s] = scale(1.0 / larger(sqrt(dot(bisector[s], bisector[s])), 1e-9), bisector[s]);
    remaining[s] = components(to_end[s], mean[s]);
    rise[s] = -side[s].y;
  }
  for (int s = 0; s < 2; s++) {
    /* Overlap of the side with the edge, along their mean direction so that the two blocks may swap
     * roles. It runs from the corner, or from the start of the edge if that comes later, to the end
     * of the edge or of the side, whichever comes first. */
    const dem_vector whole = components(scale(sim->edge_length[sides[s]], side[s]), mean[s]);
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
  double length_per_rotation = 0.0, along;
  const double corner_length = standing_length(sim, local.x, edge_length, &along);
  dem_vector length_gradient = vector(standing[0] * standing[1] * along, 0.0);
  for (int s = 0; s < 2; s++) {
    const double up = sign_of(rise[s]);
    const double by_tilt =
        corner_length * (up > 0.0) * standing[1 - s] - 0.5 * overlap_length[s] * up;
    length_per_rotation += lying[s] * rotation[s] - ahead[s] * raised_slope[s] * by_tilt;
    length_gradient = add(length_gradient, scale(lying[s], gradient[s]));
    sim->tilt_sine[s * k + i] = rise[s];
    sim->overlap_length[s * k + i] = lying[s] * overlap_length[s];
    /* At its limit the range of the corner meets another one: of the next corner, reached along a
     * side of this corner, or of the next edge of the other block. The one that is rotated less
     * comes next, and the limit is where both are equally deep. Where a side is raised, its corner
     * comes next. Joints are drawn parallel but for rounding, which must not decide: within
     * DEM_PARALLEL_SINE they count as parallel. */
    const dem_vector beyond = scale(ahead[s], components(sim->local_direction[neighbours[s]],
                                                         sim->local_direction[edge]));
    const int corner_next = ahead[s] * cross(side[s], beyond) <= DEM_PARALLEL_SINE ||
                            rise[1 - s] < -DEM_PARALLEL_SINE;
    const dem_vector toward = corner_next ? bisector[s] : vector(ahead[s] + beyond.x, beyond.y);
    sim->corner_takes_over[s * k + i] = (unsigned char) corner_next;
    sim->range_margin[s * k + i] =
        -dot(to_end[1 - s], toward) * (corner_next ? fabs(rise[s]) + LEVEL_SINE : 1.0);
  }
  sim->length[i] = sim->overlap_length[i] + sim->overlap_length[k + i] +
                   corner_length * standing[0] * standing[1];
  sim->length_gradient[i] = scale(sign, rotate(length_gradient, direction));
  sim->length_per_rotation[i] = sign * length_per_rotation;
  sim->position[i] = position;
  sim->normal[i] = vector(sign * direction.y, -sign * direction.x);
  sim->closure[i] = local.y;
  sim->block_a[i] = corner_block < edge_block ? corner_block : edge_block;
  sim->block_b[i] = corner_block < edge_block ? edge_block : corner_block;
  const dem_vector velocity = subtract(velocity_at(sim, sim->block_b[i], position),
                                       velocity_at(sim, sim->block_a[i], position));
  sim->opening_rate[i] = dot(velocity, sim->normal[i]);
  sim->sliding_rate[i] = -cross(sim->normal[i], velocity);
}

/* Corners of all blocks and directions of their edges, at the present motion */
static void locate_corners(const dem_step *sim)
{
  dem_vector unit = vector(1.0, 0.0);
  for (long long c = 0, last = -1; c < sim->n_corners; c++) {
    const long long block = sim->block[c];
    if (block != last) {
      const double angle = sim->motion[2 * sim->n_blocks + block];
      unit = vector(cos(angle), sin(angle));
      last = block;
    }
    sim->corner_position[c] = add(centroid(sim, block), rotate(sim->local_corner[c], unit));
    sim->edge_direction[c] = rotate(sim->local_direction[c], unit);
  }
}

/* Geometry and rates of all contacts, each on its corner and edge, at the present motion */
EXPORT void dem_locate_contacts(dem_step *sim)
{
  locate_corners(sim);
  for (long long i = 0; i < sim->n_contacts; i++) locate_contact(sim, i);
}

/* Corner and edge of the contact that comes next at the nearer limit of the range of contact i;
 * returns whether the corner at the end of the edge takes over */
static int next_contact(const dem_step *sim, long long i, long long *next_corner,
                        long long *next_edge)
{
  const long long k = sim->n_contacts;
  const int s = sim->range_margin[k + i] < sim->range_margin[i];
  const int swaps = sim->corner_takes_over[s * k + i];
  const long long corner = sim->corner[i], edge = sim->edge[i];
  const long long beyond = s ? sim->next[edge] : edge;
  const long long neighbour = s ? sim->next[edge] : sim->previous[edge];
  const long long side = s ? corner : sim->previous[corner];
  *next_corner = swaps ? beyond : corner;
  *next_edge = swaps ? side : neighbour;
  return swaps;
}

/* Corners and edges (k,) of the contacts that come next at the nearer limits of the ranges */
EXPORT void dem_next_contacts(const dem_step *sim, long long *next_corner, long long *next_edge)
{
  for (long long i = 0; i < sim->n_contacts; i++)
    next_contact(sim, i, next_corner + i, next_edge + i);
}

static int is_out_of_range(const dem_step *sim, long long i)
{
  return sim->range_margin[i] < -DEM_RANGE_TOLERANCE ||
         sim->range_margin[sim->n_contacts + i] < -DEM_RANGE_TOLERANCE;
}

static int is_duplicate(const dem_step *sim, long long i)
{
  for (long long j = 0; j < sim->n_contacts; j++)
    if (j != i && sim->corner[j] == sim->corner[i] && sim->edge[j] == sim->edge[i]) return 1;
  return 0;
}

/* Have the contacts of both blocks of contact i searched again */
static void request_rebuild(dem_step *sim, long long i)
{
  sim->needs_rebuild[sim->block_a[i]] = 1;
  sim->needs_rebuild[sim->block_b[i]] = 1;
}

/* All contacts at the present motion. A corner that has left its range goes on to the corner or edge
 * that comes next, and its contact goes with it. Where another contact may begin beside it, the
 * contacts of its blocks are searched again. */
EXPORT void dem_update_contacts(dem_step *sim)
{
  long long n_rows = 0;
  locate_corners(sim);
  for (long long i = 0; i < sim->n_contacts; i++) {
    locate_contact(sim, i);
    sim->previous_length[i] = sim->length[i];
    if (is_out_of_range(sim, i)) sim->work_rows[n_rows++] = i;
  }
  sim->transferred = n_rows;
  for (int transfer = 0; transfer < MAX_TRANSFERS && n_rows; transfer++) {
    long long n_remaining = 0;
    for (long long j = 0; j < n_rows; j++) {
      const long long i = sim->work_rows[j];
      if (!next_contact(sim, i, sim->corner + i, sim->edge + i)) request_rebuild(sim, i);
      locate_contact(sim, i);
    }
    for (long long j = 0; j < n_rows; j++)
      if (is_duplicate(sim, sim->work_rows[j])) request_rebuild(sim, sim->work_rows[j]);
    for (long long j = 0; j < n_rows; j++)
      if (is_out_of_range(sim, sim->work_rows[j]))
        sim->work_rows[n_remaining++] = sim->work_rows[j];
    n_rows = n_remaining;
  }
}

/* Height (m) of a corner above the line of an edge */
static double height(const dem_step *sim, long long corner, long long edge)
{
  return -cross(sim->edge_direction[edge],
                subtract(sim->corner_position[corner], sim->corner_position[edge]));
}

/* Corners over edges of pairs (p, 2) of blocks, at most `max_gap` (p,) above them and at most
 * `max_depth` (p,) below, in m.
 *
 * first_corner (n + 1,): of each block. Writes at most `capacity` candidates: corner, edge, and pair
 * (pair + p where the corner belongs to the second block); and the separation (2, p) of the blocks
 * in m, negative where they overlap. Returns the number of candidates. */
EXPORT long long dem_find_candidates(const dem_step *sim, long long p, const long long *pairs,
                                     const long long *first_corner, const double *max_gap,
                                     const double *max_depth, long long capacity,
                                     long long *corner, long long *edge, long long *pair,
                                     double *separation)
{
  long long n_candidates = 0;
  locate_corners(sim);
  for (long long i = 0; i < 2 * p; i++) {
    const long long j = i % p;
    const long long x = pairs[2 * j + (i >= p)], y = pairs[2 * j + (i < p)];
    separation[i] = -HUGE_VAL;
    for (long long e = first_corner[y]; e < first_corner[y + 1]; e++) {
      double lowest = HUGE_VAL;
      for (long long c = first_corner[x]; c < first_corner[x + 1]; c++)
        lowest = smaller(lowest, height(sim, c, e));
      separation[i] = larger(separation[i], lowest);
    }
    for (long long c = first_corner[x]; c < first_corner[x + 1]; c++)
      for (long long e = first_corner[y]; e < first_corner[y + 1]; e++) {
        const double gap = height(sim, c, e);
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

/* ------------------------------------------------------------------------ before the law */

/* Displacement increments of all joints, at their places for their laws; notes a contact that
 * overlaps too much */
EXPORT void dem_set_increments(dem_step *sim, double dt)
{
  sim->too_deep = -1;
  for (long long i = 0; i < sim->n_contacts; i++) {
    const double closure = sim->closure[i], offset = sim->closure_offset[i];
    const double limit =
        smaller(sim->max_overlap[sim->block_a[i]], sim->max_overlap[sim->block_b[i]]);
    if (sim->length[i] > 0.0 && closure > limit) sim->too_deep = i;
    const double joint_closure = closure - (closure > 0.0 || offset < 0.0 ? offset : 0.0);
    double *d = sim->laws[sim->law[i]].d + 2 * sim->place[i];
    d[0] = (joint_closure - sim->delta[2 * i]) / sim->law_steps;
    d[1] = sim->sliding_rate[i] * dt / (sim->law_steps * sim->reduction[1]);
  }
}

/* Move the blocks, update their contacts, and set the increments of the law.
 *
 * Notes a block that is too fast, before any has moved, and whether contacts must be searched
 * again. */
EXPORT void dem_move_blocks(dem_step *sim, double dt)
{
  const long long n = sim->n_blocks;
  sim->too_fast = -1;
  sim->rebuild = 0;
  for (long long i = 0; i < n; i++) {
    const double *v = sim->velocity + i;
    const double speed = fabs(v[0]) + fabs(v[n]) + fabs(v[2 * n]) * sim->radius[i];
    const int is_slow = speed * dt < sim->max_skin_per_step * sim->skin[i]; /* false for NaN */
    if (sim->is_mobile[i] && !is_slow) sim->too_fast = i;
  }
  if (sim->too_fast >= 0) return;
  for (long long i = 0; i < n; i++) {
    double *m = sim->motion + i, moved[3];
    if (!sim->is_mobile[i]) continue;
    for (int j = 0; j < 3; j++) {
      m[(3 + j) * n] = sim->velocity[j * n + i];
      m[j * n] += dt * m[(3 + j) * n];
      moved[j] = m[j * n] - sim->rebuilt_at[j * n + i];
    }
    const double distance =
        sqrt(moved[0] * moved[0] + moved[1] * moved[1]) + fabs(moved[2]) * sim->radius[i];
    if (distance > sim->max_skin_until_rebuild * sim->skin[i]) sim->rebuild = 1;
  }
  dem_update_contacts(sim);
  for (long long i = 0; i < n && sim->transferred; i++) sim->rebuild |= sim->needs_rebuild[i];
  dem_set_increments(sim, dt);
}

/* ------------------------------------------------------------------------- after the law */

/* Results of the law for each contact: traction, displacement since first touch, and the others */
EXPORT void dem_read_joints(dem_step *sim)
{
  const long long k = sim->n_contacts;
  for (long long i = 0; i < k; i++) {
    const dem_law_joints *law = sim->laws + sim->law[i];
    const double *F = law->F + 2 * sim->place[i];
    const double *measures = law->measures + (DEM_MEASURES + 2) * sim->place[i];
    const double *displacement = measures + DEM_MEASURES;
    sim->traction[2 * i] = F[0];
    sim->traction[2 * i + 1] = F[1] / sim->reduction[1];
    for (int r = 0; r < DEM_MEASURES; r++) sim->measures[r * k + i] = measures[r];
    if (!law->bears_tension) sim->measures[DEM_DAMAGE * k + i] = 1.0;
    sim->delta[2 * i] = displacement[0] - sim->first_touch[2 * i];
    sim->delta[2 * i + 1] =
        (displacement[1] - sim->first_touch[2 * i + 1]) * sim->reduction[1];
  }
}

/* Upper bound of the stiffness (Pa/m) of contact i at its normal stress, by linear interpolation on
 * the first-loading curve */
static double stiffness_bound(const dem_step *sim, long long i)
{
  const double stress = sim->traction[2 * i];
  const dem_law_joints *law = sim->laws + sim->law[i];
  const double *x = law->stress, *y = law->stiffness;
  long long low = 0, high = law->points - 1;
  const int is_bonded = sim->measures[DEM_DAMAGE * sim->n_contacts + i] < 1.0;
  if (!(stress > 0.0) && !is_bonded) return 0.0;
  if (stress <= x[0]) return y[0];
  if (stress >= x[high]) return y[high];
  while (high - low > 1) {
    const long long middle = (low + high) / 2;
    if (x[middle] <= stress) low = middle;
    else high = middle;
  }
  return y[low] + (y[high] - y[low]) / (x[high] - x[low]) * (stress - x[low]);
}

/* Add a force f at contact i to its block b and the opposite to block a; and a couple */
static void apply_pair(const dem_step *sim, double *force, long long i, dem_vector f, double couple)
{
  double *a = force + 3 * sim->block_a[i], *b = force + 3 * sim->block_b[i];
  a[0] -= f.x;
  a[1] -= f.y;
  a[2] += couple - cross(subtract(sim->position[i], centroid(sim, sim->block_a[i])), f);
  b[0] += f.x;
  b[1] += f.y;
  b[2] -= couple - cross(subtract(sim->position[i], centroid(sim, sim->block_b[i])), f);
}

/* Forces of the joint of contact i on its blocks, and of its dashpots; returns its stiffness (N/m) */
static double apply_joint(const dem_step *sim, long long i, double *total, double *damped)
{
  const long long k = sim->n_contacts;
  const double area = sim->length[i] * sim->thickness;
  const double stiffness = stiffness_bound(sim, i) * area;
  const double energy = sim->measures[DEM_STORED_ENERGY * k + i] * sim->thickness; /* J/m */
  const double push = area * sim->traction[2 * i], shear = area * sim->traction[2 * i + 1];
  const double damage = sim->measures[DEM_DAMAGE * k + i];
  const dem_vector normal = sim->normal[i], along = vector(normal.y, -normal.x);
  const dem_vector force = subtract(scale(push, normal), scale(shear, along));
  apply_pair(sim, total, i, subtract(force, scale(energy, sim->length_gradient[i])),
             energy * sim->length_per_rotation[i]);
  /* 2 sqrt(stiffness * reduced mass), with half a joint for each block */
  const double inverse_mass =
      sim->inverse_mass[sim->block_a[i]] + sim->inverse_mass[sim->block_b[i]];
  if (!(inverse_mass > 0.0)) return stiffness;
  const double critical = 2.0 * sqrt(stiffness * (0.5 / inverse_mass));
  double resist = -sim->dashpot_normal * critical * sim->opening_rate[i];
  if (!(damage < 1.0)) resist = larger(resist, -push); /* only a bond pulls */
  const double stick = larger(
      1.0 - sim->measures[DEM_SEPARATED * k + i] - sim->measures[DEM_SLIPPING * k + i], 1.0 - damage);
  const double drag = -sim->dashpot_shear * critical * stick * sim->sliding_rate[i];
  apply_pair(sim, damped, i, add(scale(resist, normal), scale(drag, along)), 0.0);
  return stiffness;
}

/* Forces on all blocks: joints, dashpots, weight and loads, and the reactions of drives that bring
 * their blocks to the prescribed velocities within dt. Counts the joints that are stiffer than the
 * time step allows. */
EXPORT void dem_compute_forces(dem_step *sim, double dt)
{
  const long long n = sim->n_blocks;
  double *total = sim->forces, *damped = total + 3 * n, *driven = damped + 3 * n;
  for (long long i = 0; i < 6 * n; i++) sim->previous_forces[i] = damped[i];
  for (long long i = 0; i < 9 * n; i++) total[i] = 0.0;
  sim->stiffened = 0;
  for (long long i = 0; i < sim->n_contacts; i++)
    sim->stiffened += apply_joint(sim, i, total, damped) > sim->checked_stiffness[i];
  for (long long i = 0; i < n; i++)
    for (int j = 0; j < 3; j++) {
      const long long at = 3 * i + j;
      if (!sim->is_mobile[i]) total[at] = damped[at] = 0.0;
      else
        total[at] = (total[at] + damped[at]) +
                    (sim->gravity[at] + sim->loads[at] + sim->bolt_forces[at]);
    }
  for (long long i = 0; i < sim->n_driven; i++) {
    const long long block = sim->driven_block[i], axis = sim->driven_axis[i];
    const long long at = 3 * block + axis;
    const double change = sim->driven_velocity[i] - sim->motion[(3 + axis) * n + block];
    driven[at] = sim->inertia[at] * change / dt - total[at];
    total[at] += driven[at];
  }
}

/* Add a step to the energy balance: dem_demo/dynamics/energy_balance.py explains it */
static void add_energies(dem_step *sim, double dt)
{
  const long long n = sim->n_blocks, k = sim->n_contacts;
  double *energy = sim->energy;
  double kinetic = 0.0, gravity_work = 0.0, load_work = 0.0, turned_over = 0.0;
  double stored = 0.0, friction = 0.0;
  double power[2] = {0.0, 0.0}; /* twice that of dashpots and drives */
  for (long long i = 0; i < n; i++) {
    double gravity_power = 0.0, load_power = 0.0;
    if (!sim->is_mobile[i]) continue;
    for (int j = 0; j < 3; j++) {
      const long long at = 3 * i + j;
      const double v = sim->motion[(3 + j) * n + i];
      kinetic += v * (sim->inertia[at] * v + dt * sim->forces[at]);
      gravity_power += sim->gravity[at] * v;
      load_power += sim->loads[at] * v;
      for (int p = 0; p < 2; p++)
        power[p] +=
            (sim->previous_forces[3 * p * n + at] + sim->forces[3 * (p + 1) * n + at]) * v;
    }
    gravity_work += dt * gravity_power;
    load_work += dt * load_power;
    turned_over += fabs(dt * gravity_power) + fabs(dt * load_power);
  }
  for (long long i = 0; i < k; i++) {
    /* a joint loses its traction at the end of the step, when it acts on the area of that time */
    const double area = sim->area[i] = sim->length[i] * sim->thickness;
    const double dissipated = sim->measures[DEM_DISSIPATED_ENERGY * k + i];
    stored += area * sim->measures[DEM_STORED_ENERGY * k + i];
    friction += area * (dissipated - sim->booked_dissipation[i]);
    sim->booked_dissipation[i] = dissipated;
  }
  energy[DEM_KINETIC] = 0.5 * kinetic;
  energy[DEM_POTENTIAL] -= gravity_work;
  energy[DEM_STORED] = stored;
  energy[DEM_FRICTION] += friction;
  energy[DEM_DASHPOTS] -= 0.5 * dt * power[0];
  energy[DEM_EXTERNAL_WORK] += 0.5 * dt * power[1] + load_work;
  energy[DEM_TURNOVER] += turned_over + fabs(0.5 * dt * power[1]);
}

/* Results of the law, forces, energies, and the velocities of the next step */
EXPORT void dem_finish_step(dem_step *sim, double dt)
{
  const long long n = sim->n_blocks;
  dem_read_joints(sim);
  dem_compute_forces(sim, dt);
  add_energies(sim, dt);
  /* a contact that has opened has no offset when it touches again */
  for (long long i = 0; i < sim->n_contacts; i++)
    if (sim->closure[i] <= 0.0 && sim->closure_offset[i] > 0.0) sim->closure_offset[i] = 0.0;
  for (long long i = 0; i < n; i++)
    for (int j = 0; j < 3 && sim->is_mobile[i]; j++)
      sim->velocity[j * n + i] += dt * sim->forces[3 * i + j] / sim->inertia[3 * i + j];
}
