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
 * Two blocks without such faces touch along an edge, at a corner, or where two edges cross. They are
 * in contact in the direction in which they overlap least, among the normals of their faces and the
 * products of their edges (separating axes). If it is the normal of a face of one block, the other
 * block stands on this face with an edge or a corner: its face next to the deepest vertex is clipped,
 * and of the polygon only the strip next to its lowest corner counts, `strip` wide from a tilt of
 * 5 degrees on, wider for smaller tilts, and the whole polygon up to 2 degrees. The upper corners of a
 * strip are open, so the areas count twice there. If it is the product of two edges, the point where
 * they cross is the contact. Blocks that meet in a vertex of both, or along two edges at a large tilt, have
 * no joint there: areas fade within `fade` of the border of a face, and of the ends of edges that cross. As the directions of the law belong to the face that is stood on, the
 * plane of a contact may be the one of a or of b (`plane_is_of_a`).
 *
 * Nothing here allocates memory or knows a law. Vectors are three doubles.
 */
#include <math.h>
#include <string.h>

#include "export.h"
#include "layout.h"

enum {
  MAX_CORNERS = 128, /* of two faces together */
  MAX_FACE_PAIRS = 64, /* in contact, of two blocks */
  TOO_MANY_CORNERS = -1
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

/* Mean place along a direction of the corners of a polygon that lie within about a length from the
 * farthest one; of the nearest one if the length is negative. Unlike the largest place it is smooth where
 * an edge becomes normal to the direction. */
static double extreme(double (*polygon)[2], int m, const double *direction, double length)
{
  double farthest = -HUGE_VAL, sum = 0.0, weights = 0.0;
  for (int i = 0; i < m; i++) {
    const double along = dot_2(direction, polygon[i]) / length;
    if (along > farthest) farthest = along;
  }
  for (int i = 0; i < m; i++) {
    const double along = dot_2(direction, polygon[i]) / length;
    const double weight = exp(along - farthest);
    sum += weight * along;
    weights += weight;
  }
  return length * sum / weights;
}

/* Keep the strip of a polygon next to its lowest corner. gradient (2,): slope of the height along both
 * axes; sine: of the tilt; width (m): of the strip from 5 degrees on, the whole polygon up to 2.
 * Returns the corners; `weight` is the factor of their areas. */
static int keep_strip(double (*polygon)[2], int m, const double *gradient, double sine, double width,
                      double *weight)
{
  const double slope = hypot(gradient[0], gradient[1]);
  const double share = (sine - DEM_FLUSH_SINE) / (DEM_STRIP_SINE - DEM_FLUSH_SINE);
  const double part = share > 1.0 ? 1.0 : share;
  *weight = 1.0;
  if (!(part > 0.0)) return m;
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

/* Sine of the smaller angle between a contour line of the height over the plane and one of both edges
 * of a polygon at its lowest corner */
static double contour_sine(double (*polygon)[2], int m, const double *gradient)
{
  int lowest = 0;
  for (int i = 1; i < m; i++)
    if (dot_2(gradient, polygon[i]) < dot_2(gradient, polygon[lowest])) lowest = i;
  double smallest = 1.0;
  for (int k = 1; k < m; k += m - 2) { /* the next corner, and the one before */
    const double *here = polygon[lowest], *other = polygon[(lowest + k) % m];
    const double edge[2] = {other[0] - here[0], other[1] - here[1]};
    const double sine = dot_2(gradient, edge) / (hypot(gradient[0], gradient[1]) * hypot(edge[0], edge[1]));
    smallest = fmin(smallest, fabs(sine));
  }
  return smallest;
}

/* Share of its area that a contact along an edge keeps near the border of the face that it lies on:
 * the distance from the border, over `fade`, of the lowest line of the polygon, and at most 1.
 *
 * An edge along the border, as one of two equal blocks rocks on the other, keeps its area up to a tilt of
 * DEM_WHOLE_EDGE_SINE: its contact passes between the planes of both, whose directions hardly differ.
 * From DEM_NO_EDGE_SINE on its area fades like the area of a corner. */
static double share_inside(double (*polygon)[2], int m, double (*edges)[2], int m_edges,
                           const double *gradient, double sine, double tie, double fade)
{
  double lowest = HUGE_VAL, farthest = 0.0, ends[2][2] = {{0.0}};
  for (int i = 0; i < m; i++) {
    const double height = gradient[0] * polygon[i][0] + gradient[1] * polygon[i][1];
    if (height < lowest) lowest = height;
  }
  int count = 0;
  for (int i = 0; i < m; i++) {
    const double height = gradient[0] * polygon[i][0] + gradient[1] * polygon[i][1];
    if (height > lowest + tie || count > 1) continue;
    memcpy(ends[count++], polygon[i], sizeof ends[0]);
  }
  if (count == 1) memcpy(ends[1], ends[0], sizeof ends[0]);
  for (int k = 0; k < 3; k++) { /* both ends of the lowest line and its middle */
    double distance = HUGE_VAL;
    const double x = 0.5 * (ends[k != 0][0] + ends[k == 2][0]);
    const double y = 0.5 * (ends[k != 0][1] + ends[k == 2][1]);
    for (int i = 0; i < m_edges; i++) {
      const double *start = edges[i], *end = edges[(i + 1) % m_edges];
      const double u = end[0] - start[0], v = end[1] - start[1];
      const double inside = (u * (y - start[1]) - v * (x - start[0])) / hypot(u, v);
      if (inside < distance) distance = inside;
    }
    if (distance > farthest) farthest = distance;
  }
  const double share = farthest < fade ? farthest / fade : 1.0;
  const double part =
      falling_ramp(sine, DEM_WHOLE_EDGE_SINE, DEM_NO_EDGE_SINE) *
      falling_ramp(contour_sine(polygon, m, gradient), DEM_EDGE_SINE, DEM_CORNER_SINE);
  return share + (1.0 - share) * part;
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
  int m;
} overlap;

/* The overlap of a face with the face whose plane it lies over, whose corners are `edges` */
static void find_overlap(const raised_face *face, double (*edges)[2], int m_edges, double tie,
                         double strip, double fade, overlap *out)
{
  double (*polygon)[2] = out->polygon, centroid[2], weight = 1.0, share = 1.0;
  const double *normal = face->normal;
  int m = face->m;
  for (int i = 0; i < m; i++) memcpy(polygon[i], face->corner[i], sizeof polygon[0]);
  for (int i = 0; i < m_edges && m > 2; i++)
    m = clip(polygon, m, edges[i], edges[(i + 1) % m_edges]);
  m = without_ties(polygon, m, tie);
  out->m = 0;
  out->lowest = HUGE_VAL;
  if (m < 3) return;
  const double *gradient = out->gradient, sine = hypot(normal[0], normal[1]);
  out->gradient[0] = -normal[0] / normal[2];
  out->gradient[1] = -normal[1] / normal[2];
  out->height = dot(normal, face->corner[0]) / normal[2];
  for (int i = 0; i < m; i++) {
    const double here = out->height + gradient[0] * polygon[i][0] + gradient[1] * polygon[i][1];
    if (here < out->lowest) out->lowest = here;
  }
  if (sine > DEM_FLUSH_SINE) {
    share = share_inside(polygon, m, edges, m_edges, gradient, sine, tie, fade);
    m = keep_strip(polygon, m, gradient, sine, strip, &weight);
    m = without_ties(polygon, m, tie);
  }
  if (m < 3 || !(share * polygon_area(polygon, m, centroid) > tie * tie)) return;
  for (int i = 0; i < m; i++)
    out->area[i] = 0.5 * share * weight *
                   (triangle_area(polygon[(i + m - 1) % m], polygon[i], centroid) +
                    triangle_area(polygon[i], polygon[(i + 1) % m], centroid));
  out->m = m;
}

/* Move a face by a small motion: along an axis (0 to 2), or about it (3 to 5) through the origin */
static void move_face(raised_face *face, int motion, double step)
{
  const int axis = motion % 3, next = (axis + 1) % 3, last = (axis + 2) % 3;
  const double cosine = cos(step), sine = sin(step);
  for (int i = -1; i < face->m; i++) {
    double *at = i < 0 ? face->normal : face->corner[i];
    if (motion < 3) {
      if (i >= 0) at[axis] += step;
      continue;
    }
    const double u = at[next], v = at[last];
    at[next] = cosine * u - sine * v;
    at[last] = sine * u + cosine * v;
  }
}

/* Derivatives (m, 6) of the areas of an overlap by displacements of the face along three axes, and by
 * rotations about them through the origin: by differences, zero where the number of corners changes */
static void find_area_rates(const raised_face *face, double (*edges)[2], int m_edges, double tie,
                            double strip, double fade, int m, double (*rate)[6])
{
  for (int motion = 0; motion < 6; motion++) {
    const double step = DEM_DIFFERENCE * (motion < 3 ? strip : 1.0);
    overlap moved[2];
    for (int side = 0; side < 2; side++) {
      raised_face copy = *face;
      move_face(&copy, motion, side ? step : -step);
      find_overlap(&copy, edges, m_edges, tie, strip, fade, moved + side);
    }
    const int is_same = moved[0].m == m && moved[1].m == m;
    for (int i = 0; i < m; i++)
      rate[i][motion] = is_same ? (moved[1].area[i] - moved[0].area[i]) / (2.0 * step) : 0.0;
  }
}

/* Write point `i`, if there is room for it. face_a, face_b: faces of the blocks; normal: outward of the
 * block whose plane it is; base: a point of this plane */
static void write_point(const dem_points *out, long long i, long long face_a, long long face_b,
                        int plane_is_of_a, const double *point, const double *normal,
                        const double *base, double area)
{
  if (i >= out->capacity) return;
  out->face_a[i] = face_a;
  out->face_b[i] = face_b;
  out->plane_is_of_a[i] = (unsigned char) plane_is_of_a;
  out->area[i] = area;
  for (int j = 0; j < 3; j++) {
    out->point[3 * i + j] = point[j];
    out->normal[3 * i + j] = normal[j];
    out->base[3 * i + j] = base[j];
    out->area_rate[6 * i + j] = out->area_rate[6 * i + 3 + j] = 0.0;
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

/* Contact points of face f of one block with face g of another, in whose plane they are clipped,
 * written from point `count` on. f_is_of_a: whether f belongs to the block with the lower number;
 * strip (m): width at an edge; height (m): of the lowest point of the overlap over the plane. Returns
 * how many there are, or TOO_MANY_CORNERS. */
static long long touch(const dem_solids *s, long long f, long long g, int f_is_of_a, double max_gap,
                       double max_depth, double tie, double strip, long long count,
                       const dem_points *out, double *height)
{
  const double *normal = s->normal + 3 * g;
  const long long *ring = s->corner + s->first_corner[g], *ring_f = s->corner + s->first_corner[f];
  const double *origin = s->vertex + 3 * ring[0];
  const int m_f = (int) (s->first_corner[f + 1] - s->first_corner[f]);
  const int m_g = (int) (s->first_corner[g + 1] - s->first_corner[g]);
  if (m_f + m_g > MAX_CORNERS - 1) return TOO_MANY_CORNERS;
  double axis[3][3], edges[MAX_CORNERS][2], lowest = HUGE_VAL;
  raised_face face;
  face.m = m_f;
  subtract(s->vertex + 3 * ring[1], origin, axis[0]);
  const double length = sqrt(dot(axis[0], axis[0]));
  for (int j = 0; j < 3; j++) axis[0][j] /= length;
  cross(normal, axis[0], axis[1]);
  memcpy(axis[2], normal, sizeof axis[2]);
  for (int i = 0; i < m_f; i++) {
    double at[3];
    subtract(s->vertex + 3 * ring_f[m_f - 1 - i], origin, at);
    for (int k = 0; k < 3; k++) face.corner[i][k] = dot(at, axis[k]);
    if (face.corner[i][2] < lowest) lowest = face.corner[i][2];
  }
  if (!(lowest < max_gap)) return 0;
  for (int k = 0; k < 3; k++) face.normal[k] = dot(s->normal + 3 * f, axis[k]);
  for (int i = 0; i < m_g; i++) {
    double at[3];
    subtract(s->vertex + 3 * ring[i], origin, at);
    for (int k = 0; k < 2; k++) edges[i][k] = dot(at, axis[k]);
  }
  const double fade = DEM_FADE_PER_GAP * max_gap;
  overlap found;
  find_overlap(&face, edges, m_g, tie, strip, fade, &found);
  *height = found.lowest;
  if (!(found.lowest < max_gap && found.lowest > -max_depth)) return 0;
  const int is_flush = !(hypot(face.normal[0], face.normal[1]) > DEM_FLUSH_SINE);
  for (int i = 0; i < found.m; i++) {
    const double *here = found.polygon[i];
    const int corner = is_flush ? corner_of_plane(&face, edges, m_g, here, tie) : -1;
    if (corner >= 0) {
      write_point(out, count + i, f_is_of_a ? f : g, f_is_of_a ? g : f, f_is_of_a,
                  s->vertex + 3 * ring[corner], s->normal + 3 * f, s->vertex + 3 * ring_f[0],
                  found.area[i]);
      continue;
    }
    const double up = found.height + found.gradient[0] * here[0] + found.gradient[1] * here[1];
    double point[3];
    for (int j = 0; j < 3; j++)
      point[j] = origin[j] + here[0] * axis[0][j] + here[1] * axis[1][j] + up * normal[j];
    write_point(out, count + i, f_is_of_a ? f : g, f_is_of_a ? g : f, !f_is_of_a, point, normal,
                origin, found.area[i]);
  }
  if (found.m > 0 && !is_flush) {
    double rate[MAX_CORNERS][6];
    find_area_rates(&face, edges, m_g, tie, strip, fade, found.m, rate);
    for (int i = 0; i < found.m && count + i < out->capacity; i++)
      for (int j = 0; j < 6; j++)
        for (int k = 0; k < 3; k++)
          out->area_rate[6 * (count + i) + j] += rate[i][3 * (j / 3) + k] * axis[k][j % 3];
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

/* Where two blocks are farthest apart along the product of two edges that cross */
typedef struct {
  double separation, normal[3], on_a[3], on_b[3]; /* normal from b to a */
  long long a[2], b[2];                           /* vertices of the edges */
  double inside;                                  /* least distance from their ends */
} crossing;

/* Compare the crossing of edges `a` and `b` with the best one so far */
static void try_crossing(const dem_solids *s, long long block_a, long long block_b,
                         const long long *a, const long long *b, crossing *best)
{
  double one[3], other[3], normal[3], between[3];
  const double *start_a = s->vertex + 3 * a[0], *start_b = s->vertex + 3 * b[0];
  subtract(s->vertex + 3 * a[1], start_a, one);
  subtract(s->vertex + 3 * b[1], start_b, other);
  cross(one, other, normal);
  const double square = dot(normal, normal), size = sqrt(square);
  if (size < DEM_CROSSING_SINE * sqrt(dot(one, one) * dot(other, other))) return;
  subtract(start_b, start_a, between);
  double part[3];
  cross(between, other, part);
  const double along_a = dot(part, normal) / square;
  cross(between, one, part);
  const double along_b = dot(part, normal) / square;
  if (!(along_a >= 0.0 && along_a <= 1.0 && along_b >= 0.0 && along_b <= 1.0)) return;
  for (int j = 0; j < 3; j++) normal[j] /= size;
  double low_a, high_a, low_b, high_b;
  extent(s, block_a, normal, &low_a, &high_a);
  extent(s, block_b, normal, &low_b, &high_b);
  const double separation = low_a - high_b > low_b - high_a ? low_a - high_b : low_b - high_a;
  if (!(separation > best->separation)) return;
  const double sign = low_a - high_b > low_b - high_a ? 1.0 : -1.0;
  double on_a[3], on_b[3], gap = 0.0;
  for (int j = 0; j < 3; j++) {
    on_a[j] = start_a[j] + along_a * one[j];
    on_b[j] = start_b[j] + along_b * other[j];
    gap += sign * normal[j] * (on_a[j] - on_b[j]);
  }
  if (fabs(gap - separation) > DEM_CROSSING_ERROR * sqrt(dot(one, one)))
    return; /* other vertices are nearer along this direction */
  best->separation = separation;
  best->inside = fmin(fmin(along_a, 1.0 - along_a) * sqrt(dot(one, one)),
                      fmin(along_b, 1.0 - along_b) * sqrt(dot(other, other)));
  for (int j = 0; j < 3; j++) {
    best->normal[j] = sign * normal[j];
    best->on_a[j] = on_a[j];
    best->on_b[j] = on_b[j];
  }
  memcpy(best->a, a, sizeof best->a);
  memcpy(best->b, b, sizeof best->b);
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

/* Contact points of two blocks that touch along an edge, at a corner, or where two edges cross,
 * written from point `count` on; returns how many there are, or TOO_MANY_CORNERS */
static long long touch_at_edges(const dem_solids *s, long long a, long long b, double max_gap,
                                double max_depth, double tie, double strip, long long count,
                                const dem_points *out)
{
  const long long block[2] = {a, b};
  double largest = -HUGE_VAL;
  long long plane = -1, vertex = -1;
  int side = 0; /* block of the plane */
  for (int i = 0; i < 2; i++)
    for (long long f = s->first_face[block[i]]; f < s->first_face[block[i] + 1]; f++) {
      double height;
      const long long deepest =
          deepest_vertex(s, block[1 - i], s->vertex + 3 * s->corner[s->first_corner[f]],
                         s->normal + 3 * f, &height);
      if (height > largest) {
        largest = height;
        plane = f;
        vertex = deepest;
        side = i;
      }
      if (largest >= max_gap) return 0;
    }
  /* a crossing at the end of an edge has the direction of the face to second order: the face goes first */
  const crossing best = find_crossing(s, a, b, largest + tie);
  if (best.separation >= max_gap || best.separation <= -max_depth) return 0;
  if (best.a[0] >= 0) {
    const double share = fmin(best.inside / (DEM_FADE_PER_GAP * max_gap), 1.0);
    if (!(share * strip * strip > tie * tie)) return 0;
    const double down[3] = {-best.normal[0], -best.normal[1], -best.normal[2]};
    write_point(out, count, face_at(s, a, best.a[0], best.a[1], down),
                face_at(s, b, best.b[0], best.b[1], best.normal), 0, best.on_a, best.normal,
                best.on_b, share * strip * strip);
    return 1;
  }
  const double *normal = s->normal + 3 * plane;
  const double down[3] = {-normal[0], -normal[1], -normal[2]};
  const long long face = face_at(s, block[1 - side], vertex, vertex, down);
  double height;
  return touch(s, face, plane, side, max_gap, max_depth, tie, strip, count, out, &height);
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
  memmove(out->face_a + first, out->face_a + end, n * sizeof *out->face_a);
  memmove(out->face_b + first, out->face_b + end, n * sizeof *out->face_b);
  memmove(out->plane_is_of_a + first, out->plane_is_of_a + end, n * sizeof *out->plane_is_of_a);
  memmove(out->area + first, out->area + end, n * sizeof *out->area);
  memmove(out->point + 3 * first, out->point + 3 * end, 3 * n * sizeof *out->point);
  memmove(out->normal + 3 * first, out->normal + 3 * end, 3 * n * sizeof *out->normal);
  memmove(out->base + 3 * first, out->base + 3 * end, 3 * n * sizeof *out->base);
  memmove(out->area_rate + 6 * first, out->area_rate + 6 * end, 6 * n * sizeof *out->area_rate);
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
            touch(s, f, g, 1, max_gap[i], max_depth[i], tie[i], strip[i], count, out, &height);
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
