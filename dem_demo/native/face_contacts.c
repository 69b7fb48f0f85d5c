/* face_contacts.c: contacts of convex polyhedra, face on face.
 *
 * Two faces that look at each other are in contact over their overlap: face A of block a is projected
 * on the plane of face B of block b and clipped by the edges of B. The contact points are the corners
 * of this polygon. Point i stands for the area (A_i-1 + A_i)/2 with A_i the triangle between corners
 * i, i + 1 and the centroid, so area and first moments of the polygon are exact. A point lies on face
 * A, and its closure is its depth below the plane of B.
 *
 * Block a is the one with the lower number, whatever the blocks do: if the roles changed, so would the
 * sign of shear. Corners of the polygon that differ from a neighbour, or from the line between their
 * neighbours, by less than `tie` are no points: with them the number of points would change with the
 * rounding of flush faces.
 *
 * Nothing here allocates memory or knows a law. Vectors are three doubles.
 */
#include <math.h>
#include <string.h>

#include "export.h"
#include "layout.h"

enum {
  MAX_CORNERS = 128, /* of two faces together */
  TOO_MANY_CORNERS = -1
};

static double dot(const double *a, const double *b)
{
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
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

/* Vertices, normals and bounding boxes of all blocks at their present places */
EXPORT void dem_place_solids(const dem_solids *s)
{
  for (long long i = 0; i < s->n_blocks; i++) {
    const double *rotation = s->rotation + 9 * i, *position = s->position + 3 * i;
    double *low = s->box + 6 * i, *high = low + 3;
    for (int j = 0; j < 3; j++) {
      low[j] = HUGE_VAL;
      high[j] = -HUGE_VAL;
    }
    for (long long v = s->first_vertex[i]; v < s->first_vertex[i + 1]; v++) {
      for (int j = 0; j < 3; j++) {
        const double x = position[j] + dot(rotation + 3 * j, s->local_vertex + 3 * v);
        s->vertex[3 * v + j] = x;
        if (x < low[j]) low[j] = x;
        if (x > high[j]) high[j] = x;
      }
    }
    for (long long f = s->first_face[i]; f < s->first_face[i + 1]; f++)
      for (int j = 0; j < 3; j++)
        s->normal[3 * f + j] = dot(rotation + 3 * j, s->local_normal + 3 * f);
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

/* Projection of face f along the normal of face g in coordinates of the plane of g: corners counter-
 * clockwise seen along this normal if `reverse`. Returns the height of the lowest corner. */
static double project(const dem_solids *s, long long f, int reverse, const double *origin,
                      const double *first, const double *second, const double *normal,
                      double (*polygon)[2])
{
  const long long *ring = s->corner + s->first_corner[f];
  const int m = (int) (s->first_corner[f + 1] - s->first_corner[f]);
  double lowest = HUGE_VAL;
  for (int i = 0; i < m; i++) {
    double at[3];
    subtract(s->vertex + 3 * ring[reverse ? m - 1 - i : i], origin, at);
    polygon[i][0] = dot(at, first);
    polygon[i][1] = dot(at, second);
    const double height = dot(at, normal);
    if (height < lowest) lowest = height;
  }
  return lowest;
}

/* Contact points of face f of block a with face g of block b, written from point `count` on;
 * returns how many there are, or TOO_MANY_CORNERS */
static long long touch(const dem_solids *s, long long f, long long g, double max_gap,
                       double max_depth, double tie, long long count, const dem_points *out)
{
  const double *normal = s->normal + 3 * g, *face_normal = s->normal + 3 * f;
  const long long *ring = s->corner + s->first_corner[g];
  const double *origin = s->vertex + 3 * ring[0];
  const int m_a = (int) (s->first_corner[f + 1] - s->first_corner[f]);
  const int m_b = (int) (s->first_corner[g + 1] - s->first_corner[g]);
  double first[3], second[3], polygon[MAX_CORNERS][2], edges[MAX_CORNERS][2];
  if (m_a + m_b > MAX_CORNERS) return TOO_MANY_CORNERS;
  subtract(s->vertex + 3 * ring[1], origin, first);
  const double length = sqrt(dot(first, first));
  for (int j = 0; j < 3; j++) first[j] /= length;
  cross(normal, first, second);
  const double lowest = project(s, f, 1, origin, first, second, normal, polygon);
  if (!(lowest < max_gap && lowest > -max_depth)) return 0;
  project(s, g, 0, origin, first, second, normal, edges);
  int m = m_a;
  for (int i = 0; i < m_b && m > 2; i++) m = clip(polygon, m, edges[i], edges[(i + 1) % m_b]);
  m = without_ties(polygon, m, tie);
  if (m < 3) return 0;
  double centroid[2], start[3];
  if (!(polygon_area(polygon, m, centroid) > tie * tie)) return 0;
  subtract(s->vertex + 3 * s->corner[s->first_corner[f]], origin, start);
  const double cosine = dot(face_normal, normal);
  for (int i = 0; i < m; i++) {
    if (count + i >= out->capacity) continue;
    const double *here = polygon[i];
    double at[3];
    for (int j = 0; j < 3; j++) at[j] = here[0] * first[j] + here[1] * second[j];
    const double height = (dot(face_normal, start) - dot(face_normal, at)) / cosine;
    double *point = out->point + 3 * (count + i);
    for (int j = 0; j < 3; j++) point[j] = origin[j] + at[j] + height * normal[j];
    out->area[count + i] = 0.5 * (triangle_area(polygon[(i + m - 1) % m], here, centroid) +
                                  triangle_area(here, polygon[(i + 1) % m], centroid));
    out->face_a[count + i] = f;
    out->face_b[count + i] = g;
  }
  return m;
}

/* Contact points of pairs (p, 2) of blocks, the lower number first.
 *
 * max_gap, max_depth, tie (p,) in m: range of the lowest corner of a face over the other plane, and
 * the distance that counts as zero. max_cosine: largest cosine of two normals, -1 for parallel faces
 * that look at each other. Writes at most `capacity` points, all points of a contact in a row, counter-
 * clockwise seen along the normal of b; returns how many there are, or TOO_MANY_CORNERS. */
EXPORT long long dem_face_contacts(const dem_solids *s, long long p, const long long *pairs,
                                   const double *max_gap, const double *max_depth,
                                   const double *tie, double max_cosine, const dem_points *out)
{
  long long count = 0;
  for (long long i = 0; i < p; i++) {
    const long long a = pairs[2 * i], b = pairs[2 * i + 1];
    for (long long f = s->first_face[a]; f < s->first_face[a + 1]; f++)
      for (long long g = s->first_face[b]; g < s->first_face[b + 1]; g++) {
        if (dot(s->normal + 3 * f, s->normal + 3 * g) > max_cosine) continue;
        const long long found = touch(s, f, g, max_gap[i], max_depth[i], tie[i], count, out);
        if (found == TOO_MANY_CORNERS) return found;
        count += found;
      }
  }
  return count;
}
