/* face_points.c: rows of contact points of faces on faces, while the blocks move.
 *
 * A point is fixed to one block, and the plane that it lies on to the other one, with the directions
 * of the law: the normal out of the block of the plane, and two axes along which the block of the
 * point moves where shears grow. The plane is of block b, or of a where a block stands on its edge
 * (face_contacts.c). The closure is the depth of the point below the plane, so with the shears at the
 * point it has exact rates by the motions of both blocks, and the work of the tractions on the blocks is
 * the work that the joint takes up. The polygons of the overlaps, and with them the points, change where
 * contacts are searched again; until then the areas of contacts along edges follow their derivatives, and
 * the closures of points that slide along the border of a face theirs.
 */
#include <math.h>

#include "export.h"
#include "layout.h"

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

/* A vector along the axes of a block (columns of `axes`), in space */
static void to_space(const double *axes, const double *local, double *out)
{
  for (int j = 0; j < 3; j++) out[j] = dot(axes + 3 * j, local);
}

/* A vector in space along the axes of a block */
static void to_block(const double *axes, const double *vector, double *out)
{
  for (int j = 0; j < 3; j++)
    out[j] = axes[j] * vector[0] + axes[3 + j] * vector[1] + axes[6 + j] * vector[2];
}

/* Row of one displacement of the law, whose rate is `direction` times the velocity at the point of its
 * block less the velocity of the other block there. arm, other_arm: from the centroids, along the axes
 * of the blocks; row, other_row: the parts of both blocks */
static void fill_row(const double *direction, const double *axes, const double *arm,
                     const double *other_axes, const double *other_arm, double *row,
                     double *other_row)
{
  double along[3], turn[3];
  to_block(axes, direction, along);
  cross(arm, along, row + 3);
  to_block(other_axes, direction, along);
  cross(other_arm, along, turn);
  for (int j = 0; j < 3; j++) {
    row[j] = direction[j];
    other_row[j] = -direction[j];
    other_row[3 + j] = -turn[j];
  }
}

/* Closure, area and kinematics of points `begin` to `end` at the present places. Returns how many have
 * changed by so much of their area, or slid by so much of their closure, that they must be searched
 * again. */
EXPORT long long dem_update_face_points(void *geometry, long long begin, long long end)
{
  const dem_face_points *points = (const dem_face_points *) geometry;
  const long long n = points->n_blocks;
  long long changed = 0;
  for (long long i = begin; i < end; i++) {
    const int plane_is_of_a = points->plane_is_of_a[i];
    const long long a = points->block_a[i], b = points->block_b[i];
    const long long own = plane_is_of_a ? b : a, other = plane_is_of_a ? a : b;
    const double *axes = points->axes + 9 * own, *other_axes = points->axes + 9 * other;
    const double *local_point = points->local_point + 3 * i;
    const double *local_frame = points->local_frame + 9 * i;
    double *row = points->kinematics + 36 * i + 6 * plane_is_of_a;
    double *other_row = points->kinematics + 36 * i + 6 * !plane_is_of_a;
    double arm[3], other_arm[3], frame[3][3];
    to_space(axes, local_point, arm);
    for (int j = 0; j < 3; j++) /* from the other centroid */
      arm[j] += points->motion[j * n + own] - points->motion[j * n + other];
    to_block(other_axes, arm, other_arm);
    for (int c = 0; c < 3; c++) to_space(other_axes, local_frame + 3 * c, frame[c]);
    const double *found_at = points->found_at + 12 * i, *gradient = points->area_gradient + 12 * i;
    const double *sliding = points->sliding_gradient + 12 * i;
    double area = points->found_area[i], slid = 0.0;
    for (int j = 0; j < 6 && points->has_gradients[i]; j++) {
      const double of_a = points->motion[j * n + a] - found_at[j];
      const double of_b = points->motion[j * n + b] - found_at[6 + j];
      area += gradient[j] * of_a + gradient[6 + j] * of_b;
      slid += sliding[j] * of_a + sliding[6 + j] * of_b;
    }
    points->area[i] = fmax(area, DEM_MIN_AREA_SHARE * points->found_area[i]);
    points->closure[i] = points->plane_offset[i] - dot(other_arm, local_frame) + slid;
    for (int j = 0; j < 3; j++) frame[0][j] = -frame[0][j]; /* towards the plane is closing */
    for (int c = 0; c < 3; c++)
      fill_row(frame[c], axes, local_point, other_axes, other_arm, row + 12 * c,
               other_row + 12 * c);
    if (!points->has_gradients[i]) continue;
    for (int j = 0; j < 12; j++) points->kinematics[36 * i + j] += sliding[j];
    changed += points->closure[i] > 0.0 &&
               (fabs(area - points->found_area[i]) > DEM_MAX_AREA_CHANGE * points->found_area[i] ||
                fabs(slid) > DEM_MAX_AREA_CHANGE * points->closure[i]);
  }
  return changed;
}
