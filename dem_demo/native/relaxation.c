/* relaxation.c: dynamic relaxation of rigid blocks on joints that have no history.
 *
 * A contact point is rows: J, how its closure and its shears follow the motions of the two blocks
 * that meet there. Displacements y of all motions move the points by J y, the law turns these total
 * displacements, in one step of virgin joints, into tractions, and J' turns tractions into forces
 * on the blocks. Nothing here knows the geometry, the law, or whether the scene is in the plane
 * (dim 2, dof 3) or in space (dim 3, dof 6).
 *
 * A law is called as a batch through a function pointer, so that this file needs no other source; but
 * plain friction, the most common law, is computed here, ten times as fast.
 */
#include <math.h>
#include <string.h>

#include "export.h"
#include "layout.h"

enum { ADAPT_INTERVAL = 10 /* iterations between two estimates of the lowest frequency */ };
static const double DAMPING_FACTOR = 1.8;    /* damping over the lowest frequency; 2 is critical */
static const double HIGHEST_FREQUENCY = 1.9; /* of iterations that are stable, which end at 2 */

/* Displacement u (dim,) of contact point i at displacements y, divided by the reduction factor.
 * dim and dof are constants where this is called, so that the loops are unrolled. */
INLINE void displace(const dem_relaxation *p, long long i, int dim, int dof, double *u)
{
  const double *ya = p->y + dof * p->block_a[i], *yb = p->y + dof * p->block_b[i];
  const double *row = p->kinematics + i * dim * 2 * dof;
  for (int c = 0; c < dim; c++, row += 2 * dof) {
    double sum = p->start[i * dim + c];
    for (int m = 0; m < dof; m++) sum += row[m] * ya[m] + row[dof + m] * yb[m];
    u[c] = sum / p->reduction[c];
  }
}

/* Take the forces of contact point i with tractions F (dim,) off the unbalanced forces */
INLINE void resist(const dem_relaxation *p, long long i, int dim, int dof, const double *F)
{
  double *ra = p->force + dof * p->block_a[i], *rb = p->force + dof * p->block_b[i];
  const double *row = p->kinematics + i * dim * 2 * dof;
  for (int c = 0; c < dim; c++, row += 2 * dof) {
    const double push = p->area[i] * F[c] / p->reduction[c];
    for (int m = 0; m < dof; m++) {
      ra[m] -= row[m] * push;
      rb[m] -= row[dof + m] * push;
    }
  }
}

/* Forces of joints that follow Coulomb's law without tension and softening. One step of a virgin
 * joint has a closed form: springs, and shear stress up to cohesion + friction * normal stress. */
INLINE void resist_by_friction(const dem_relaxation *p, const dem_relaxed_law *law, int dim,
                                      int dof)
{
  const double normal_stiffness = law->normal_stiffness, friction = law->friction;
  const double cohesion = law->cohesion;
  const long long *restrict contact = law->contact;
  const long long *restrict block_a = p->block_a, *restrict block_b = p->block_b;
  const double *restrict kinematics = p->kinematics, *restrict start = p->start;
  const double *restrict area = p->area, *restrict y = p->y;
  double *restrict force = p->force;
  double inverse_reduction[3];
  for (int c = 0; c < dim; c++) inverse_reduction[c] = 1.0 / p->reduction[c];
  const double shear_stiffness = law->shear_stiffness * inverse_reduction[1];
  for (long long j = 0; j < law->n_joints; j++) {
    const long long i = contact[j];
    const double *row = kinematics + i * dim * 2 * dof;
    const double *ya = y + dof * block_a[i], *yb = y + dof * block_b[i];
    double *ra = force + dof * block_a[i], *rb = force + dof * block_b[i];
    double F[3], size = 0.0;
    F[0] = start[i * dim];
    for (int m = 0; m < dof; m++) F[0] += row[m] * ya[m] + row[dof + m] * yb[m];
    if (F[0] <= 0.0) continue; /* not for NaN, which shows that iterations diverge */
    F[0] *= normal_stiffness;
    for (int c = 1; c < dim; c++) {
      F[c] = start[i * dim + c];
      for (int m = 0; m < dof; m++)
        F[c] += row[2 * dof * c + m] * ya[m] + row[2 * dof * c + dof + m] * yb[m];
      F[c] *= shear_stiffness;
      size += F[c] * F[c];
    }
    const double limit = cohesion + friction * F[0];
    if (size > limit * limit) {
      const double ratio = limit / sqrt(size);
      for (int c = 1; c < dim; c++) F[c] *= ratio;
    }
    for (int c = 0; c < dim; c++) F[c] *= area[i] * inverse_reduction[c];
    for (int m = 0; m < dof; m++) {
      double on_a = 0.0, on_b = 0.0; /* each force is read and written once */
      for (int c = 0; c < dim; c++) {
        on_a += row[2 * dof * c + m] * F[c];
        on_b += row[2 * dof * c + dof + m] * F[c];
      }
      ra[m] -= on_a;
      rb[m] -= on_b;
    }
  }
}

/* Forces of the joints of a law: 0, or -1 where the law lacks memory */
INLINE int resist_by_law(const dem_relaxation *p, const dem_relaxed_law *law, int dim, int dof)
{
  if (!law->n_joints) return 0;
  if (law->is_friction) {
    resist_by_friction(p, law, dim, dof);
    return 0;
  }
  for (long long j = 0; j < law->n_joints; j++)
    displace(p, law->contact[j], dim, dof, law->d + j * dim);
  *law->next_joint = 0;
  if (law->advance(law->batch, 0)) return -1;
  for (long long j = 0; j < law->n_joints; j++)
    resist(p, law->contact[j], dim, dof, law->F + j * dim);
  return 0;
}

/* Unbalanced forces at displacements y: 0, or -1 where a law lacks memory */
EXPORT int dem_compute_unbalanced(const dem_relaxation *p)
{
  memcpy(p->force, p->load, (size_t) (p->n_blocks * p->dof) * sizeof(double));
  for (long long n = 0; n < p->n_laws; n++)
    if (p->dim == 2 ? resist_by_law(p, p->laws + n, 2, 3) : resist_by_law(p, p->laws + n, 3, 6))
      return -1;
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

/* One iteration of n motions: changes v and displacements y */
static void move(long long n, double damping, const double *restrict is_free,
                 const double *restrict force, const double *restrict mass, double *restrict v,
                 double *restrict y)
{
  const double keep = (2.0 - damping) / (2.0 + damping), gain = 2.0 / (2.0 + damping);
  for (long long i = 0; i < n; i++) {
    v[i] = is_free[i] * (keep * v[i] + gain * force[i] / mass[i]);
    y[i] += v[i];
  }
}

/* `count` iterations of v <- ((2 - c) v + 2 r/m)/(2 + c), y <- y + v. Motions with is_free = 0 stay.
 * While p->done < p->ramp a falling share of the first unbalanced force `first_force` is taken off,
 * which brings the loads on slowly. p->smallest_force: smallest |r| met. 0; 1 once |r| is above
 * p->largest_force or no number, where iterations have diverged; -1 where memory is short. */
EXPORT int dem_relax(dem_relaxation *p, long long count)
{
  const long long n = p->n_blocks * p->dof;
  p->smallest_force = HUGE_VAL;
  for (long long t = 0; t < count; t++) {
    if (t % ADAPT_INTERVAL == 0) {
      double size;
      p->damping = fmax(DAMPING_FACTOR * lowest_frequency(p, &size), p->smallest_damping);
      if (size < p->smallest_force) p->smallest_force = size;
      if (!(size <= p->largest_force)) return 1;
    }
    move(n, p->damping, p->is_free, p->force, p->mass, p->v, p->y);
    if (dem_compute_unbalanced(p)) return -1;
    p->done++;
    const double share = p->done < p->ramp ? 1.0 - (double) p->done / (double) p->ramp : 0.0;
    for (long long i = 0; i < n; i++)
      p->force[i] = p->is_free[i] * (p->force[i] - share * p->first_force[i]);
  }
  return 0;
}
