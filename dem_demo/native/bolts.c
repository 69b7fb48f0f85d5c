/* bolts.c: rock bolts between two blocks, elastic and perfectly plastic in tension.
 *
 * The force follows from the distance of the two anchored points, at the present motion of the
 * blocks, and from the plastic elongation so far, which is the whole history of a bolt.
 */
#include <math.h>

#include "export.h"
#include "layout.h"

/* Position of the end of a bolt that is anchored in a block */
static dem_vector end_of(const dem_bolts *p, long long block, dem_vector local)
{
  const long long n = p->n_blocks;
  const double angle = p->motion[2 * n + block], c = cos(angle), s = sin(angle);
  const dem_vector end = {p->motion[block] + c * local.x - s * local.y,
                          p->motion[n + block] + s * local.x + c * local.y};
  return end;
}

/* Add a force at a point to the forces of a block */
static void add_force(const dem_bolts *p, long long block, dem_vector at, double x, double y)
{
  double *force = p->forces + 3 * block;
  const double arm_x = at.x - p->motion[block], arm_y = at.y - p->motion[p->n_blocks + block];
  force[0] += x;
  force[1] += y;
  force[2] += arm_x * y - arm_y * x;
}

/* Tensions and forces on the blocks at their present motion; plastic elongations grow where the
 * capacity is reached. Returns the energy stored in all bolts and dissipated by their yielding. */
EXPORT double dem_pull_bolts(dem_bolts *p)
{
  double energy = 0.0;
  for (long long i = 0; i < p->n_bolts; i++)
    for (int j = 0; j < 3; j++)
      p->forces[3 * p->block_a[i] + j] = p->forces[3 * p->block_b[i] + j] = 0.0;
  for (long long i = 0; i < p->n_bolts; i++) {
    const long long a = p->block_a[i], b = p->block_b[i];
    const dem_vector from = end_of(p, a, p->local_a[i]), to = end_of(p, b, p->local_b[i]);
    const double x = to.x - from.x, y = to.y - from.y, length = sqrt(x * x + y * y);
    double tension = p->stiffness[i] * (length - p->free_length[i] - p->yielding[i]);
    if (tension > p->capacity[i]) {
      p->yielding[i] += (tension - p->capacity[i]) / p->stiffness[i];
      tension = p->capacity[i];
    }
    if (tension < 0.0) tension = 0.0;
    p->tension[i] = tension;
    energy += 0.5 * tension * tension / p->stiffness[i] + p->capacity[i] * p->yielding[i];
    if (length > 0.0) {
      add_force(p, a, from, tension * x / length, tension * y / length);
      add_force(p, b, to, -tension * x / length, -tension * y / length);
    }
  }
  return energy;
}

/* Tractions of bolts in a relaxation (`dem_advance`): the first component of a displacement is
 * minus the elongation, the first component of a traction minus the tension. */
EXPORT int dem_bolt_tractions(void *batch, int operation)
{
  const dem_relaxed_bolts *p = batch;
  (void) operation;
  for (long long i = 0; i < p->n_bolts; i++) {
    double tension = -p->stiffness[i] * p->d[i * p->dim];
    if (tension > p->capacity[i]) tension = p->capacity[i];
    if (tension < 0.0) tension = 0.0;
    p->F[i * p->dim] = -tension;
  }
  return 0;
}
