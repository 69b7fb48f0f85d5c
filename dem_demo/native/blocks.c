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
 * Threads. Both functions consist of phases (DEM_MOVE and so on, layout.py), which Python may run on
 * several threads instead: each thread calls dem_run_phase, and takes the next part of the blocks or
 * of the points until none is left. The results are the same bits for any number of threads: a
 * position, a closure or the force of a point is computed by one thread; the forces on a block are
 * summed by one thread in the order of the points; energies are summed for parts of a fixed size,
 * and then over the parts in their order.
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

/* Let a number that several threads write be at least `value` */
static void raise_to(long long *number, long long value)
{
  long long present = __atomic_load_n(number, __ATOMIC_RELAXED);
  while (present < value && !__atomic_compare_exchange_n(number, &present, value, 0,
                                                         __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
}

INLINE void set_increments(dem_step *sim, double dt, long long begin, long long end, const int dim,
                           const int dof)
{
  double factor[MAX_DIM]; /* of a rate of closure or shear */
  long long too_deep = -1;
  for (int c = 0; c < dim; c++) factor[c] = dt / (sim->law_steps * sim->reduction[c]);
  for (long long i = begin; i < end; i++) {
    const double closure = sim->closure[i], offset = sim->closure_offset[i];
    const double limit =
        smaller(sim->max_overlap[sim->block_a[i]], sim->max_overlap[sim->block_b[i]]);
    if (sim->area[i] > 0.0 && closure > limit) too_deep = i;
    const double joint_closure = closure - (closure > 0.0 || offset < 0.0 ? offset : 0.0);
    double *d = sim->laws[sim->law[i]].d + dim * sim->place[i];
    compute_rates(sim, i, dim, dof);
    d[0] = (joint_closure - sim->delta[dim * i]) / sim->law_steps;
    for (int c = 1; c < dim; c++) d[c] = sim->rates[dim * i + c] * factor[c];
  }
  raise_to(&sim->too_deep, too_deep);
}

/* Rates of all contact points, and displacement increments of their joints, at their places for
 * their laws; notes a contact that overlaps too much */
EXPORT void dem_set_increments(dem_step *sim, double dt)
{
  sim->too_deep = -1;
  if (sim->dof == 3) set_increments(sim, dt, 0, sim->n_contacts, 2, 3);
  else set_increments(sim, dt, 0, sim->n_contacts, 3, 6);
}

/* The same for some contact points (m,) */
EXPORT void dem_set_increments_of(dem_step *sim, double dt, long long m, const long long *points)
{
  for (long long j = 0; j < m; j++) {
    const long long i = points[j];
    if (sim->dof == 3) set_increments(sim, dt, i, i + 1, 2, 3);
    else set_increments(sim, dt, i, i + 1, 3, 6);
  }
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

/* Note a block that is too fast for a step, before any has moved */
EXPORT void dem_check_speeds(dem_step *sim, double dt)
{
  const long long n = sim->n_blocks, dof = sim->dof;
  sim->too_fast = -1;
  for (long long i = 0; i < n; i++) {
    const double *v = sim->velocity + i;
    double speed = 0.0, spin = 0.0;
    for (long long j = 0; j < sim->dim; j++) speed += fabs(v[j * n]);
    for (long long j = sim->dim; j < dof; j++) spin += fabs(v[j * n]);
    speed += spin * sim->radius[i];
    const int is_slow = speed * dt < sim->max_skin_per_step * sim->skin[i]; /* false for NaN */
    if (sim->is_mobile[i] && !is_slow) sim->too_fast = i;
  }
  sim->too_deep = -1;
  sim->transferred = 0;
  sim->rebuild = 0;
}

/* Positions of blocks `begin` to `end`; notes whether contacts must be searched again */
INLINE void move_blocks(dem_step *sim, double dt, long long begin, long long end, const int dim,
                        const int dof)
{
  const long long n = sim->n_blocks;
  for (long long i = begin; i < end; i++) {
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
    if (distance > sim->max_skin_until_rebuild * sim->skin[i]) raise_to(&sim->rebuild, 1);
  }
}

/* ------------------------------------------------------------------------- after the law */

INLINE void read_joints(dem_step *sim, long long begin, long long end, const int dim)
{
  const long long k = sim->n_contacts;
  for (long long i = begin; i < end; i++) {
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
  if (sim->dim == 2) read_joints(sim, 0, sim->n_contacts, 2);
  else read_joints(sim, 0, sim->n_contacts, 3);
}

/* The same for some contact points (m,) */
EXPORT void dem_read_joints_of(dem_step *sim, long long m, const long long *points)
{
  for (long long j = 0; j < m; j++) {
    if (sim->dim == 2) read_joints(sim, points[j], points[j] + 1, 2);
    else read_joints(sim, points[j], points[j] + 1, 3);
  }
}

/* Let contacts (m,) have the results of the law and the first touch of the contacts `sources` (m,),
 * whose joints they continue with the same law */
EXPORT void dem_continue_joints(dem_step *sim, long long m, const long long *points,
                                const long long *sources)
{
  const long long dim = sim->dim, n_measures = DEM_MEASURES + dim;
  for (long long j = 0; j < m; j++) {
    const long long i = points[j], source = sources[j];
    const dem_law_joints *law = sim->laws + sim->law[source];
    const long long to = sim->place[i], from = sim->place[source];
    for (long long c = 0; c < dim; c++) {
      law->F[dim * to + c] = law->F[dim * from + c];
      sim->first_touch[dim * i + c] = sim->first_touch[dim * source + c];
    }
    for (long long c = 0; c < n_measures; c++)
      law->measures[n_measures * to + c] = law->measures[n_measures * from + c];
  }
  dem_read_joints_of(sim, m, points);
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

/* Forces (N) of the joint and the dashpots of contact i along closure and shears; returns its
 * stiffness (N/m) */
INLINE double find_point_forces(const dem_step *sim, long long i, const int dim)
{
  const long long k = sim->n_contacts;
  const double area = sim->area[i];
  const double stiffness = stiffness_bound(sim, i) * area;
  const double damage = sim->measures[DEM_DAMAGE * k + i];
  const double *rates = sim->rates + dim * i;
  double *joint = sim->point_forces + 2 * dim * i, *dashpot = joint + dim;
  for (int c = 0; c < dim; c++) {
    joint[c] = area * sim->traction[dim * i + c];
    dashpot[c] = 0.0;
  }
  const double inverse_mass =
      sim->inverse_mass[sim->block_a[i]] + sim->inverse_mass[sim->block_b[i]];
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
  return stiffness;
}

/* Forces of points `begin` to `end`; counts the joints that are stiffer than the time step allows */
INLINE void find_forces_of_points(dem_step *sim, long long begin, long long end, const int dim)
{
  long long stiffened = 0;
  for (long long i = begin; i < end; i++)
    stiffened += find_point_forces(sim, i, dim) > sim->checked_stiffness[i];
  __atomic_fetch_add(&sim->stiffened, stiffened, __ATOMIC_RELAXED);
}

/* Add the forces of contact i to those on one of its blocks. side: 0 for block a, 1 for b.
 *
 * The rows that turn motions into closure and shears turn their forces into forces on the motions. A
 * change of the area costs the stored energy. */
INLINE void add_point_forces(const dem_step *sim, long long i, int side, double *total,
                             double *damped, const int dim, const int dof)
{
  const double energy = sim->measures[DEM_STORED_ENERGY * sim->n_contacts + i];
  const double *row = sim->kinematics + dof * (2 * dim * i + side);
  const double *area_gradient = sim->area_gradient + dof * (2 * i + side);
  const double *joint = sim->point_forces + 2 * dim * i, *dashpot = joint + dim;
  for (int j = 0; j < dof; j++) {
    double of_joint = 0.0, of_dashpot = 0.0;
    for (int c = 0; c < dim; c++) {
      of_joint += joint[c] * row[2 * dof * c + j];
      of_dashpot += dashpot[c] * row[2 * dof * c + j];
    }
    total[j] -= of_joint + energy * area_gradient[j];
    damped[j] -= of_dashpot;
  }
}

/* Whether contact point i exerts no force: a point of a joint that is open, as most are where blocks
 * slide */
INLINE int exerts_nothing(const dem_step *sim, long long i, const int dim)
{
  const double *forces = sim->point_forces + 2 * dim * i;
  if (sim->measures[DEM_STORED_ENERGY * sim->n_contacts + i] != 0.0) return 0;
  for (int c = 0; c < 2 * dim; c++)
    if (forces[c] != 0.0) return 0;
  return 1;
}

/* Forces on blocks `begin` to `end`, whose points are summed in their order */
INLINE void find_forces_on_blocks(dem_step *sim, double dt, long long begin, long long end,
                                  const int dim, const int dof)
{
  const long long n = sim->n_blocks, size = dof * n;
  double *total = sim->forces, *damped = total + size, *driven = damped + size;
  for (long long at = dof * begin; at < dof * end; at++) {
    sim->previous_forces[at] = damped[at];
    sim->previous_forces[size + at] = driven[at];
    total[at] = damped[at] = driven[at] = 0.0;
  }
  const int is_all = begin == 0 && end == n;
  for (long long i = 0; i < sim->n_contacts; i++) {
    const long long a = sim->block_a[i], b = sim->block_b[i];
    if (exerts_nothing(sim, i, dim)) continue;
    if (is_all || (a >= begin && a < end))
      add_point_forces(sim, i, 0, total + dof * a, damped + dof * a, dim, dof);
    if (is_all || (b >= begin && b < end))
      add_point_forces(sim, i, 1, total + dof * b, damped + dof * b, dim, dof);
  }
  for (long long i = begin; i < end; i++)
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
    if (block < begin || block >= end) continue;
    const double change = sim->driven_velocity[i] - sim->motion[(dof + axis) * n + block];
    driven[at] = sim->inertia[at] * change / dt - total[at];
    total[at] += driven[at];
  }
}

INLINE void compute_forces(dem_step *sim, double dt, const int dim, const int dof)
{
  sim->stiffened = 0;
  find_forces_of_points(sim, 0, sim->n_contacts, dim);
  find_forces_on_blocks(sim, dt, 0, sim->n_blocks, dim, dof);
}

/* Forces on all blocks: joints, dashpots, weight and loads, and the reactions of drives that bring
 * their blocks to the prescribed velocities within dt. Counts the joints that are stiffer than the
 * time step allows. */
EXPORT void dem_compute_forces(dem_step *sim, double dt)
{
  if (sim->dof == 3) compute_forces(sim, dt, 2, 3);
  else compute_forces(sim, dt, 3, 6);
}

/* Sums of the energies of a part of the points */
static void sum_energies_of_points(dem_step *sim, long long part)
{
  const long long begin = part * DEM_POINTS_PER_PART, k = sim->n_contacts;
  const long long end = begin + DEM_POINTS_PER_PART < k ? begin + DEM_POINTS_PER_PART : k;
  double *sums = sim->point_sums + DEM_POINT_SUMS * part;
  double stored = 0.0, friction = 0.0;
  for (long long i = begin; i < end; i++) {
    /* a joint loses its traction at the end of the step, when it acts on the area of that time */
    const double area = sim->booked_area[i] = sim->area[i];
    const double dissipated = sim->measures[DEM_DISSIPATED_ENERGY * k + i];
    stored += area * sim->measures[DEM_STORED_ENERGY * k + i];
    friction += area * (dissipated - sim->booked_dissipation[i]);
    sim->booked_dissipation[i] = dissipated;
  }
  sums[DEM_ELASTIC_ENERGY] = stored;
  sums[DEM_FRICTION_WORK] = friction;
}

/* Sums of the energies of a part of the blocks */
INLINE void sum_energies_of_blocks(dem_step *sim, double dt, long long part, const int dof)
{
  const long long n = sim->n_blocks, begin = part * DEM_BLOCKS_PER_PART;
  const long long end = begin + DEM_BLOCKS_PER_PART < n ? begin + DEM_BLOCKS_PER_PART : n;
  double *sums = sim->block_sums + DEM_BLOCK_SUMS * part;
  for (int s = 0; s < DEM_BLOCK_SUMS; s++) sums[s] = 0.0;
  for (long long i = begin; i < end; i++) {
    double gravity_power = 0.0, load_power = 0.0;
    if (!sim->is_mobile[i]) continue;
    for (int j = 0; j < dof; j++) {
      const long long at = dof * i + j;
      const double v = sim->motion[(dof + j) * n + i];
      sums[DEM_TWICE_KINETIC] += v * (sim->inertia[at] * v + dt * sim->forces[at]);
      gravity_power += sim->gravity[at] * v;
      load_power += sim->loads[at] * v;
      for (int p = 0; p < 2; p++)
        sums[DEM_DASHPOT_POWER + p] +=
            (sim->previous_forces[dof * p * n + at] + sim->forces[dof * (p + 1) * n + at]) * v;
    }
    sums[DEM_GRAVITY_WORK] += dt * gravity_power;
    sums[DEM_LOAD_WORK] += dt * load_power;
    sums[DEM_ABSOLUTE_WORK] += fabs(dt * gravity_power) + fabs(dt * load_power);
  }
}

static long long parts_of(long long count, long long size) { return (count + size - 1) / size; }

/* Add the sums of a step to the energy balance: dem_demo/dynamics/energy_balance.py explains it */
EXPORT void dem_add_energies(dem_step *sim, double dt)
{
  double of_blocks[DEM_BLOCK_SUMS] = {0.0}, of_points[DEM_POINT_SUMS] = {0.0}, *energy = sim->energy;
  for (long long part = 0; part < parts_of(sim->n_blocks, DEM_BLOCKS_PER_PART); part++)
    for (int s = 0; s < DEM_BLOCK_SUMS; s++) of_blocks[s] += sim->block_sums[DEM_BLOCK_SUMS * part + s];
  for (long long part = 0; part < parts_of(sim->n_contacts, DEM_POINTS_PER_PART); part++)
    for (int s = 0; s < DEM_POINT_SUMS; s++) of_points[s] += sim->point_sums[DEM_POINT_SUMS * part + s];
  const double drive_work = 0.5 * dt * of_blocks[DEM_DRIVE_POWER];
  energy[DEM_KINETIC] = 0.5 * of_blocks[DEM_TWICE_KINETIC];
  energy[DEM_POTENTIAL] -= of_blocks[DEM_GRAVITY_WORK];
  energy[DEM_STORED] = of_points[DEM_ELASTIC_ENERGY];
  energy[DEM_FRICTION] += of_points[DEM_FRICTION_WORK];
  energy[DEM_DASHPOTS] -= 0.5 * dt * of_blocks[DEM_DASHPOT_POWER];
  energy[DEM_EXTERNAL_WORK] += drive_work + of_blocks[DEM_LOAD_WORK];
  energy[DEM_TURNOVER] += of_blocks[DEM_ABSOLUTE_WORK] + fabs(drive_work);
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

/* Results of the law, forces and energies of a part of the points */
INLINE void finish_points(dem_step *sim, long long part, const int dim)
{
  const long long begin = part * DEM_POINTS_PER_PART, k = sim->n_contacts;
  const long long end = begin + DEM_POINTS_PER_PART < k ? begin + DEM_POINTS_PER_PART : k;
  read_joints(sim, begin, end, dim);
  find_forces_of_points(sim, begin, end, dim);
  sum_energies_of_points(sim, part);
  /* a contact that has opened has no offset when it touches again */
  for (long long i = begin; i < end; i++)
    if (sim->closure[i] <= 0.0 && sim->closure_offset[i] > 0.0) sim->closure_offset[i] = 0.0;
}

/* Forces, energies and velocities of blocks `begin` to `end`, a number of whole parts */
INLINE void finish_blocks(dem_step *sim, double dt, long long begin, long long end, const int dim,
                          const int dof)
{
  const long long n = sim->n_blocks;
  if (begin >= end) return;
  find_forces_on_blocks(sim, dt, begin, end, dim, dof);
  for (long long part = begin / DEM_BLOCKS_PER_PART; part < parts_of(end, DEM_BLOCKS_PER_PART); part++)
    sum_energies_of_blocks(sim, dt, part, dof);
  for (long long i = begin; i < end; i++) {
    if (!sim->is_mobile[i]) continue;
    for (int j = 0; j < dof; j++)
      sim->velocity[j * n + i] += dt * sim->forces[dof * i + j] / sim->inertia[dof * i + j];
    if (dof == 6) add_gyroscopic_moment(sim, i, dt);
  }
  for (long long i = 0; i < sim->n_driven && dof == 6; i++) { /* drives bear gyroscopic moments */
    const long long block = sim->driven_block[i];
    if (block >= begin && block < end)
      sim->velocity[sim->driven_axis[i] * n + block] = sim->driven_velocity[i];
  }
}

/* ------------------------------------------------------------------------------ phases */

/* Number of the parts of a phase */
static long long count_parts(const dem_step *sim, long long phase)
{
  switch (phase) {
  case DEM_MOVE: return parts_of(sim->n_blocks, DEM_BLOCKS_PER_PART);
  case DEM_FINISH_BLOCKS: return sim->n_ranges;
  default: return parts_of(sim->n_contacts, DEM_POINTS_PER_PART);
  }
}

INLINE void run_part(dem_step *sim, double dt, long long phase, long long part, const int dim,
                     const int dof)
{
  const long long size = phase == DEM_MOVE ? DEM_BLOCKS_PER_PART : DEM_POINTS_PER_PART;
  const long long count = phase == DEM_MOVE ? sim->n_blocks : sim->n_contacts;
  const long long begin = part * size, end = begin + size < count ? begin + size : count;
  switch (phase) {
  case DEM_MOVE: move_blocks(sim, dt, begin, end, dim, dof); break;
  case DEM_UPDATE:
    if (sim->has_parts && sim->update_geometry(sim->geometry, begin, end)) raise_to(&sim->rebuild, 1);
    set_increments(sim, dt, begin, end, dim, dof);
    break;
  case DEM_FINISH_POINTS: finish_points(sim, part, dim); break;
  case DEM_FINISH_BLOCKS:
    finish_blocks(sim, dt, sim->first_block[part], sim->first_block[part + 1], dim, dof);
    break;
  }
}

/* Run a phase of a step. Several threads may call this for the same phase: each takes the next part
 * until none is left. `next_part` must be 0 before. */
EXPORT void dem_run_phase(dem_step *sim, double dt, long long phase)
{
  const long long parts = count_parts(sim, phase);
  for (long long part;
       (part = __atomic_fetch_add(&sim->next_part, 1, __ATOMIC_RELAXED)) < parts;) {
    if (sim->dof == 3) run_part(sim, dt, phase, part, 2, 3);
    else run_part(sim, dt, phase, part, 3, 6);
  }
}

static void run_phase_alone(dem_step *sim, double dt, long long phase)
{
  sim->next_part = 0;
  dem_run_phase(sim, dt, phase);
}

/* Move the blocks, update their contact points, and set the increments of the law.
 *
 * Notes a block that is too fast, before any has moved, and whether contacts must be searched
 * again. */
EXPORT void dem_move_blocks(dem_step *sim, double dt)
{
  dem_check_speeds(sim, dt);
  if (sim->too_fast >= 0) return;
  run_phase_alone(sim, dt, DEM_MOVE);
  if (!sim->has_parts) sim->transferred = sim->update_geometry(sim->geometry, 0, sim->n_contacts);
  for (long long i = 0; i < sim->n_blocks && sim->transferred; i++)
    sim->rebuild |= sim->needs_rebuild[i];
  run_phase_alone(sim, dt, DEM_UPDATE);
}

/* Results of the law, forces, energies, and the velocities of the next step */
EXPORT void dem_finish_step(dem_step *sim, double dt)
{
  sim->stiffened = 0;
  run_phase_alone(sim, dt, DEM_FINISH_POINTS);
  run_phase_alone(sim, dt, DEM_FINISH_BLOCKS);
  dem_add_energies(sim, dt);
}
