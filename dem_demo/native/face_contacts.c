/* face_contacts.c: contacts of convex polyhedra, face on face, and along edges and at corners.
 *
 * Two faces that look at each other are in contact over their overlap: face A of block a is projected
 * on the plane of face B of block b and clipped by the edges of B. The contact points are the corners
 * of this polygon. Point i stands for the area (A_i-1 + A_i)/2 with A_i the triangle between corners
 * i, i + 1 and the centroid, so area and first moments of the polygon are exact. A point that is a
 * corner of face B is fixed to block b, and its closure is its depth below the plane of A. All others
 * lie on face A, and their closure is their depth below the plane of B. A corner therefore keeps its
 * place in its block, and its depth, when the block slides: a point on the other face under it would
 * change its depth by the slip times the tilt, which no force accounts for.
 *
 * Block a is the one with the lower number, whatever the blocks do: if the roles changed, so would the
 * sign of shear. Corners of the polygon that differ from a neighbour, or from the line between their
 * neighbours, by less than `tie` are no points: with them the number of points would change with the
 * rounding of flush faces.
 *
 * Two blocks without such faces touch along an edge, at a corner, or where two edges cross. On the plane
 * of a face of one block the other one stands with an edge or a corner: its face next to the lowest
 * vertex is clipped, and of the polygon only the strip next to its lowest corner counts, `strip` wide
 * from a tilt of 5 degrees on, wider for smaller tilts, and the whole polygon up to 2 degrees. The upper
 * corners of a strip are open, so the areas count twice there. As the directions of the law belong to
 * the face that is stood on, the plane of a contact may be the one of a or of b (`plane_is_of_a`).
 *
 * Which contact two blocks have changes as they move: the plane of a or of b, or a crossing of edges. The
 * energy of a contact is the sum of area times energy per area, so the balance of energy is kept only if
 * areas and closures are continuous functions of the places of the blocks, whose derivatives are forces.
 *   - Planes over which the other block lies least deep (separating axes), within `fade`, share the
 *     contact; the crossing of edges takes the area that a polygon has lost near the border of its face.
 *   - Nothing depends on whether a corner lies on a line: a clipped polygon has any number of corners
 *     there. So extreme places are means along the border of the polygon, and corners next to a line give
 *     their area to their neighbours.
 *   - The derivatives of areas and closures are differences: block b is moved by a small step, and the
 *     same contact is measured again.
 *
 * Nothing here allocates memory or knows a law. Vectors are three doubles.
 */
#include <math.h>
#include <string.h>

#include "export.h"
#include "layout.h"

enum {
  MAX_CORNERS = 128, /* of two faces together */
  MAX_FACE_PAIRS = 64, /* of two blocks, in contact */
  MAX_PLANES = 4,    /* that share a contact along an edge or at a corner */
  TOO_MANY_CORNERS = -1 /* or pairs of faces */
};

static double dot(const double *a, const double *b)
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double dot_2(const double *a, const double *b)
{
  return a[0] * b[0] + a[1] * b[1];
}

static void cross(const double *a, const double *b, double *out)
{
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

static void subtract(const double *a, const double *b, double *out)
{
  for (int j = 0; j < 3; j++) out[j] = a[j] - b[j];
}

/* Vertices and normals of a block at its present place */
static void place_block(const dem_solids *s, long long i)
{
  const double *rotation = s->rotation + 9 * i, *position = s->position + 3 * i;
  for (long long v = s->first_vertex[i]; v < s->first_vertex[i + 1]; v++)
    for (int j = 0; j < 3; j++)
      s->vertex[3 * v + j] = position[j] + dot(rotation + 3 * j, s->local_vertex + 3 * v);
  for (long long f = s->first_face[i]; f < s->first_face[i + 1]; f++)
    for (int j = 0; j < 3; j++)
      s->normal[3 * f + j] = dot(rotation + 3 * j, s->local_normal + 3 * f);
}

/* Vertices, normals and bounding boxes of all blocks at their present places */
EXPORT void dem_place_solids(const dem_solids *s)
{
  for (long long i = 0; i < s->n_blocks; i++) {
    double *low = s->box + 6 * i, *high = low + 3;
    place_block(s, i);
    for (int j = 0; j < 3; j++) {
      low[j] = HUGE_VAL;
      high[j] = -HUGE_VAL;
      for (long long v = s->first_vertex[i]; v < s->first_vertex[i + 1]; v++) {
        low[j] = fmin(low[j], s->vertex[3 * v + j]);
        high[j] = fmax(high[j], s->vertex[3 * v + j]);
      }
    }
  }
}

/* Pairs (p, 2) of blocks whose boxes are nearer than the sum of their reaches (n,) and of which one
 * can move, by a sweep along x. order (n,): blocks by box - reach along x. Writes at most `capacity`
 * pairs, lower number first; returns how many there are. */
EXPORT long long dem_near_pairs(const dem_solids *s, const long long *order, const double *reach,
                                long long capacity, long long *pairs)
{
  long long count = 0;
  for (long long m = 0; m < s->n_blocks; m++) {
    const long long i = order[m];
    const double *low = s->box + 6 * i, *high = low + 3;
    for (long long n = m + 1; n < s->n_blocks; n++) {
      const long long k = order[n];
      const double *other_low = s->box + 6 * k, *other_high = other_low + 3;
      const double gap = reach[i] + reach[k];
      if (other_low[0] - reach[k] > high[0] + reach[i]) break;
      if (!(s->is_mobile[i] || s->is_mobile[k])) continue;
      int is_apart = 0;
      for (int j = 0; j < 3; j++)
        is_apart |= other_low[j] - high[j] > gap || low[j] - other_high[j] > gap;
      if (is_apart) continue;
      if (count < capacity) {
        pairs[2 * count] = i < k ? i : k;
        pairs[2 * count + 1] = i < k ? k : i;
      }
      count++;
    }
  }
  return count;
}

/* Range of the vertices of block i along a direction */
static void extent(const dem_solids *s, long long i, const double *direction, double *low,
                   double *high)
{
  *low = HUGE_VAL;
  *high = -HUGE_VAL;
  for (long long v = s->first_vertex[i]; v < s->first_vertex[i + 1]; v++) {
    const double height = dot(s->vertex + 3 * v, direction);
    if (height < *low) *low = height;
    if (height > *high) *high = height;
  }
}

/* Separation of two blocks along a direction, negative where they overlap along it */
static double separation_along(const dem_solids *s, long long a, long long b,
                               const double *direction)
{
  double low_a, high_a, low_b, high_b;
  extent(s, a, direction, &low_a, &high_a);
  extent(s, b, direction, &low_b, &high_b);
  const double above = low_a - high_b, below = low_b - high_a;
  return above > below ? above : below;
}

/* Largest separation (p,) in m of pairs of blocks along the normals of their faces and the products
 * of their edges: negative where solids overlap, and then minus the depth of the overlap. Where it is
 * above -tolerance along some direction, others are not tried. */
EXPORT void dem_separations(const dem_solids *s, long long p, const long long *pairs,
                            double tolerance, double *separation)
{
  for (long long i = 0; i < p; i++) {
    const long long block[2] = {pairs[2 * i], pairs[2 * i + 1]};
    double largest = -HUGE_VAL;
    for (int side = 0; side < 2 && largest <= -tolerance; side++)
      for (long long f = s->first_face[block[side]]; f < s->first_face[block[side] + 1]; f++) {
        const double gap = separation_along(s, block[0], block[1], s->normal + 3 * f);
        if (gap > largest) largest = gap;
      }
    for (long long f = s->first_face[block[0]]; f < s->first_face[block[0] + 1]; f++) {
      if (largest > -tolerance) break;
      const long long *ring = s->corner + s->first_corner[f];
      const long long m = s->first_corner[f + 1] - s->first_corner[f];
      for (long long j = 0; j < m; j++) {
        const long long start = ring[j], end = ring[(j + 1) % m];
        if (start > end) continue; /* each edge belongs to two faces */
        double one[3];
        subtract(s->vertex + 3 * end, s->vertex + 3 * start, one);
        for (long long g = s->first_face[block[1]]; g < s->first_face[block[1] + 1]; g++) {
          const long long *other_ring = s->corner + s->first_corner[g];
          const long long q = s->first_corner[g + 1] - s->first_corner[g];
          for (long long k = 0; k < q; k++) {
            if (other_ring[k] > other_ring[(k + 1) % q]) continue;
            double other[3], direction[3];
            subtract(s->vertex + 3 * other_ring[(k + 1) % q], s->vertex + 3 * other_ring[k], other);
            cross(one, other, direction);
            const double size = sqrt(dot(direction, direction));
            if (size < DEM_PARALLEL_SINE * sqrt(dot(one, one) * dot(other, other))) continue;
            for (int c = 0; c < 3; c++) direction[c] /= size;
            const double gap = separation_along(s, block[0], block[1], direction);
            if (gap > largest) largest = gap;
          }
        }
      }
    }
    separation[i] = largest;
  }
}

/* Keep the part of a polygon to the left of the line from `start` to `end`; returns its corners */
static int clip(double (*polygon)[2], int m, const double *start, const double *end)
{
  double kept[MAX_CORNERS + 1][2];
  int n = 0;
  const double x = end[0] - start[0], y = end[1] - start[1];
  for (int i = 0; i < m; i++) {
    const double *here = polygon[i], *next = polygon[(i + 1) % m];
    const double left = x * (here[1] - start[1]) - y * (here[0] - start[0]);
    const double next_left = x * (next[1] - start[1]) - y * (next[0] - start[0]);
    if (left >= 0.0) {
      kept[n][0] = here[0];
      kept[n++][1] = here[1];
    }
    if ((left >= 0.0) != (next_left >= 0.0) && n < MAX_CORNERS) {
      const double part = left / (left - next_left);
      kept[n][0] = here[0] + part * (next[0] - here[0]);
      kept[n++][1] = here[1] + part * (next[1] - here[1]);
    }
  }
  memcpy(polygon, kept, sizeof(double) * 2 * (size_t) n);
  return n;
}

/* Remove corners that differ by less than `tie` from a neighbour or from the line between both */
static int without_ties(double (*polygon)[2], int m, double tie)
{
  for (int i = 0; i < m && m > 2;) {
    const double *before = polygon[(i + m - 1) % m], *here = polygon[i];
    const double *after = polygon[(i + 1) % m];
    const double x = after[0] - before[0], y = after[1] - before[1];
    const double u = here[0] - before[0], v = here[1] - before[1];
    if (hypot(u, v) <= tie || fabs(x * v - y * u) <= tie * hypot(x, y)) {
      memmove(polygon + i, polygon + i + 1, sizeof(double) * 2 * (size_t) (m - 1 - i));
      m--;
      i = 0;
    } else {
      i++;
    }
  }
  return m;
}

/* Centroid of a polygon; returns its area */
static double polygon_area(double (*polygon)[2], int m, double *centroid)
{
  double area = 0.0, x = 0.0, y = 0.0;
  const double *origin = polygon[0];
  for (int i = 1; i + 1 < m; i++) {
    const double u = polygon[i][0] - origin[0], v = polygon[i][1] - origin[1];
    const double next_u = polygon[i + 1][0] - origin[0], next_v = polygon[i + 1][1] - origin[1];
    const double twice = u * next_v - v * next_u;
    area += twice;
    x += twice * (u + next_u);
    y += twice * (v + next_v);
  }
  centroid[0] = origin[0] + (area > 0.0 ? x / (3.0 * area) : 0.0);
  centroid[1] = origin[1] + (area > 0.0 ? y / (3.0 * area) : 0.0);
  return 0.5 * area;
}

static double triangle_area(const double *a, const double *b, const double *c)
{
  return 0.5 * fabs((a[0] - c[0]) * (b[1] - c[1]) - (a[1] - c[1]) * (b[0] - c[0]));
}

/* Mean place along a direction of the border of a polygon, weighted by exp(-distance / length) with the
 * distance along the direction from its farthest corner; from its nearest one if the length is negative.
 * Unlike the farthest place it is smooth where a side becomes normal to the direction, and a further
 * corner on a side does not change it. */
static double extreme(double (*polygon)[2], int m, const double *direction, double length)
{
  double farthest = -HUGE_VAL, sum = 0.0, weights = 0.0;
  for (int i = 0; i < m; i++) farthest = fmax(farthest, dot_2(direction, polygon[i]) / length);
  for (int i = 0; i < m; i++) { /* integrals over the side to the next corner */
    const double *here = polygon[i], *next = polygon[(i + 1) % m];
    const double p = farthest - dot_2(direction, here) / length;
    const double q = farthest - dot_2(direction, next) / length;
    const double half = 0.5 * (q - p), middle = 0.5 * (p + q);
    const double mean_of_ends = 0.5 * (exp(-p) + exp(-q));
    const int is_level = fabs(half) < 1e-3; /* a series, whose next terms are below 1e-12 */
    const double weight = is_level ? exp(-middle) * (1.0 + half * half / 6.0)
                                   : 0.5 * (exp(-p) - exp(-q)) / half;
    const double excess =
        is_level ? exp(-middle) * half * half / 3.0 : mean_of_ends - weight;
    const double size = hypot(next[0] - here[0], next[1] - here[1]);
    weights += size * weight;
    sum += size * (middle * weight - excess);
  }
  return length * (farthest - sum / weights);
}

/* Keep the strip of a polygon next to its lowest corner. gradient (2,): slope of the height along both
 * axes; part: 0 at a tilt up to 2 degrees, where the whole polygon counts, and 1 from 5 degrees on, where
 * the strip has its `width` (m). Returns the corners; `weight` is the factor of their areas. */
static int keep_strip(double (*polygon)[2], int m, const double *gradient, double part, double width,
                      double *weight)
{
  const double slope = hypot(gradient[0], gradient[1]);
  const double up[2] = {gradient[0] / slope, gradient[1] / slope};
  const double lowest = extreme(polygon, m, up, -0.25 * width);
  const double highest = extreme(polygon, m, up, 0.25 * width);
  *weight = 1.0 + part;
  if (!(highest - lowest > width)) return m;
  const double reach = lowest + pow(highest - lowest, 1.0 - part) * pow(width, part);
  const double start[2] = {up[0] * reach, up[1] * reach};
  const double end[2] = {start[0] - up[1], start[1] + up[0]};
  return clip(polygon, m, start, end);
}

/* 1 up to a lower limit, 0 from an upper one on */
static double falling_ramp(double x, double low, double high)
{
  return fmin(fmax((high - x) / (high - low), 0.0), 1.0);
}

/* Distance of a point from the border of a face with corners `edges`, over `fade`, from 0 to 1 */
static double depth_inside(double (*edges)[2], int m_edges, double x, double y, double fade)
{
  double distance = fade;
  for (int i = 0; i < m_edges; i++) {
    const double *start = edges[i], *end = edges[(i + 1) % m_edges];
    const double u = end[0] - start[0], v = end[1] - start[1];
    distance = fmin(distance, (u * (y - start[1]) - v * (x - start[0])) / hypot(u, v));
  }
  return fmax(distance / fade, 0.0);
}

/* Share of its area that a contact along an edge or at a corner keeps near the border of the face that
 * it lies on; a crossing of edges takes the rest. part: 0 at a tilt up to 2 degrees, 1 from 5 on.
 *
 * A corner: its distance from the border over `fade`, at most 1. An edge, which is a side of the polygon
 * next to its lowest corner along a contour line of the height: the largest of these distances of both
 * ends and the middle. An edge along the border, as one of two equal blocks rocks on the other, keeps its
 * area up to a tilt of DEM_WHOLE_EDGE_SINE, as the planes of both have almost one direction; from
 * DEM_NO_EDGE_SINE on its area fades like the area of a corner. */
static double share_inside(double (*polygon)[2], int m, double (*edges)[2], int m_edges,
                           const double *gradient, double sine, double part, double fade)
{
  const double slope = hypot(gradient[0], gradient[1]);
  const double at_border = falling_ramp(sine, DEM_WHOLE_EDGE_SINE, DEM_NO_EDGE_SINE);
  int lowest = 0;
  for (int i = 1; i < m; i++)
    if (dot_2(gradient, polygon[i]) < dot_2(gradient, polygon[lowest])) lowest = i;
  const double height = dot_2(gradient, polygon[lowest]);
  const double of_corner =
      depth_inside(edges, m_edges, polygon[lowest][0], polygon[lowest][1], fade);
  double largest = of_corner;
  for (int i = 0; i < m; i++) {
    const double *here = polygon[i], *other = polygon[(i + 1) % m];
    const double side[2] = {other[0] - here[0], other[1] - here[1]};
    const double length = hypot(side[0], side[1]), rise = dot_2(gradient, side);
    const double above = dot_2(gradient, here) + fmin(rise, 0.0) - height;
    const double near = 1.0 - above / (slope * fade);
    if (!(near > 0.0 && length > 0.0)) continue;
    const double level =
        near * fmin(length / fade, 1.0) *
        falling_ramp(fabs(rise) / (slope * length), DEM_EDGE_SINE, DEM_CORNER_SINE);
    double inside = of_corner;
    for (int k = 0; k < 3; k++)
      inside = fmax(inside, depth_inside(edges, m_edges, here[0] + 0.5 * k * side[0],
                                         here[1] + 0.5 * k * side[1], fade));
    const double of_edge = inside + (1.0 - inside) * at_border;
    largest = fmax(largest, of_corner + level * (of_edge - of_corner));
  }
  return 1.0 - part * (1.0 - largest);
}

/* Distance of corner i of a polygon outwards from the line between its neighbours; `along`: the part of the way
 * from the one before to the one after it at which the corner lies */
static double distance_from_line(double (*polygon)[2], int m, int i, double *along)
{
  const double *start = polygon[(i + m - 1) % m], *end = polygon[(i + 1) % m];
  const double x = end[0] - start[0], y = end[1] - start[1], length = hypot(x, y);
  const double u = polygon[i][0] - start[0], v = polygon[i][1] - start[1];
  *along = length > 0.0 ? fmin(fmax((x * u + y * v) / (length * length), 0.0), 1.0) : 0.0;
  return length > 0.0 ? (y * u - x * v) / length : hypot(u, v);
}

/* Move the areas of corners that hardly differ from the line between their neighbours to these: all of it
 * up to `merge` from the line, where the corner is removed, and none from twice this distance on. Areas
 * and their first moments along the line stay. Without this the corner where two almost parallel edges
 * cross would move along them, and take area with it, at almost no motion of the blocks. */
static int merge_corners(double (*polygon)[2], int m, double *area, double merge)
{
  double along, change[MAX_CORNERS] = {0.0};
  while (m > 3) { /* the corner next to its line first: beside it a corner seems to lie on a line */
    double nearest = HUGE_VAL;
    int i = 0;
    for (int k = 0; k < m; k++) {
      const double distance = distance_from_line(polygon, m, k, &along);
      if (!(distance < nearest)) continue;
      nearest = distance;
      i = k;
    }
    if (!(nearest <= merge)) break;
    distance_from_line(polygon, m, i, &along);
    area[(i + m - 1) % m] += (1.0 - along) * area[i];
    area[(i + 1) % m] += along * area[i];
    memmove(polygon + i, polygon + i + 1, sizeof polygon[0] * (size_t) (m - 1 - i));
    memmove(area + i, area + i + 1, sizeof area[0] * (size_t) (m - 1 - i));
    m--;
  }
  for (int i = 0; i < m && m > 3; i++) {
    const double far = fmin(fmax(distance_from_line(polygon, m, i, &along) / merge - 1.0, 0.0), 1.0);
    const double moved = area[i] * (1.0 - far * far * (3.0 - 2.0 * far));
    change[i] -= moved;
    change[(i + m - 1) % m] += (1.0 - along) * moved;
    change[(i + 1) % m] += along * moved;
  }
  for (int i = 0; i < m; i++) area[i] += change[i];
  return m;
}

/* A face over the plane of another one, along two axes of this plane and its normal */
typedef struct {
  double corner[MAX_CORNERS][3]; /* counter-clockwise seen along the normal of the plane */
  double normal[3];              /* of the face */
  int m;
} raised_face;

/* The overlap of two faces */
typedef struct {
  double polygon[MAX_CORNERS][2], area[MAX_CORNERS]; /* corners, and the areas that they carry */
  double height, gradient[2];                        /* of the face over the plane */
  double lowest;                                     /* height over the plane */
  double share;                                      /* see share_inside */
  int m;
} overlap;

/* The overlap of a face with the face whose plane it lies over, whose corners are `edges` */
static void find_overlap(const raised_face *face, double (*edges)[2], int m_edges, double tie,
                         double strip, double fade, overlap *out)
{
  double (*polygon)[2] = out->polygon, centroid[2], weight = 1.0;
  const double *normal = face->normal;
  int m = face->m;
  for (int i = 0; i < m; i++) memcpy(polygon[i], face->corner[i], sizeof polygon[0]);
  for (int i = 0; i < m_edges && m > 2; i++)
    m = clip(polygon, m, edges[i], edges[(i + 1) % m_edges]);
  const double *gradient = out->gradient, sine = hypot(normal[0], normal[1]);
  const int is_flush = !(sine > DEM_FLUSH_SINE);
  if (is_flush) m = without_ties(polygon, m, tie);
  out->m = 0;
  out->lowest = HUGE_VAL;
  out->share = 0.0;
  if (m < 3) return;
  out->gradient[0] = -normal[0] / normal[2];
  out->gradient[1] = -normal[1] / normal[2];
  out->height = dot(normal, face->corner[0]) / normal[2];
  for (int i = 0; i < m; i++) {
    const double here = out->height + gradient[0] * polygon[i][0] + gradient[1] * polygon[i][1];
    if (here < out->lowest) out->lowest = here;
  }
  out->share = 1.0;
  if (!is_flush) {
    const double part = fmin((sine - DEM_FLUSH_SINE) / (DEM_STRIP_SINE - DEM_FLUSH_SINE), 1.0);
    out->share = share_inside(polygon, m, edges, m_edges, gradient, sine, part, fade);
    m = keep_strip(polygon, m, gradient, part, strip, &weight);
  }
  if (m < 3 || !(out->share * polygon_area(polygon, m, centroid) > tie * tie)) return;
  for (int i = 0; i < m; i++)
    out->area[i] = 0.5 * out->share * weight *
                   (triangle_area(polygon[(i + m - 1) % m], polygon[i], centroid) +
                    triangle_area(polygon[i], polygon[(i + 1) % m], centroid));
  out->m = is_flush ? m : merge_corners(polygon, m, out->area, DEM_MERGE_PER_FADE * fade);
}

/* Write point `number` of a contact, if there is room for it. first: place of the first point of the
 * contact; face_a, face_b: faces of the blocks; normal: outward of the block whose plane it is; base: a
 * point of this plane */
static void write_point(const dem_points *out, long long first, int number, long long face_a,
                        long long face_b, int plane_is_of_a, const double *point,
                        const double *normal, const double *base, double area)
{
  const long long i = first + number;
  if (i >= out->capacity) return;
  out->number[i] = number;
  out->face_a[i] = face_a;
  out->face_b[i] = face_b;
  out->plane_is_of_a[i] = (unsigned char) plane_is_of_a;
  out->area[i] = area;
  for (int j = 0; j < 3; j++) {
    out->point[3 * i + j] = point[j];
    out->normal[3 * i + j] = normal[j];
    out->base[3 * i + j] = base[j];
    out->area_rate[6 * i + j] = out->area_rate[6 * i + 3 + j] = 0.0;
    out->closure_rate[6 * i + j] = out->closure_rate[6 * i + 3 + j] = 0.0;
  }
}

/* Number of the corner of a face g at a corner of the overlap of f and g, if no corner of f lies there;
 * -1 for none. edges: corners of g in its plane; tie (m): distance that counts as zero. */
static int corner_of_plane(const raised_face *f, double (*edges)[2], int m_edges, const double *here,
                           double tie)
{
  for (int i = 0; i < f->m; i++)
    if (hypot(f->corner[i][0] - here[0], f->corner[i][1] - here[1]) <= tie) return -1;
  for (int i = 0; i < m_edges; i++)
    if (hypot(edges[i][0] - here[0], edges[i][1] - here[1]) <= tie) return i;
  return -1;
}

/* Face f of one block over the plane of face g of another one */
typedef struct {
  const double *origin, *normal; /* of the plane */
  double axis[3][3];             /* two axes of the plane, and its normal */
  double edges[MAX_CORNERS][2];  /* corners of g in the plane */
  int m_edges;
  raised_face face; /* f */
} face_pair;

/* Returns 0, or TOO_MANY_CORNERS */
static int set_face_pair(const dem_solids *s, long long f, long long g, face_pair *out)
{
  const long long *ring = s->corner + s->first_corner[g], *ring_f = s->corner + s->first_corner[f];
  const int m_f = (int) (s->first_corner[f + 1] - s->first_corner[f]);
  const int m_g = (int) (s->first_corner[g + 1] - s->first_corner[g]);
  double (*axis)[3] = out->axis;
  if (m_f + m_g > MAX_CORNERS - 1) return TOO_MANY_CORNERS;
  out->origin = s->vertex + 3 * ring[0];
  out->normal = s->normal + 3 * g;
  out->face.m = m_f;
  out->m_edges = m_g;
  subtract(s->vertex + 3 * ring[1], out->origin, axis[0]);
  const double length = sqrt(dot(axis[0], axis[0]));
  for (int j = 0; j < 3; j++) axis[0][j] /= length;
  cross(out->normal, axis[0], axis[1]);
  memcpy(axis[2], out->normal, sizeof axis[2]);
  for (int i = 0; i < m_f; i++) {
    double at[3];
    subtract(s->vertex + 3 * ring_f[m_f - 1 - i], out->origin, at);
    for (int k = 0; k < 3; k++) out->face.corner[i][k] = dot(at, axis[k]);
  }
  for (int k = 0; k < 3; k++) out->face.normal[k] = dot(s->normal + 3 * f, axis[k]);
  for (int i = 0; i < m_g; i++) {
    double at[3];
    subtract(s->vertex + 3 * ring[i], out->origin, at);
    for (int k = 0; k < 2; k++) out->edges[i][k] = dot(at, axis[k]);
  }
  return 0;
}

/* Height of the lowest corner of a face over the plane of another one */
static double lowest_corner(const face_pair *pair)
{
  double lowest = HUGE_VAL;
  for (int i = 0; i < pair->face.m; i++) lowest = fmin(lowest, pair->face.corner[i][2]);
  return lowest;
}

/* Place on the face over corner i of the overlap */
static void point_on_face(const face_pair *pair, const overlap *found, int i, double *point)
{
  const double *here = found->polygon[i];
  const double up = found->height + dot_2(found->gradient, here);
  for (int j = 0; j < 3; j++)
    point[j] = pair->origin[j] + here[0] * pair->axis[0][j] + here[1] * pair->axis[1][j] +
               up * pair->normal[j];
}

/* Contact points of face f of block a that lies on face g of block b, written from point `count` on;
 * height (m): of the lowest point of the overlap over the plane. Returns how many there are, or
 * TOO_MANY_CORNERS. */
static long long touch(const dem_solids *s, long long f, long long g, double max_gap,
                       double max_depth, double tie, double strip, long long count,
                       const dem_points *out, double *height)
{
  const long long *ring = s->corner + s->first_corner[g], *ring_f = s->corner + s->first_corner[f];
  face_pair pair;
  if (set_face_pair(s, f, g, &pair)) return TOO_MANY_CORNERS;
  if (!(lowest_corner(&pair) < max_gap)) return 0;
  overlap found;
  find_overlap(&pair.face, pair.edges, pair.m_edges, tie, strip, DEM_FADE_PER_GAP * max_gap, &found);
  *height = found.lowest;
  if (!(found.lowest < max_gap && found.lowest > -max_depth)) return 0;
  for (int i = 0; i < found.m; i++) {
    const int corner = corner_of_plane(&pair.face, pair.edges, pair.m_edges, found.polygon[i], tie);
    if (corner >= 0) {
      write_point(out, count, i, f, g, 1, s->vertex + 3 * ring[corner], s->normal + 3 * f,
                  s->vertex + 3 * ring_f[0], found.area[i]);
      continue;
    }
    double point[3];
    point_on_face(&pair, &found, i, point);
    write_point(out, count, i, f, g, 0, point, pair.normal, pair.origin, found.area[i]);
  }
  return found.m;
}

/* Face of block i with vertex v, or with vertices v and w, that looks most along a direction */
static long long face_at(const dem_solids *s, long long i, long long v, long long w,
                         const double *direction)
{
  long long best = s->first_face[i];
  double largest = -HUGE_VAL;
  for (long long f = s->first_face[i]; f < s->first_face[i + 1]; f++) {
    int members = 0;
    for (long long c = s->first_corner[f]; c < s->first_corner[f + 1]; c++)
      members += (s->corner[c] == v) + (s->corner[c] == w && w != v);
    if (members < 1 + (w != v)) continue;
    const double cosine = dot(s->normal + 3 * f, direction);
    if (cosine > largest) {
      largest = cosine;
      best = f;
    }
  }
  return best;
}

/* Vertex of block i that lies deepest below a plane; `height` is its height over it */
static long long deepest_vertex(const dem_solids *s, long long i, const double *origin,
                                const double *normal, double *height)
{
  long long deepest = s->first_vertex[i];
  *height = HUGE_VAL;
  for (long long v = s->first_vertex[i]; v < s->first_vertex[i + 1]; v++) {
    double at[3];
    subtract(s->vertex + 3 * v, origin, at);
    const double here = dot(at, normal);
    if (here < *height) {
      *height = here;
      deepest = v;
    }
  }
  return deepest;
}

/* Two edges that cross: the points next to each other on both, and the direction normal to both */
typedef struct {
  double separation, normal[3], on_a[3], on_b[3]; /* normal from b to a */
  long long a[2], b[2];                           /* vertices of the edges */
  double inside;                                  /* least distance from their ends */
  double sine, length;                            /* of the angle between them; of the shorter one */
} crossing;

/* The crossing of edges `a` and `b`, whose normal has any sign; returns 0 where the lines are parallel or
 * cross beyond the ends of an edge */
static int cross_edges(const dem_solids *s, const long long *a, const long long *b, crossing *out)
{
  double one[3], other[3], between[3], part[3];
  const double *start_a = s->vertex + 3 * a[0], *start_b = s->vertex + 3 * b[0];
  subtract(s->vertex + 3 * a[1], start_a, one);
  subtract(s->vertex + 3 * b[1], start_b, other);
  cross(one, other, out->normal);
  const double square = dot(out->normal, out->normal), size = sqrt(square);
  const double length_a = sqrt(dot(one, one)), length_b = sqrt(dot(other, other));
  out->sine = size / (length_a * length_b);
  if (out->sine < DEM_CROSSING_SINE) return 0;
  subtract(start_b, start_a, between);
  cross(between, other, part);
  const double along_a = dot(part, out->normal) / square;
  cross(between, one, part);
  const double along_b = dot(part, out->normal) / square;
  out->inside = fmin(fmin(along_a, 1.0 - along_a) * length_a, fmin(along_b, 1.0 - along_b) * length_b);
  if (!(out->inside >= 0.0)) return 0;
  out->length = fmin(length_a, length_b);
  for (int j = 0; j < 3; j++) {
    out->normal[j] /= size;
    out->on_a[j] = start_a[j] + along_a * one[j];
    out->on_b[j] = start_b[j] + along_b * other[j];
  }
  memcpy(out->a, a, sizeof out->a);
  memcpy(out->b, b, sizeof out->b);
  return 1;
}

/* Area of the joint where two edges cross: of the overlap of two strips along them, no longer than the
 * shorter edge. It fades within `fade` of the ends of both, and as they become parallel, where their
 * crossing would move along them at almost no motion of the blocks. */
static double crossing_area(const crossing *at, double strip, double fade)
{
  const double share = fmin(at->inside / fade, 1.0) *
                       (1.0 - falling_ramp(at->sine, DEM_CROSSING_SINE, DEM_STRIP_SINE));
  return share * strip * strip / hypot(at->sine, strip / at->length);
}

/* Compare the crossing of edges `a` and `b` with the best one so far */
static void try_crossing(const dem_solids *s, long long block_a, long long block_b,
                         const long long *a, const long long *b, crossing *best)
{
  crossing here;
  if (!cross_edges(s, a, b, &here)) return;
  double low_a, high_a, low_b, high_b, between[3];
  extent(s, block_a, here.normal, &low_a, &high_a);
  extent(s, block_b, here.normal, &low_b, &high_b);
  const double sign = low_a - high_b > low_b - high_a ? 1.0 : -1.0;
  here.separation = sign > 0.0 ? low_a - high_b : low_b - high_a;
  if (!(here.separation > best->separation)) return;
  for (int j = 0; j < 3; j++) here.normal[j] *= sign;
  subtract(here.on_a, here.on_b, between);
  if (fabs(dot(between, here.normal) - here.separation) > DEM_CROSSING_ERROR * here.length)
    return; /* other vertices are nearer along this direction */
  *best = here;
}

/* The crossing of edges of two blocks along which they are farthest apart, if that is farther than
 * `least` */
static crossing find_crossing(const dem_solids *s, long long block_a, long long block_b,
                              double least)
{
  crossing best = {.separation = least, .a = {-1, -1}};
  for (long long f = s->first_face[block_a]; f < s->first_face[block_a + 1]; f++) {
    const long long *ring = s->corner + s->first_corner[f];
    const long long m = s->first_corner[f + 1] - s->first_corner[f];
    for (long long i = 0; i < m; i++) {
      const long long a[2] = {ring[i], ring[(i + 1) % m]};
      if (a[0] > a[1]) continue; /* each edge belongs to two faces */
      for (long long g = s->first_face[block_b]; g < s->first_face[block_b + 1]; g++) {
        const long long *other = s->corner + s->first_corner[g];
        const long long q = s->first_corner[g + 1] - s->first_corner[g];
        for (long long k = 0; k < q; k++) {
          const long long b[2] = {other[k], other[(k + 1) % q]};
          if (b[0] < b[1]) try_crossing(s, block_a, block_b, a, b, &best);
        }
      }
    }
  }
  return best;
}

/* A block that stands on the plane of a face of the other one */
typedef struct {
  long long plane, vertex, face; /* face of the plane; lowest vertex over it; face that is clipped */
  int side;                      /* 0 if the plane is of block a, 1 if of b */
  double height;                 /* of the vertex over the plane */
} standing;

/* How two blocks touch along edges and at corners */
typedef struct {
  standing plane[MAX_PLANES];
  int planes;
  crossing at; /* of two edges; at.a[0] is -1 if none cross */
} edge_contact;

/* Its geometry at a place of the blocks */
typedef struct {
  face_pair pair[MAX_PLANES];
  overlap found[MAX_PLANES]; /* areas are weighted */
  crossing at;
  double crossing_area;
} edge_geometry;

/* The planes on which one of two blocks stands: of all faces, those over which the other block lies least
 * deep, within `fade`. Returns 0 where the blocks are `max_gap` apart. */
static int find_planes(const dem_solids *s, long long a, long long b, double max_gap, double fade,
                       edge_contact *out)
{
  const long long block[2] = {a, b};
  double largest = -HUGE_VAL;
  out->planes = 0;
  for (int side = 0; side < 2; side++)
    for (long long f = s->first_face[block[side]]; f < s->first_face[block[side] + 1]; f++) {
      standing here = {.plane = f, .side = side};
      here.vertex =
          deepest_vertex(s, block[1 - side], s->vertex + 3 * s->corner[s->first_corner[f]],
                         s->normal + 3 * f, &here.height);
      if (here.height >= max_gap) return 0;
      if (!(here.height > largest - fade)) continue;
      largest = fmax(largest, here.height);
      int kept = 0, lowest = 0;
      for (int i = 0; i < out->planes; i++)
        if (out->plane[i].height > largest - fade) out->plane[kept++] = out->plane[i];
      for (int i = 1; i < kept; i++)
        if (out->plane[i].height < out->plane[lowest].height) lowest = i;
      if (kept < MAX_PLANES) out->plane[kept++] = here;
      else if (here.height > out->plane[lowest].height) out->plane[lowest] = here;
      out->planes = kept;
    }
  for (int i = 0; i < out->planes; i++) {
    standing *here = out->plane + i;
    const double *normal = s->normal + 3 * here->plane;
    const double down[3] = {-normal[0], -normal[1], -normal[2]};
    here->face = face_at(s, block[1 - here->side], here->vertex, here->vertex, down);
  }
  return 1;
}

/* Areas of an edge contact at the present places of the blocks. The planes share the contact, the higher
 * the lowest vertex over a plane, the more; what their contacts leave near borders of faces goes to the
 * crossing. Returns 0, or TOO_MANY_CORNERS. */
static int measure_edge_contact(const dem_solids *s, const edge_contact *contact, double tie,
                                double strip, double fade, edge_geometry *out)
{
  double weight[MAX_PLANES], height[MAX_PLANES], largest = -HUGE_VAL, sum = 0.0, left = 1.0;
  for (int i = 0; i < contact->planes; i++) {
    const standing *here = contact->plane + i;
    double at[3];
    subtract(s->vertex + 3 * here->vertex, s->vertex + 3 * s->corner[s->first_corner[here->plane]], at);
    height[i] = dot(at, s->normal + 3 * here->plane);
    largest = fmax(largest, height[i]);
  }
  for (int i = 0; i < contact->planes; i++) {
    const double near = fmax(1.0 - (largest - height[i]) / fade, 0.0);
    weight[i] = near * near;
    sum += weight[i];
  }
  for (int i = 0; i < contact->planes; i++) {
    face_pair *pair = out->pair + i;
    overlap *found = out->found + i;
    const double part = weight[i] / sum;
    if (set_face_pair(s, contact->plane[i].face, contact->plane[i].plane, pair))
      return TOO_MANY_CORNERS;
    find_overlap(&pair->face, pair->edges, pair->m_edges, tie, strip, fade, found);
    for (int k = 0; k < found->m; k++) found->area[k] *= part;
    left -= part * found->share;
  }
  out->crossing_area = 0.0;
  if (contact->at.a[0] >= 0 && cross_edges(s, contact->at.a, contact->at.b, &out->at))
    out->crossing_area = fmax(left, 0.0) * crossing_area(&out->at, strip, fade);
  return 0;
}

/* Place a block where a small motion takes it: along axis `motion`, or from 3 on about an axis through
 * its centroid. A step of 0 restores its place, bit for bit. */
static void displace_block(const dem_solids *s, long long i, int motion, double step)
{
  const int axis = motion % 3, next = (axis + 1) % 3, last = (axis + 2) % 3;
  const double cosine = cos(step), sine = sin(step);
  place_block(s, i);
  if (step == 0.0) return;
  const double *position = s->position + 3 * i;
  for (long long v = s->first_vertex[i]; v < s->first_vertex[i + 1]; v++) {
    double *at = s->vertex + 3 * v;
    if (motion < 3) {
      at[axis] += step;
      continue;
    }
    const double x = at[next] - position[next], y = at[last] - position[last];
    at[next] = position[next] + cosine * x - sine * y;
    at[last] = position[last] + sine * x + cosine * y;
  }
  for (long long f = s->first_face[i]; f < s->first_face[i + 1] && motion >= 3; f++) {
    double *normal = s->normal + 3 * f;
    const double x = normal[next], y = normal[last];
    normal[next] = cosine * x - sine * y;
    normal[last] = sine * x + cosine * y;
  }
}

/* Depth of the face below the plane at corner i of the overlap */
static double depth_at(const overlap *found, int i)
{
  return -(found->height + dot_2(found->gradient, found->polygon[i]));
}

/* Areas of an overlap and their mean depths, over its corners next to each corner of another one: corners
 * that lie on each other may change places within small motions */
static void measure_next_to(const overlap *found, const overlap *corners, double *area, double *depth)
{
  for (int k = 0; k < corners->m; k++) area[k] = depth[k] = 0.0;
  for (int i = 0; i < found->m; i++) {
    double smallest = HUGE_VAL;
    int nearest = 0;
    for (int k = 0; k < corners->m; k++) {
      const double distance = hypot(found->polygon[i][0] - corners->polygon[k][0],
                                    found->polygon[i][1] - corners->polygon[k][1]);
      if (distance < smallest) {
        smallest = distance;
        nearest = k;
      }
    }
    area[nearest] += found->area[i];
    depth[nearest] += found->area[i] * depth_at(found, i);
  }
  for (int k = 0; k < corners->m; k++) depth[k] /= area[k]; /* NaN without a corner */
}

/* Derivatives of the areas and closures of an edge contact by motions of block b about its centroid,
 * written to its points from `count` on. geometry: at the present places. */
static void write_rates(const dem_solids *s, long long b, const edge_contact *contact,
                        const edge_geometry *geometry, double tie, double strip, double fade,
                        const int *first, long long count, const dem_points *out)
{
  edge_geometry moved[2];
  const int is_crossing = geometry->crossing_area > tie * tie;
  for (int motion = 0; motion < 6; motion++) {
    const double step = DEM_DIFFERENCE * (motion < 3 ? strip : 1.0);
    for (int side = 0; side < 2; side++) {
      displace_block(s, b, motion, side ? step : -step);
      measure_edge_contact(s, contact, tie, strip, fade, moved + side);
    }
    for (int i = 0; i < contact->planes; i++) {
      const overlap *here = geometry->found + i;
      double area[2][MAX_CORNERS], depth[2][MAX_CORNERS];
      if (first[i] < 0) continue;
      for (int side = 0; side < 2; side++)
        measure_next_to(moved[side].found + i, here, area[side], depth[side]);
      for (int k = 0; k < here->m; k++) {
        const long long at = count + first[i] + k;
        if (at >= out->capacity) continue;
        const double rate = (depth[1][k] - depth[0][k]) / (2.0 * step);
        out->area_rate[6 * at + motion] = (area[1][k] - area[0][k]) / (2.0 * step);
        out->closure_rate[6 * at + motion] = isfinite(rate) ? rate : 0.0;
      }
    }
    const long long at = count + first[MAX_PLANES];
    if (is_crossing && at < out->capacity)
      out->area_rate[6 * at + motion] =
          (moved[1].crossing_area - moved[0].crossing_area) / (2.0 * step);
  }
  displace_block(s, b, 0, 0.0);
}

/* Turn derivatives by motions of block b about its centroid into derivatives by motions of the block of
 * the point about the base */
static void refer_to_base(const dem_solids *s, long long b, long long i, const dem_points *out,
                          double *rate)
{
  double arm[3], turn[3];
  subtract(s->position + 3 * b, out->base + 3 * i, arm);
  cross(arm, rate, turn);
  for (int j = 0; j < 3; j++) rate[3 + j] += turn[j];
  for (int j = 0; j < 6 && !out->plane_is_of_a[i]; j++) rate[j] = -rate[j];
}

/* Leave of the rate of a closure its part by which the point slides on its block: without the rate of a
 * point fixed to the block */
static void keep_sliding(long long i, const dem_points *out)
{
  const double *normal = out->normal + 3 * i;
  double *rate = out->closure_rate + 6 * i, arm[3], turn[3];
  subtract(out->point + 3 * i, out->base + 3 * i, arm);
  cross(arm, normal, turn);
  for (int j = 0; j < 3; j++) {
    rate[j] += normal[j];
    rate[3 + j] += turn[j];
  }
}

/* Contact points of two blocks that touch along an edge, at a corner, or where two edges cross,
 * written from point `count` on; returns how many there are, or TOO_MANY_CORNERS */
static long long touch_at_edges(const dem_solids *s, long long a, long long b, double max_gap,
                                double max_depth, double tie, double strip, long long count,
                                const dem_points *out)
{
  const double fade = DEM_FADE_PER_GAP * max_gap;
  edge_contact contact;
  edge_geometry geometry;
  int first[MAX_PLANES + 1], written = 0;
  if (!find_planes(s, a, b, max_gap, fade, &contact)) return 0;
  double largest = -HUGE_VAL;
  for (int i = 0; i < contact.planes; i++) largest = fmax(largest, contact.plane[i].height);
  contact.at = find_crossing(s, a, b, largest - fade);
  if (contact.at.separation >= max_gap) return 0;
  if (measure_edge_contact(s, &contact, tie, strip, fade, &geometry)) return TOO_MANY_CORNERS;
  for (int i = 0; i < contact.planes; i++) {
    const standing *here = contact.plane + i;
    const face_pair *pair = geometry.pair + i;
    const overlap *found = geometry.found + i;
    first[i] = -1;
    if (!(found->lowest < max_gap && found->lowest > -max_depth)) continue;
    first[i] = written;
    for (int k = 0; k < found->m; k++) {
      double point[3];
      point_on_face(pair, found, k, point);
      write_point(out, count + first[i], k, here->side ? here->face : here->plane,
                  here->side ? here->plane : here->face, !here->side, point, pair->normal,
                  pair->origin, found->area[k]);
    }
    written += found->m;
  }
  first[MAX_PLANES] = written;
  const crossing *at = &contact.at;
  if (geometry.crossing_area > tie * tie && at->separation > -max_depth) {
    const double down[3] = {-at->normal[0], -at->normal[1], -at->normal[2]};
    write_point(out, count + written, 0, face_at(s, a, at->a[0], at->a[1], down),
                face_at(s, b, at->b[0], at->b[1], at->normal), 0, at->on_a, at->normal, at->on_b,
                geometry.crossing_area);
    written++;
  } else {
    geometry.crossing_area = 0.0;
  }
  if (!written) return 0;
  write_rates(s, b, &contact, &geometry, tie, strip, fade, first, count, out);
  for (long long i = count; i < count + written && i < out->capacity; i++) {
    refer_to_base(s, b, i, out, out->area_rate + 6 * i);
    if (geometry.crossing_area > 0.0 && i == count + first[MAX_PLANES]) continue;
    refer_to_base(s, b, i, out, out->closure_rate + 6 * i);
    keep_sliding(i, out);
  }
  return written;
}

/* The contacts of two blocks, face on face, found so far */
typedef struct {
  int n;
  long long first[MAX_FACE_PAIRS], end[MAX_FACE_PAIRS]; /* their points */
  double height[MAX_FACE_PAIRS], normal[MAX_FACE_PAIRS][3]; /* of the lowest point; of the plane */
} face_pairs;

/* Remove points `first` to `end` of the `count` points that are written */
static void remove_points(const dem_points *out, long long first, long long end, long long count)
{
  const long long last = count < out->capacity ? count : out->capacity;
  if (end >= last) return;
  const size_t n = (size_t) (last - end);
  memmove(out->number + first, out->number + end, n * sizeof *out->number);
  memmove(out->face_a + first, out->face_a + end, n * sizeof *out->face_a);
  memmove(out->face_b + first, out->face_b + end, n * sizeof *out->face_b);
  memmove(out->plane_is_of_a + first, out->plane_is_of_a + end, n * sizeof *out->plane_is_of_a);
  memmove(out->area + first, out->area + end, n * sizeof *out->area);
  memmove(out->point + 3 * first, out->point + 3 * end, 3 * n * sizeof *out->point);
  memmove(out->normal + 3 * first, out->normal + 3 * end, 3 * n * sizeof *out->normal);
  memmove(out->base + 3 * first, out->base + 3 * end, 3 * n * sizeof *out->base);
  memmove(out->area_rate + 6 * first, out->area_rate + 6 * end, 6 * n * sizeof *out->area_rate);
  memmove(out->closure_rate + 6 * first, out->closure_rate + 6 * end,
          6 * n * sizeof *out->closure_rate);
}

/* Add a contact of `found` points from `count` on to the contacts of two convex blocks, and keep those
 * along whose normals the blocks overlap least: convex blocks touch in one plane. A block that slides
 * over the seam of its bed is a closure below the top of the next block, which it has passed with its
 * front: without this choice it would bear on the side of that block.
 *
 * Contacts whose normals differ by less than 4 degrees, as of a face of several facets, are all kept.
 * Returns how many points there are, or TOO_MANY_CORNERS. */
static long long add_face_pair(face_pairs *kept, const double *normal, double height, long long count,
                               long long found, const dem_points *out)
{
  const double min_cosine = 1.0 - 2.0 * DEM_FLUSH_SINE * DEM_FLUSH_SINE;
  for (int i = 0; i < kept->n; i++)
    if (dot(kept->normal[i], normal) < min_cosine && kept->height[i] >= height) return count;
  long long end = count + found;
  for (int i = kept->n - 1; i >= 0; i--) {
    if (dot(kept->normal[i], normal) >= min_cosine) continue;
    const long long points = kept->end[i] - kept->first[i];
    remove_points(out, kept->first[i], kept->end[i], end);
    end -= points;
    for (int j = i; j + 1 < kept->n; j++) {
      kept->first[j] = kept->first[j + 1] - points;
      kept->end[j] = kept->end[j + 1] - points;
      kept->height[j] = kept->height[j + 1];
      memcpy(kept->normal[j], kept->normal[j + 1], sizeof kept->normal[j]);
    }
    kept->n--;
  }
  if (kept->n == MAX_FACE_PAIRS) return TOO_MANY_CORNERS;
  kept->first[kept->n] = end - found;
  kept->end[kept->n] = end;
  kept->height[kept->n] = height;
  memcpy(kept->normal[kept->n++], normal, 3 * sizeof *normal);
  return end;
}

/* Contact points of pairs (p, 2) of blocks, the lower number first.
 *
 * max_gap, max_depth, tie, strip (p,) in m: range of the lowest point of a contact over the other
 * plane, the distance that counts as zero, and the width of a contact along an edge. Writes at most
 * `capacity` points, all points of a contact in a row, counter-clockwise seen along the normal of its
 * plane; returns how many there are. */
EXPORT long long dem_face_contacts(const dem_solids *s, long long p, const long long *pairs,
                                   const double *max_gap, const double *max_depth,
                                   const double *tie, const double *strip, const dem_points *out)
{
  const double max_cosine = -sqrt(1.0 - DEM_FLUSH_SINE * DEM_FLUSH_SINE);
  long long count = 0;
  for (long long i = 0; i < p; i++) {
    const long long a = pairs[2 * i], b = pairs[2 * i + 1], before = count;
    face_pairs kept = {.n = 0};
    for (long long f = s->first_face[a]; f < s->first_face[a + 1]; f++)
      for (long long g = s->first_face[b]; g < s->first_face[b + 1]; g++) {
        if (dot(s->normal + 3 * f, s->normal + 3 * g) > max_cosine) continue;
        double height;
        const long long found =
            touch(s, f, g, max_gap[i], max_depth[i], tie[i], strip[i], count, out, &height);
        if (found == TOO_MANY_CORNERS) return found;
        if (found == 0) continue;
        count = add_face_pair(&kept, s->normal + 3 * g, height, count, found, out);
        if (count == TOO_MANY_CORNERS) return count;
      }
    if (count > before) continue;
    const long long found =
        touch_at_edges(s, a, b, max_gap[i], max_depth[i], tie[i], strip[i], count, out);
    if (found == TOO_MANY_CORNERS) return found;
    count += found;
  }
  return count;
}
