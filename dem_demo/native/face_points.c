/* face_points.c: rows of contact points of faces on faces, while the blocks move.
 *
 * A point is fixed to block a, on whose face it lies. The directions of the law are fixed to block b:
 * the normal of its face, axis 2 and axis 3. The closure is the depth of the point below the plane of
 * the face of b, so with the shears at the point it has exact rates by the motions of both blocks, and
 * the work of the tractions on the blocks is the work that the joint takes up. The polygons of the
 * overlaps, and with them points and areas, change where contacts are searched again.
 */
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

/* Row of one displacement of the law, whose rate is `direction` times the velocity of a at the point
 * less the velocity of b there. arm_a, arm_b: from the centroids, along the axes of the blocks */
static void fill_row(const double *direction, const double *axes_a, const double *arm_a,
                     const double *axes_b, const double *arm_b, double *row)
{
  double in_a[3], in_b[3], turn_b[3];
  to_block(axes_a, direction, in_a);
  to_block(axes_b, direction, in_b);
  cross(arm_a, in_a, row + 3);
  cross(arm_b, in_b, turn_b);
  for (int j = 0; j < 3; j++) {
    row[j] = direction[j];
    row[6 + j] = -direction[j];
    row[9 + j] = -turn_b[j];
  }
}

/* Closure and kinematics of all points at the present places; no contact goes on to another face */
EXPORT long long dem_update_face_points(dem_face_points *points)
{
  const long long n = points->n_blocks;
  for (long long i = 0; i < points->n_points; i++) {
    const long long a = points->block_a[i], b = points->block_b[i];
    const double *axes_a = points->axes + 9 * a, *axes_b = points->axes + 9 * b;
    const double *local_point = points->local_point + 3 * i;
    const double *local_frame = points->local_frame + 9 * i;
    double *rows = points->kinematics + 36 * i;
    double arm[3], arm_b[3], frame[3][3];
    to_space(axes_a, local_point, arm);
    for (int j = 0; j < 3; j++)
      arm[j] += points->motion[j * n + a] - points->motion[j * n + b]; /* from the centroid of b */
    to_block(axes_b, arm, arm_b);
    for (int c = 0; c < 3; c++) to_space(axes_b, local_frame + 3 * c, frame[c]);
    points->closure[i] = points->plane_offset[i] - dot(arm_b, local_frame);
    for (int j = 0; j < 3; j++) frame[0][j] = -frame[0][j]; /* towards b is closing */
    for (int c = 0; c < 3; c++)
      fill_row(frame[c], axes_a, local_point, axes_b, arm_b, rows + 12 * c);
  }
  return 0;
}
