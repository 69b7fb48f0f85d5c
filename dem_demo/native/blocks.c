/* blocks.c: one time step of rigid blocks, in the plane or in space, around the step of the joint law.
 *
 * A contact point is a row (dem_demo/contact/rows.py): two blocks, closure, area, and how closure,
 * shears and area follow the motions of both. A geometry fills the rows, such as corners.c; nothing
 * here knows it. Python owns every array and keeps it in place; nothing here allocates or keeps
 * memory. layout.h, made from layout.py, describes the arrays. n blocks, k contact points; dim
 * components of a displacement of the law and dof motions of a block: 2 and 3 in the plane, 3 and 6
 * in space; SI units. A time step is
 *   dem_move_blocks   positions, contact points, increments of the law
 *   the law           by jointlaw, one batch of joints for each law
 *   dem_finish_step   tractions, forces, energies, velocities
 * docs/blocks.md describes the method.
 *
 * Functions with the arguments dim and dof are inlined with constants, once for the plane and once
 * for space.
 */
#include <math.h>

#include "export.h"
#include "layout.h"

enum { MAX_DIM = 3, MAX_MIDPOINT_ITERATIONS = 20 };
static const double MIDPOINT_TOLERANCE = 1e-15; /* of the angular velocity */

/* Hash of the sources that this library was built from */
EXPORT const char *dem_sources(void) { return DEM_SOURCES; }

static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }
static inline void cross(const double *p, const double *q, double *out)
{
  out[0] = p[1] * q[2] - p[2] * q[1];
  out[1] = p[2] * q[0] - p[0] * q[2];
  out[2] = p[0] * q[1] - p[1] * q[0];
}

/* ------------------------------------------------------------------------ before the law */

/* Rates of closure and shears of contact point i, at the velocities that led to the present motion */
INLINE void compute_rates(const dem_step *sim, long long i, const int dim, const int dof)
{
  const long long n = sim->n_blocks;
  const double *a = sim->motion + dof * n + sim->block_a[i];
  const double *b = sim->motion + dof * n + sim->block_b[i];
  const double *row = sim->kinematics + 2 * dim * dof * i;
  double *rates = sim->rates + dim * i;
  for (int c = 0; c < dim; c++, row += 2 * dof) {
    double rate = 0.0;
    for (int j = 0; j < dof; j++) rate += row[j] * a[j * n] + row[dof + j] * b[j * n];
    rates[c] = rate;
  }
}

INLINE void set_increments(dem_step *sim, double dt, const int dim, const int dof)
{
  sim->too_deep = -1;
  for (long long i = 0; i < sim->n_contacts; i++) {
    const double closure = sim->closure[i], offset = sim->closure_offset[i];
    const double limit =
        smaller(sim->max_overlap[sim->block_a[i]], sim->max_overlap[sim->block_b[i]]);
    if (sim->area[i] > 0.0 && closure > limit) sim->too_deep = i;
    const double joint_closure = closure - (closure > 0.0 || offset < 0.0 ? offset : 0.0);
    double *d = sim->laws[sim->law[i]].d + dim * sim->place[i];
    compute_rates(sim, i, dim, dof);
    d[0] = (joint_closure - sim->delta[dim * i]) / sim->law_steps;
    for (int c = 1; c < dim; c++)
      d[c] = sim->rates[dim * i + c] * dt / (sim->law_steps * sim->reduction[c]);
  }
}

/* Rates of all contact points, and displacement increments of their joints, at their places for
 * their laws; notes a contact that overlaps too much */
EXPORT void dem_set_increments(dem_step *sim, double dt)
{
  if (sim->dof == 3) set_increments(sim, dt, 2, 3);
  else set_increments(sim, dt, 3, 6);
}

/* Rates of all contact points */
EXPORT void dem_compute_rates(dem_step *sim)
{
  for (long long i = 0; i < sim->n_contacts; i++) {
    if (sim->dof == 3) compute_rates(sim, i, 2, 3);
    else compute_rates(sim, i, 3, 6);
  }
}

/* Rotate the axes of a block, the columns of `axes`, by angles about them. A first-order correction
 * keeps them orthonormal over any number of steps. */
static void rotate_axes(double *axes, const double *angles)
{
  const double size = sqrt(angles[0] * angles[0] + angles[1] * angles[1] + angles[2] * angles[2]);
  const double sine = size > 0.0 ? sin(size) / size : 1.0;
  const double half = size > 0.0 ? sin(0.5 * size) / (0.5 * size) : 1.0;
  for (int row = 0; row < 3; row++) {
    /* row of axes: r exp([angles]), as r + sine r x angles + half^2/2 (r x angles) x angles */
    double *r = axes + 3 * row, once[3], twice[3];
    cross(r, angles, once);
    cross(once, angles, twice);
    for (int c = 0; c < 3; c++) r[c] += sine * once[c] + 0.5 * half * half * twice[c];
  }
  double product[3][3], corrected[9]; /* rows by rows: the identity but for rounding */
  for (int p = 0; p < 3; p++)
    for (int q = 0; q < 3; q++)
      product[p][q] = axes[3 * p] * axes[3 * q] + axes[3 * p + 1] * axes[3 * q + 1] +
                      axes[3 * p + 2] * axes[3 * q + 2];
  for (int p = 0; p < 3; p++)
    for (int c = 0; c < 3; c++)
      corrected[3 * p + c] =
          1.5 * axes[3 * p + c] - 0.5 * (product[p][0] * axes[c] + product[p][1] * axes[3 + c] +
                                         product[p][2] * axes[6 + c]);
  for (int c = 0; c < 9; c++) axes[c] = corrected[c];
}

INLINE void move_blocks(dem_step *sim, double dt, const int dim, const int dof)
{
  const long long n = sim->n_blocks;
  sim->too_fast = -1;
  sim->rebuild = 0;
  for (long long i = 0; i < n; i++) {
    const double *v = sim->velocity + i;
    double speed = 0.0, spin = 0.0;
    for (int j = 0; j < dim; j++) speed += fabs(v[j * n]);
    for (int j = dim; j < dof; j++) spin += fabs(v[j * n]);
    speed += spin * sim->radius[i];
    const int is_slow = speed * dt < sim->max_skin_per_step * sim->skin[i]; /* false for NaN */
    if (sim->is_mobile[i] && !is_slow) sim->too_fast = i;
  }
  if (sim->too_fast >= 0) return;
  for (long long i = 0; i < n; i++) {
    double *m = sim->motion + i, angles[3], squares = 0.0, rotation = 0.0;
    if (!sim->is_mobile[i]) continue;
    for (int j = 0; j < dof; j++) {
      const double v = m[(dof + j) * n] = sim->velocity[j * n + i];
      m[j * n] += dt * v;
      const double moved = m[j * n] - sim->rebuilt_at[j * n + i];
      if (j < dim) {
        squares += moved * moved;
      } else {
        rotation += fabs(moved);
        angles[j - dim] = dt * v;
      }
    }
    if (dof == 6) rotate_axes(sim->axes + 9 * i, angles);
    const double distance = sqrt(squares) + rotation * sim->radius[i];
    if (distance > sim->max_skin_until_rebuild * sim->skin[i]) sim->rebuild = 1;
  }
  sim->transferred = sim->update_geometry(sim->geometry);
  for (long long i = 0; i < n && sim->transferred; i++) sim->rebuild |= sim->needs_rebuild[i];
  set_increments(sim, dt, dim, dof);
}

/* Move the blocks, update their contact points, and set the increments of the law.
 *
 * Notes a block that is too fast, before any has moved, and whether contacts must be searched
 * again. */
EXPORT void dem_move_blocks(dem_step *sim, double dt)
{
  if (sim->dof == 3) move_blocks(sim, dt, 2, 3);
  else move_blocks(sim, dt, 3, 6);
}

/* ------------------------------------------------------------------------- after the law */

INLINE void read_joints(dem_step *sim, const int dim)
{
  const long long k = sim->n_contacts;
  for (long long i = 0; i < k; i++) {
    const dem_law_joints *law = sim->laws + sim->law[i];
    const double *F = law->F + dim * sim->place[i];
    const double *measures = law->measures + (DEM_MEASURES + dim) * sim->place[i];
    const double *displacement = measures + DEM_MEASURES;
    for (int r = 0; r < DEM_MEASURES; r++) sim->measures[r * k + i] = measures[r];
    if (!law->bears_tension) sim->measures[DEM_DAMAGE * k + i] = 1.0;
    for (int c = 0; c < dim; c++) {
      const long long at = dim * i + c;
      sim->traction[at] = F[c] / sim->reduction[c];
      sim->delta[at] = (displacement[c] - sim->first_touch[at]) * sim->reduction[c];
    }
  }
}

/* Results of the law for each contact: traction, displacement since first touch, and the others */
EXPORT void dem_read_joints(dem_step *sim)
{
  if (sim->dim == 2) read_joints(sim, 2);
  else read_joints(sim, 3);
}

/* Upper bound of the stiffness (Pa/m) of contact i at its normal stress, by linear interpolation on
 * the first-loading curve */
static double stiffness_bound(const dem_step *sim, long long i)
{
  const double stress = sim->traction[sim->dim * i];
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

/* Forces of the joint of contact i on its blocks, and of its dashpots; returns its stiffness (N/m).
 *
 * The rows that turn motions into closure and shears turn their forces into forces on the motions. A
 * change of the area costs the stored energy. */
INLINE double apply_joint(const dem_step *sim, long long i, double *total, double *damped,
                          const int dim, const int dof)
{
  const long long k = sim->n_contacts;
  const long long a = sim->block_a[i], b = sim->block_b[i];
  const double area = sim->area[i];
  const double stiffness = stiffness_bound(sim, i) * area;
  const double energy = sim->measures[DEM_STORED_ENERGY * k + i];
  const double damage = sim->measures[DEM_DAMAGE * k + i];
  const double *row = sim->kinematics + 2 * dim * dof * i;
  const double *area_gradient = sim->area_gradient + 2 * dof * i;
  const double *rates = sim->rates + dim * i;
  double joint[MAX_DIM], dashpot[MAX_DIM] = {0.0};
  for (int c = 0; c < dim; c++) joint[c] = area * sim->traction[dim * i + c];
  const double inverse_mass = sim->inverse_mass[a] + sim->inverse_mass[b];
  if (inverse_mass > 0.0 && stiffness > 0.0) {
    /* 2 sqrt(stiffness * reduced mass), with half a joint for each block */
    const double critical = 2.0 * sqrt(stiffness * (0.5 / inverse_mass));
    dashpot[0] = sim->dashpot_normal * critical * rates[0];
    if (!(damage < 1.0)) dashpot[0] = larger(dashpot[0], -joint[0]); /* only a bond pulls */
    const double stick =
        larger(1.0 - sim->measures[DEM_SEPARATED * k + i] - sim->measures[DEM_SLIPPING * k + i],
               1.0 - damage);
    for (int c = 1; c < dim; c++) dashpot[c] = sim->dashpot_shear * critical * stick * rates[c];
  }
  for (int side = 0; side < 2; side++, row += dof, area_gradient += dof) {
    const long long at = dof * (side ? b : a);
    for (int j = 0; j < dof; j++) {
      double of_joint = 0.0, of_dashpot = 0.0;
      for (int c = 0; c < dim; c++) {
        of_joint += joint[c] * row[2 * dof * c + j];
        of_dashpot += dashpot[c] * row[2 * dof * c + j];
      }
      total[at + j] -= of_joint + energy * area_gradient[j];
      damped[at + j] -= of_dashpot;
    }
  }
  return stiffness;
}

INLINE void compute_forces(dem_step *sim, double dt, const int dim, const int dof)
{
  const long long n = sim->n_blocks, size = dof * n;
  double *total = sim->forces, *damped = total + size, *driven = damped + size;
  for (long long i = 0; i < 2 * size; i++) sim->previous_forces[i] = damped[i];
  for (long long i = 0; i < 3 * size; i++) total[i] = 0.0;
  sim->stiffened = 0;
  for (long long i = 0; i < sim->n_contacts; i++)
    sim->stiffened += apply_joint(sim, i, total, damped, dim, dof) > sim->checked_stiffness[i];
  for (long long i = 0; i < n; i++)
    for (int j = 0; j < dof; j++) {
      const long long at = dof * i + j;
      if (!sim->is_mobile[i]) total[at] = damped[at] = 0.0;
      else
        total[at] = (total[at] + damped[at]) +
                    (sim->gravity[at] + sim->loads[at] + sim->bolt_forces[at]);
    }
  for (long long i = 0; i < sim->n_driven; i++) {
    const long long block = sim->driven_block[i], axis = sim->driven_axis[i];
    const long long at = dof * block + axis;
    const double change = sim->driven_velocity[i] - sim->motion[(dof + axis) * n + block];
    driven[at] = sim->inertia[at] * change / dt - total[at];
    total[at] += driven[at];
  }
}

/* Forces on all blocks: joints, dashpots, weight and loads, and the reactions of drives that bring
 * their blocks to the prescribed velocities within dt. Counts the joints that are stiffer than the
 * time step allows. */
EXPORT void dem_compute_forces(dem_step *sim, double dt)
{
  if (sim->dof == 3) compute_forces(sim, dt, 2, 3);
  else compute_forces(sim, dt, 3, 6);
}

/* Add a step to the energy balance: dem_demo/dynamics/energy_balance.py explains it */
INLINE void add_energies(dem_step *sim, double dt, const int dof)
{
  const long long n = sim->n_blocks, k = sim->n_contacts;
  double *energy = sim->energy;
  double kinetic = 0.0, gravity_work = 0.0, load_work = 0.0, turned_over = 0.0;
  double stored = 0.0, friction = 0.0;
  double power[2] = {0.0, 0.0}; /* twice that of dashpots and drives */
  for (long long i = 0; i < n; i++) {
    double gravity_power = 0.0, load_power = 0.0;
    if (!sim->is_mobile[i]) continue;
    for (int j = 0; j < dof; j++) {
      const long long at = dof * i + j;
      const double v = sim->motion[(dof + j) * n + i];
      kinetic += v * (sim->inertia[at] * v + dt * sim->forces[at]);
      gravity_power += sim->gravity[at] * v;
      load_power += sim->loads[at] * v;
      for (int p = 0; p < 2; p++)
        power[p] +=
            (sim->previous_forces[dof * p * n + at] + sim->forces[dof * (p + 1) * n + at]) * v;
    }
    gravity_work += dt * gravity_power;
    load_work += dt * load_power;
    turned_over += fabs(dt * gravity_power) + fabs(dt * load_power);
  }
  for (long long i = 0; i < k; i++) {
    /* a joint loses its traction at the end of the step, when it acts on the area of that time */
    const double area = sim->booked_area[i] = sim->area[i];
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

/* Change of the angular velocity of block i in space by its gyroscopic moment within dt, after the
 * change by the other moments, about its own axes: I (w' - w) = dt (M - m x I m), m = (w + w')/2.
 * The implicit midpoint keeps the kinetic energy of a free block; a fixed point converges, because a
 * block rotates by a small angle in a step. */
static void add_gyroscopic_moment(const dem_step *sim, long long i, double dt)
{
  const long long n = sim->n_blocks;
  const double *inertia = sim->inertia + 6 * i + 3;
  double before[3], kicked[3], now[3];
  for (int j = 0; j < 3; j++) {
    before[j] = sim->motion[(9 + j) * n + i];
    now[j] = kicked[j] = sim->velocity[(3 + j) * n + i];
  }
  for (int t = 0; t < MAX_MIDPOINT_ITERATIONS; t++) {
    double mean[3], momentum[3], moment[3], change = 0.0, size = 0.0;
    for (int j = 0; j < 3; j++) {
      mean[j] = 0.5 * (before[j] + now[j]);
      momentum[j] = inertia[j] * mean[j];
    }
    cross(mean, momentum, moment);
    for (int j = 0; j < 3; j++) {
      const double next = kicked[j] - dt * moment[j] / inertia[j];
      change += fabs(next - now[j]);
      size += fabs(next);
      now[j] = next;
    }
    if (!(change > MIDPOINT_TOLERANCE * size)) break;
  }
  for (int j = 0; j < 3; j++) sim->velocity[(3 + j) * n + i] = now[j];
}

INLINE void finish_step(dem_step *sim, double dt, const int dim, const int dof)
{
  const long long n = sim->n_blocks;
  read_joints(sim, dim);
  compute_forces(sim, dt, dim, dof);
  add_energies(sim, dt, dof);
  /* a contact that has opened has no offset when it touches again */
  for (long long i = 0; i < sim->n_contacts; i++)
    if (sim->closure[i] <= 0.0 && sim->closure_offset[i] > 0.0) sim->closure_offset[i] = 0.0;
  for (long long i = 0; i < n; i++) {
    if (!sim->is_mobile[i]) continue;
    for (int j = 0; j < dof; j++)
      sim->velocity[j * n + i] += dt * sim->forces[dof * i + j] / sim->inertia[dof * i + j];
    if (dof == 6) add_gyroscopic_moment(sim, i, dt);
  }
  for (long long i = 0; i < sim->n_driven && dof == 6; i++) /* drives bear gyroscopic moments */
    sim->velocity[sim->driven_axis[i] * n + sim->driven_block[i]] = sim->driven_velocity[i];
}

/* Results of the law, forces, energies, and the velocities of the next step */
EXPORT void dem_finish_step(dem_step *sim, double dt)
{
  if (sim->dof == 3) finish_step(sim, dt, 2, 3);
  else finish_step(sim, dt, 3, 6);
}
