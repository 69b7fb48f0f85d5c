/* relaxation.c: dynamic relaxation of rigid blocks on joints that have no history.
 *
 * A contact point is rows: J, how its closure and its shears follow the motions of the two blocks
 * that meet there. Displacements y of all motions move the points by J y, the law turns these total
 * displacements, in one step of virgin joints, into tractions, and J' turns tractions into forces
 * on the blocks. Nothing here knows the geometry, the law, or whether the scene is in the plane
 * (dim 2, dof 3) or in space (dim 3, dof 6).
 *
 * The law is called as a batch through a function pointer, so that this file needs no other source.
 */
#include <math.h>
#include <string.h>

#include "export.h"
#include "layout.h"

enum { ADAPT_INTERVAL = 10 /* iterations between two estimates of the lowest frequency */ };
static const double DAMPING_FACTOR = 1.8;    /* damping over the lowest frequency; 2 is critical */
static const double HIGHEST_FREQUENCY = 1.9; /* of iterations that are stable, which end at 2 */

/* Tractions of all joints at displacements y: 0, or -1 where the law lacks memory */
static int compute_tractions(const dem_relaxation *p)
{
  const long dim = p->dim, dof = p->dof;
  for (long long n = 0; n < p->n_laws; n++) {
    const dem_relaxed_law *law = p->laws + n;
    if (!law->n_joints) continue;
    for (long long j = 0; j < law->n_joints; j++) {
      const long long i = law->contact[j];
      const double *ya = p->y + dof * p->block_a[i], *yb = p->y + dof * p->block_b[i];
      const double *row = p->kinematics + i * dim * 2 * dof;
      for (long c = 0; c < dim; c++, row += 2 * dof) {
        double u = p->start[i * dim + c];
        for (long m = 0; m < dof; m++) u += row[m] * ya[m] + row[dof + m] * yb[m];
        law->d[j * dim + c] = u / p->reduction[c];
      }
    }
    *law->next_joint = 0;
    if (law->advance(law->batch, 0)) return -1;
  }
  return 0;
}

/* Unbalanced forces at displacements y */
EXPORT int dem_compute_unbalanced(const dem_relaxation *p)
{
  const long dim = p->dim, dof = p->dof;
  if (compute_tractions(p)) return -1;
  memcpy(p->force, p->load, (size_t) (p->n_blocks * dof) * sizeof(double));
  for (long long n = 0; n < p->n_laws; n++) {
    const dem_relaxed_law *law = p->laws + n;
    for (long long j = 0; j < law->n_joints; j++) {
      const long long i = law->contact[j];
      double *ra = p->force + dof * p->block_a[i], *rb = p->force + dof * p->block_b[i];
      const double *row = p->kinematics + i * dim * 2 * dof;
      for (long c = 0; c < dim; c++, row += 2 * dof) {
        const double push = p->area[i] * law->F[j * dim + c] / p->reduction[c];
        for (long m = 0; m < dof; m++) {
          ra[m] -= row[m] * push;
          rb[m] -= row[dof + m] * push;
        }
      }
    }
  }
  return 0;
}

/* Lowest frequency (per iteration) that moves now, by Rayleigh's quotient of the last iterations;
 * remembers y and the force. Also the norm of the force. */
static double lowest_frequency(dem_relaxation *p, double *size)
{
  const long long n = p->n_blocks * p->dof;
  double squares = 0.0, work = 0.0, inertia = 0.0;
  for (long long i = 0; i < n; i++) {
    const double moved = p->y[i] - p->previous_y[i];
    squares += p->force[i] * p->force[i];
    work += moved * (p->previous_force[i] - p->force[i]);
    inertia += p->mass[i] * moved * moved;
    p->previous_y[i] = p->y[i];
    p->previous_force[i] = p->force[i];
  }
  *size = sqrt(squares);
  const double omega = inertia > 0.0 && work > 0.0 ? sqrt(work / inertia) : 0.0;
  return omega < HIGHEST_FREQUENCY ? omega : HIGHEST_FREQUENCY;
}

/* `count` iterations of v <- ((2 - c) v + 2 r/m)/(2 + c), y <- y + v. Motions with is_free = 0 stay.
 * While p->done < p->ramp a falling share of the first unbalanced force `first_force` is taken off, which
 * brings the loads on slowly. p->smallest_force: smallest |r| met. 0; 1 once |r| is above p->largest_force or no
 * number, where iterations have diverged; -1 where memory is short. */
EXPORT int dem_relax(dem_relaxation *p, long long count)
{
  const long long n = p->n_blocks * p->dof;
  p->smallest_force = HUGE_VAL;
  for (long long t = 0; t < count; t++) {
    if (t % ADAPT_INTERVAL == 0) {
      double size;
      p->damping = DAMPING_FACTOR * lowest_frequency(p, &size);
      if (size < p->smallest_force) p->smallest_force = size;
      if (!(size <= p->largest_force)) return 1;
    }
    const double keep = (2.0 - p->damping) / (2.0 + p->damping), gain = 2.0 / (2.0 + p->damping);
    for (long long i = 0; i < n; i++) {
      p->v[i] = p->is_free[i] * (keep * p->v[i] + gain * p->force[i] / p->mass[i]);
      p->y[i] += p->v[i];
    }
    if (dem_compute_unbalanced(p)) return -1;
    p->done++;
    const double share = p->done < p->ramp ? 1.0 - (double) p->done / (double) p->ramp : 0.0;
    for (long long i = 0; i < n; i++) p->force[i] = p->is_free[i] * (p->force[i] - share * p->first_force[i]);
  }
  return 0;
}
