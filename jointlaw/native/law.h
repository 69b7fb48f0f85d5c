/* law.h: one step of a rock joint and the measures of its state, written for the lanes of lanes.h.
 *
 * Symbols and order of the step are those of docs/theory-incremental.md and kernels/asperities.py.
 * A joint has M facets. Each has the effective closure y and D cells, which are spring-sliders in
 * parallel (of the kind of Iwan's model) that engage at different depths zeta. Phi is the
 * first-loading curve of a facet, G the part of Phi that a cell carries, kappa = dG/dy its
 * stiffness, and q = (q_s, q_t) the shear force of its slider times lam.
 *
 * Rows of a state, in this order:
 *   delta (dim)          displacement from the interlocked (mated) position, m
 *   dissipated energy    J/m2
 *   q_s, q_t (M D each)  of all cells of all facets; as floats in M D rows: sliders.h
 *   z (M), plastic work  if asperities yield: plastic indentation of every facet (m), J/m2
 *   lost slopes          if asperities degrade: 1 - slope retention
 *   shear work           if it degrades asperities, J/m2
 *   peak contact stress  if it degrades asperities: the largest so far, Pa
 *   rows of elements.h   bond or Coulomb's law
 * A batch stores behind them Phi and Phi' of every facet (M each), and, if asperities yield, the same
 * at z: batch.c.
 *
 * One text serves all cases. A step is compiled for several kinds (jl_step_kind), whose constants
 * remove the parts that a law does not need; the list is at the end of the file. All lanes of a
 * vector take all branches, and results are selected by masks. Where a quotient is undefined, a mask
 * discards it, or the divisor is replaced by 1.
 *
 * Every expression is written so that rounding keeps the sign of the dissipation: a sum of terms
 * that are each >= 0. The compiler must not fuse or reorder operations (-ffp-contract=off), so that
 * all compilers, vector widths and hosts give the same bits. The last digit of expm1 and pow depends
 * on the C library; exp and log are not used, because zig links versions of its own. */

#include "sliders.h"

typedef struct { /* constants of a step, which let the compiler omit unused parts */
  int dim, yields, interlock_decays, degrades, degrades_by_stress, tangent, track_dissipation;
  int curve_stored; /* whether Phi and Phi' are stored behind the state */
} jl_step_kind;

typedef struct { /* in the plane of a joint: o, offset over the mating length; w^2 = 1 - |o|^2 */
  jl_joint_real o[2], w;
} jl_offset;

typedef struct {                /* a joint in a step */
  jl_joint_real p[3];           /* increment */
  jl_joint_real from[3], to[3]; /* closure and in-plane displacement before and after */
  jl_offset start, middle, end;
  /* slope retention: before the step; after degradation by work; at mid-step and at the end, after
   * degradation by stress */
  jl_joint_real slopes0, slopes1, slopes_middle, slopes_end;
  jl_joint_real retention_rate; /* derivative of slopes_end by the contact stress at fixed slopes */
#ifdef JLAW_FLOAT_SLIDERS
  jl_joint_bits rounding_key;
#endif
} jl_joint_step;

typedef struct { /* planes of facets: slope along the azimuth e and across it, in axes (1, e) */
  jl_real x, z;  /* offset over the mating length along e and across */
  jl_real along, across;
  jl_real m2, N2;        /* m^2 = 1 + along^2, N^2 = m^2 + across^2 */
  jl_real inv_m, inv_mN; /* 1/m, 1/(m N) */
  jl_real gamma;         /* c1 N */
} jl_plane;

typedef struct {                  /* facets in a step; 0: before, 1: after */
  jl_real y0, y1, f0, f1, k0, k1; /* y, Phi, Phi' */
  jl_real dk1, es, et;            /* Phi'' after; increment in the plane of the facet */
  jl_plane middle, end;
  jl_real yw, fw, kw;                 /* y, Phi, Phi' before degradation */
  jl_real limit2, degradation_loss;   /* after it: upper limit of (q/G)^2; dissipation */
  jl_real d0, de, dz;                 /* increment: closure, along the azimuth and across it */
  jl_real dy, inv_dy;                 /* y1 - y0 and its reciprocal */
  jl_mask is_small;                   /* |dy| is too small for a difference quotient */
  jl_real z0, z1, fz0, fz1, kz0, kz1; /* plastic indentation; Phi and Phi' there */
  jl_real qs, qt, loss, vs, vt, bss, bst, btt; /* sums over the cells: q, loss, v and B of C */
  jl_real ws, wt, kappa_sum;                   /* v of the softening by z1; sum of kappa */
  jl_real us, ut;           /* sums over the cells of q before the step, after degradation */
  jl_real gs, gt, strength; /* derivative of q by log(gamma); mu lam A gamma */
#ifdef JLAW_FLOAT_SLIDERS
  jl_bits noise; /* random bits that round q of the present cell */
#endif
} jl_facet_step;

typedef struct {                   /* the slider of one cell of facets in a step */
  jl_real G0, G1, k0, k1, kz1;     /* G and kappa before and after; kappa at z1 */
  jl_real growth;                  /* of G, before springs yield at the new y */
  jl_real strength, limit, chord;  /* mu lam A; friction limit of q; chord of G over the step */
  jl_real ts, tt;                  /* trial force */
  jl_real inv_size, return_factor; /* 1/|trial force|; factor that returns it to the limit */
  jl_real q2, trial2;              /* squares of q before the step and of the trial force */
  jl_mask slips;
} jl_cell_step;

typedef struct { /* sums over facets */
  jl_real F[3], C[9], loss;
  jl_real plastic_work;
  jl_real degradation_normal, degradation_sliders; /* energy dissipated by degradation */
  jl_real shear0[2];                               /* shear stress before the step, after it */
  jl_real slope_energy_rate; /* of the normal springs, by the retention: before plus after */
  jl_real by_retention[3];   /* derivative of F by slopes_end */
  jl_real contact_rate[3];   /* derivative of the contact stress by d, at fixed slopes */
} jl_step_sums;

/* Rows of a state: the first row of each part, and their number */
JL_INLINE int jl_slider_row(const jlaw_law *law) { return law->dim + 1; }
JL_INLINE int jl_plastic_row(const jlaw_law *law)
{
  return law->dim + 1 + JL_NUMBERS_PER_SLIDER * law->facets * law->cells;
}
JL_INLINE int jl_degradation_row(const jlaw_law *law)
{
  return jl_plastic_row(law) + (law->yields ? law->facets + 1 : 0);
}
JL_INLINE int jl_slopes_change(const jlaw_law *law)
{
  return law->degrades || law->degrades_by_stress;
}
JL_INLINE int jl_peak_stress_row(const jlaw_law *law)
{
  return jl_degradation_row(law) + 1 + law->degrades;
}
JL_INLINE int jl_element_row(const jlaw_law *law)
{
  return jl_degradation_row(law) + jl_slopes_change(law) + law->degrades + law->degrades_by_stress;
}
JL_INLINE int jl_state_rows(const jlaw_law *law)
{
  return jl_element_row(law) + jl_element_rows(law);
}

/* Tables of facets from index `at` on, and of the first cell of each */
JL_INLINE const double *jl_facet_table(const jlaw_law *law, int at)
{
  const int lane = at % JLAW_FACET_LANES;
  return law->facet + (size_t) (at - lane) * JLAW_COLUMNS + lane;
}
JL_INLINE const double *jl_cell_table(const jlaw_law *law, int at)
{
  const int lane = at % JLAW_FACET_LANES;
  return law->depth + (size_t) (at - lane) * (size_t) law->cells * JLAW_ROWS + lane;
}

/* -------------------------------------------------------------- first-loading curve */

/* Replace effective closures below JLAW_UNDERFLOW by zero: their powers and squares underflow */
JL_INLINE jl_real jl_flush_underflow(jl_real y)
{
  return jl_select_or_zero(jl_abs(y) >= JLAW_UNDERFLOW, y);
}

typedef struct { /* position x in piece i of the tables of the first-loading curve; v = sqrt(y) */
  jl_real y, v, r, x;
  jl_int i;
} jl_curve_point;

JL_INLINE jl_curve_point jl_locate_on_curve(const jlaw_law *law, jl_real y)
{
  const double pieces = law->pieces;
  jl_curve_point at;
  at.y = jl_select_or_zero(y > 0.0, y);
  at.v = jl_sqrt(at.y);
  at.r = 1.0 / (at.v + law->curve_scale);
  at.x = at.v * at.r * pieces;
  at.i = jl_to_int(jl_min(at.x, jl_broadcast(pieces - 1.0)));
  at.x = at.x - jl_to_real(at.i);
  return at;
}

/* x^p, zero at x = 0 */
JL_INLINE jl_real jl_power(jl_real x, double p)
{
  for (int l = 0; l < JL_W; l++) JL_LANE(x, l) = JL_LANE(x, l) > 0.0 ? pow(JL_LANE(x, l), p) : 0.0;
  return x;
}

/* y^eta, zero at y = 0 */
JL_INLINE jl_real jl_y_to_eta(const jlaw_law *law, const jl_curve_point *at)
{
  if (law->eta == 0.0) return jl_select_or_zero(at->y > 0.0, jl_broadcast(1.0));
  return law->eta == 0.5 ? at->v : jl_power(at->y, law->eta);
}

/* Phi and Phi' at y, and Phi'' unless dk is NULL; zero where y <= 0 */
JL_INLINE void jl_first_loading_curve(const jlaw_law *law, jl_real y, jl_real *f, jl_real *k,
                                      jl_real *dk)
{
  const double n = law->pieces, eta = law->eta;
  const jl_curve_point at = jl_locate_on_curve(law, y);
  const jl_real x = at.x, ts = at.v * at.r * at.r * law->curve_scale; /* t (1 - t) */
  jl_real c[4];
  jl_gather(law->curve, at.i, c);
  jl_real S = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
  jl_real DS = 0.5 * n * ts * (c[1] + x * (2.0 * c[2] + x * (3.0 * c[3])));
  jl_real DDS = jl_broadcast(0.0);
  if (dk)
    DDS = 0.25 * n * n * ts * ts * (2.0 * c[2] + x * (6.0 * c[3]))
          + 0.5 * (law->curve_scale - at.v) * at.r * DS;
  if (law->curve_exponent > 0.0) {
    const jl_real w = at.y / (at.y + law->curve_scale * law->curve_scale),
                  growth = law->curve_exponent * (1.0 - w);
    const jl_real factor = jl_power(w, law->curve_exponent); /* S is tabulated over w^p */
    DDS = factor * (DDS + 2.0 * growth * DS + growth * (growth - w) * S);
    DS = factor * (DS + growth * S);
    S = factor * S;
  }
  const jl_real power = jl_y_to_eta(law, &at);
  *f = power * at.y * S;
  *k = power * ((1.0 + eta) * S + DS);
  if (dk)
    *dk =
        power / jl_select(y > 0.0, y, 1.0) * (eta * (1.0 + eta) * S + (1.0 + 2.0 * eta) * DS + DDS);
}

/* Psi, the integral of Phi, at y */
JL_INLINE jl_real jl_first_loading_energy(const jlaw_law *law, jl_real y)
{
  const jl_curve_point at = jl_locate_on_curve(law, y);
  jl_real c[4];
  jl_gather(law->energy, at.i, c);
  jl_real T = c[0] + at.x * (c[1] + at.x * (c[2] + at.x * c[3]));
  if (law->curve_exponent > 0.0)
    T = T * jl_power(at.y / (at.y + law->curve_scale * law->curve_scale), law->curve_exponent);
  return jl_y_to_eta(law, &at) * at.y * at.y * T;
}

/* G of a cell at y, its part of Phi, and kappa = dG/dy; asperities elastic. f, k: Phi and Phi' */
JL_INLINE void jl_elastic_cell(const double *cell, jl_real y, jl_real f, jl_real k, jl_real *G,
                               jl_real *kappa)
{
  const jl_real from_start = y - jl_column(cell, JLAW_ZETA_START);
  const jl_real from_end = y - jl_column(cell, JLAW_ZETA_END);
  const jl_facet_real kappa_end = jl_column(cell, JLAW_KAPPA_END);
  const jl_facet_real k_start = jl_column(cell, JLAW_DPHI_START);
  const jl_real stiffness = jl_select(from_end > 0.0, kappa_end, k - k_start);
  const jl_real force =
      jl_select(from_end > 0.0, jl_column(cell, JLAW_G_END) + kappa_end * from_end,
                f - jl_column(cell, JLAW_PHI_START) - k_start * from_start);
  *kappa = jl_select_or_zero(from_start > 0.0, jl_max(stiffness, jl_broadcast(0.0)));
  *G = jl_max(jl_min(force, *kappa * from_start), jl_broadcast(0.0));
}

/* ------------------------------------------ elastic-perfectly plastic asperities */

/* Subtract from G of a cell its value H at the plastic indentation z: "Yielding" */
JL_INLINE void jl_subtract_plastic(jl_real y, jl_real z, jl_real H, jl_real *G, jl_real *kappa)
{
  const jl_real elastic = y - z;
  *kappa = jl_select_or_zero(elastic > 0.0, *kappa);
  *G = jl_max(jl_min(*G - H, *kappa * elastic), jl_broadcast(0.0));
}

/* G and kappa of a cell at y, with plastic indentation z if asperities yield */
JL_INLINE void jl_evaluate_cell(const double *cell, jl_real y, jl_real f, jl_real k, jl_real z,
                                jl_real fz, jl_real kz, int yields, jl_real *G, jl_real *kappa)
{
  jl_real H, kappa_z;
  jl_elastic_cell(cell, y, f, k, G, kappa);
  if (!yields) return;
  jl_elastic_cell(cell, z, fz, kz, &H, &kappa_z);
  jl_subtract_plastic(y, z, H, G, kappa);
}

/* Subtract from Phi its value fz at the plastic indentation z */
JL_INLINE void jl_subtract_plastic_force(jl_real y, jl_real z, jl_real fz, jl_real *f, jl_real *k)
{
  *f = jl_select_or_zero(y > z, jl_max(*f - fz, jl_broadcast(0.0)));
  *k = jl_select_or_zero(y > z, *k);
}

/* Plastic indentation of facets before and after the step, and the first-loading curve there.
 * curve_row: row of the stored curve, 0 if it is not stored */
JL_INLINE void jl_update_plastic_indentation(const jlaw_law *law, const double *f, jl_states n,
                                             int curve_row, int at, int count,
                                             const jl_joint_step *m, jl_facet_step *o)
{
  const int M = law->facets, z_row = jl_plastic_row(law);
  jl_real y = o->y1;
  if (law->interlock_decays) /* a facet and the opposite one have the same indentation */
    y = jl_max(y, 2.0 * jl_column(f, JLAW_M) * m->to[0] - y);
  o->z0 = jl_load(n, z_row + at, 1, count);
  o->z1 = jl_max(y - jl_column(f, JLAW_YIELD_CLOSURE), o->z0);
  if (curve_row) {
    o->fz0 = jl_load(n, curve_row + 2 * M + at, 1, count);
    o->kz0 = jl_load(n, curve_row + 3 * M + at, 1, count);
  } else jl_first_loading_curve(law, o->z0, &o->fz0, &o->kz0, (jl_real *) 0);
  o->fz1 = o->fz0, o->kz1 = o->kz0;
  if (!jl_any(o->z1 > o->z0)) return;
  jl_first_loading_curve(law, o->z1, &o->fz1, &o->kz1, (jl_real *) 0);
  jl_store(n, z_row + at, 1, count, o->z1);
  if (curve_row) {
    jl_store(n, curve_row + 2 * M + at, 1, count, o->fz1);
    jl_store(n, curve_row + 3 * M + at, 1, count, o->kz1);
  }
}

/* Whether the closure of facets themselves sets their indentation; else the closure of the
 * opposite facet does. Both are equal, but for rounding, in facets at a right angle to the shear. */
JL_INLINE jl_mask jl_sets_own_indentation(const double *f, const jl_facet_step *o)
{
  return o->y1 - jl_column(f, JLAW_YIELD_CLOSURE)
         >= o->z1 - JLAW_ROUNDING_TOLERANCE * jl_abs(o->y1);
}

/* Plastic work of facets over A c1: exact if they set their own indentation, else by the mean */
JL_INLINE jl_real jl_plastic_work(const double *f, const jl_facet_step *o)
{
  const jl_facet_real y_p = jl_column(f, JLAW_YIELD_CLOSURE);
  const jl_real c0 = jl_min(jl_max(o->y0 - o->z0, jl_broadcast(0.0)), jl_broadcast(y_p));
  const jl_real c1 = jl_min(jl_max(o->y1 - o->z1, jl_broadcast(0.0)), jl_broadcast(y_p));
  return jl_select(jl_sets_own_indentation(f, o), jl_broadcast(y_p), 0.5 * (c0 + c1))
         * (o->fz1 - o->fz0);
}

/* ---------------------------------------------------------- decay of the interlock */

/* Offset over the mating length at the in-plane displacement (p0, p1): "Mating" */
JL_INLINE jl_offset jl_offset_at(const jlaw_law *law, jl_joint_real p0, jl_joint_real p1)
{
  jl_offset at;
  p0 = p0 / law->mating_length;
  p1 = p1 / law->mating_length;
  at.w = 1.0 / jl_sqrt_joint(1.0 + (p0 * p0 + p1 * p1));
  at.o[0] = at.w * p0;
  at.o[1] = at.w * p1;
  return at;
}

/* Effective closure of facets. slopes: slope retention */
JL_INLINE jl_real jl_effective_closure(const jlaw_law *law, const double *f, jl_joint_real closure,
                                       const jl_offset *at, jl_joint_real slopes)
{
  const jl_real climb = jl_column(f, JLAW_M + 1) * at->o[0] + jl_column(f, JLAW_M + 2) * at->o[1];
  return closure + slopes * law->mating_length * climb;
}

/* Planes of facets at this offset and slope retention */
JL_INLINE jl_plane jl_plane_at(const double *f, const jl_offset *at, jl_joint_real slopes)
{
  jl_plane s;
  s.x = jl_column(f, JLAW_E) * at->o[0] + jl_column(f, JLAW_E + 1) * at->o[1];
  s.z = jl_column(f, JLAW_E) * at->o[1] - jl_column(f, JLAW_E + 1) * at->o[0];
  const jl_real tan_theta = slopes * at->w * jl_column(f, JLAW_TAN_THETA);
  s.along = tan_theta * (1.0 - s.x * s.x);
  s.across = -tan_theta * s.x * s.z;
  s.m2 = 1.0 + s.along * s.along;
  s.N2 = s.m2 + s.across * s.across;
  const jl_real m = jl_sqrt(s.m2), N = jl_sqrt(s.N2);
  s.inv_mN = 1.0 / (m * N);
  s.inv_m = N * s.inv_mN;
  s.gamma = jl_column(f, JLAW_COS_THETA) * N;
  return s;
}

/* Rotate a vector from components along e and across it to the axes of the joint */
JL_INLINE void jl_to_joint_axes(const double *f, jl_real *along, jl_real *across)
{
  const jl_real v1 = jl_column(f, JLAW_E) * *along - jl_column(f, JLAW_E + 1) * *across;
  *across = jl_column(f, JLAW_E + 1) * *along + jl_column(f, JLAW_E) * *across;
  *along = v1;
}

/* Derivatives of the slopes with respect to the displacement, along e (e) and across it (z): ee, ez,
 * zz. w: as in jl_offset; slopes: slope retention */
JL_INLINE void jl_slope_derivatives(const jlaw_law *law, const double *f, const jl_plane *s,
                                    jl_joint_real w, jl_joint_real slopes, jl_real h[3])
{
  const jl_real scale = -(slopes * w * w / law->mating_length) * jl_column(f, JLAW_TAN_THETA);
  h[0] = scale * (3.0 * s->x * (1.0 - s->x * s->x));
  h[1] = scale * (s->z * (1.0 - 3.0 * s->x * s->x));
  h[2] = scale * (s->x * (1.0 - 3.0 * s->z * s->z));
}

/* Slopes along e and across it at a slope retention of 1. w: as in jl_offset */
JL_INLINE void jl_full_slopes(const double *f, const jl_plane *s, jl_joint_real w, jl_real full[2])
{
  const jl_real tan_theta = w * jl_column(f, JLAW_TAN_THETA);
  full[0] = tan_theta * (1.0 - s->x * s->x);
  full[1] = -tan_theta * s->x * s->z;
}

/* Project the increment on the plane of facets at mid-step */
JL_INLINE void jl_project_increment(const double *f, const jl_joint_step *m, jl_facet_step *o)
{
  const jl_plane *s = &o->middle;
  const jl_real p1 = jl_broadcast(0.0) + m->p[1], p2 = jl_broadcast(0.0) + m->p[2];
  o->d0 = jl_broadcast(0.0) + m->p[0];
  o->de = jl_column(f, JLAW_E) * p1 + jl_column(f, JLAW_E + 1) * p2;
  o->dz = jl_column(f, JLAW_E) * p2 - jl_column(f, JLAW_E + 1) * p1;
  o->es = (o->de - s->along * o->d0) * s->inv_m;
  o->et = (s->m2 * o->dz - s->across * (o->d0 + s->along * o->de)) * s->inv_mN;
}

/* Traction of facets in a plane: A Phi n and the sliders, in axes (1, e), rotated to the joint's */
JL_INLINE void jl_facet_traction(const jlaw_law *law, const double *f, const jl_plane *s,
                                 jl_real force, jl_real qs, jl_real qt, jl_real F[3])
{
  const jl_real n = jl_column(f, JLAW_ENERGY_FACTOR) * force;
  qs = law->stiffness_ratio * s->inv_m * qs;
  qt = law->stiffness_ratio * s->inv_mN * qt;
  F[0] = n - (s->along * qs + s->across * qt);
  F[1] = n * s->along + (qs - s->along * s->across * qt);
  F[2] = n * s->across + s->m2 * qt;
  jl_to_joint_axes(f, &F[1], &F[2]);
}

/* Add the traction of facets with this normal force over A, and sums q of slider forces over lam, to F
 * (dim). s: the planes of the facets, if the interlock decays */
JL_INLINE void jl_add_facet_traction(const jlaw_law *law, const double *f, const jl_plane *s,
                                     jl_real force, jl_real qs, jl_real qt, int dim,
                                     int interlock_decays, jl_real F[3])
{
  if (interlock_decays) {
    jl_real traction[3];
    jl_facet_traction(law, f, s, force, qs, qt, traction);
    for (int i = 0; i < dim; i++) F[i] += traction[i];
    return;
  }
  const jl_real normal = jl_column(f, JLAW_A) * force;
  qs = law->stiffness_ratio * qs, qt = law->stiffness_ratio * qt;
  for (int i = 0; i < dim; i++) {
    const jl_real normal_i = jl_column(f, JLAW_N + i) * normal;
    F[i] += normal_i + (jl_column(f, JLAW_S + i) * qs + jl_column(f, JLAW_T + i) * qt);
  }
}

/* ------------------------------------------------------------- asperity degradation */

/* Weight w of the factor u in the retention, s + w u, at this shear work */
JL_INLINE double jl_stress_weight(const jlaw_law *law, double work)
{
  return (1.0 - law->slope_residual) * (1.0 + expm1(-work / law->slope_wear));
}

/* Slope retention before the step and after degradation by the shear work done so far */
JL_INLINE void jl_degrade_slopes(const jlaw_law *law, jl_states n, jl_joint_step *m, jl_step_kind k)
{
  const int row = jl_degradation_row(law);
  jl_joint_real lost = jl_load_joint(n, row);
  const jl_joint_real work = jl_load_joint(n, row + 1);
  const jl_joint_real peak =
      k.degrades_by_stress ? jl_load_joint(n, jl_peak_stress_row(law)) : jl_broadcast_joint(0.0);
  m->slopes0 = 1.0 - lost;
  for (int l = 0; l < JL_JOINTS_PER_PASS; l++) {
    double loss = (law->slope_residual - 1.0) * expm1(-JL_JOINT(work, l) / law->slope_wear);
    if (k.degrades_by_stress) {
      const double u = 1.0 / (1.0 + JL_JOINT(peak, l) / law->degradation_stress);
      loss += jl_stress_weight(law, JL_JOINT(work, l)) * (1.0 - u);
    }
    JL_JOINT(lost, l) = loss > JL_JOINT(lost, l) ? loss : JL_JOINT(lost, l);
  }
  m->slopes1 = 1.0 - lost;
  jl_store_joint(n, row, lost);
}

/* Climb x of facets at full slopes: y = closure + slopes x */
JL_INLINE jl_real jl_climb(const jlaw_law *law, const double *f, const jl_offset *at)
{
  return law->mating_length
         * (jl_column(f, JLAW_M + 1) * at->o[0] + jl_column(f, JLAW_M + 2) * at->o[1]);
}

/* Contact stress N at the end of the step, the stress that the normal forces of the asperities bear,
 * with this slope retention, and its derivative by the retention */
JL_INLINE void jl_contact_stress(const jlaw_law *law, jl_states n, const jl_joint_step *m,
                                 jl_joint_real slopes, jl_step_kind k, jl_joint_real *stress,
                                 jl_joint_real *rate)
{
  const int M = law->facets;
  struct {
    jl_real stress, rate;
  } sum[JL_PARTIAL_SUMS];
  for (int i = 0; i < JL_PARTIAL_SUMS; i++) sum[i].stress = sum[i].rate = jl_broadcast(0.0);
  for (int at = 0; at < M; at += JL_FACETS_PER_PASS) {
    const int i = at / JL_FACETS_PER_PASS % JL_PARTIAL_SUMS,
              count = M - at < JL_FACETS_PER_PASS ? M - at : JL_FACETS_PER_PASS;
    const double *f = jl_facet_table(law, at);
    const jl_real x = jl_climb(law, f, &m->end), y = m->to[0] + slopes * x;
    if (!jl_any(y > 0.0)) continue;
    jl_real force, slope;
    jl_first_loading_curve(law, jl_flush_underflow(y), &force, &slope, (jl_real *) 0);
    jl_real growth = slope * x;
    if (k.yields) {
      const jl_facet_real y_p = jl_column(f, JLAW_YIELD_CLOSURE);
      const jl_real z0 = jl_load(n, jl_plastic_row(law) + at, 1, count);
      const jl_real opposite = 2.0 * jl_column(f, JLAW_M) * m->to[0] - y;
      const jl_real z = jl_max(jl_max(y, opposite) - y_p, z0);
      const jl_mask own = y - y_p >= z - JLAW_ROUNDING_TOLERANCE * jl_abs(y);
      jl_real fz, kz;
      jl_first_loading_curve(law, z, &fz, &kz, (jl_real *) 0);
      jl_subtract_plastic_force(y, z, fz, &force, &slope);
      growth = slope * x - jl_select_or_zero(z > z0, kz * jl_select(own, x, -x));
      growth = jl_select_or_zero(force > 0.0, growth);
    }
    sum[i].stress += jl_column(f, JLAW_ENERGY_FACTOR) * force;
    sum[i].rate += jl_column(f, JLAW_ENERGY_FACTOR) * growth;
  }
  *stress = jl_total(sum, stress);
  *rate = jl_total(sum, rate);
}

typedef struct { /* search for the factor u of the slopes of one joint */
  double u, low, high, weight;
  int exceeds, searches; /* whether the contact stress is the largest so far; whether to go on */
} jl_stress_search;

/* Next u by Newton's method, or by bisection: u N(s + w u) - S (1 - u) = 0 */
JL_INLINE void jl_search_stress_factor(double S, double stress, double rate, jl_stress_search *at)
{
  const double u = at->u, excess = u * stress - S * (1.0 - u);
  if (excess > 0.0) at->high = u;
  else at->low = u;
  double next = u - excess / (stress + u * at->weight * rate + S);
  if (!(next > at->low && next < at->high)) next = 0.5 * (at->low + at->high);
  at->searches = at->searches && fabs(next - u) > JLAW_FACTOR_CONVERGENCE * u;
  if (at->searches) at->u = next;
}

/* Slope retention at the end of the step, which belongs to the contact stress there: "Asperity
 * degradation by stress" */
JL_INLINE void jl_degrade_by_stress(const jlaw_law *law, jl_states n, jl_joint_step *m,
                                    jl_step_kind k)
{
  const double S = law->degradation_stress;
  const int row = jl_degradation_row(law);
  jl_joint_real lost = jl_load_joint(n, row), peak = jl_load_joint(n, jl_peak_stress_row(law));
  const jl_joint_real lost1 = lost,
                      work = k.degrades ? jl_load_joint(n, row + 1) : jl_broadcast_joint(0.0);
  jl_joint_real stress, rate;
  jl_stress_search search[JL_JOINTS_PER_PASS];
  for (int i = 0;; i++) { /* one place of the call, because compilers inline every one */
    jl_contact_stress(law, n, m, 1.0 - lost, k, &stress, &rate);
    int searches = 0;
    for (int l = 0; l < JL_JOINTS_PER_PASS; l++) {
      jl_stress_search *at = search + l;
      if (i == 0) {
        at->exceeds = at->searches = JL_JOINT(stress, l) > JL_JOINT(peak, l);
        at->u = at->high = 1.0 / (1.0 + JL_JOINT(peak, l) / S);
        at->low = 0.0;
        at->weight = at->exceeds ? jl_stress_weight(law, JL_JOINT(work, l)) : 0.0;
      }
      searches = searches || at->searches;
    }
    if (!searches || i == JLAW_MAX_FACTOR_ITERATIONS) break;
    for (int l = 0; l < JL_JOINTS_PER_PASS; l++) {
      jl_stress_search *at = search + l;
      if (!at->exceeds) continue;
      jl_search_stress_factor(S, JL_JOINT(stress, l), JL_JOINT(rate, l), at);
      const double loss = 1.0 - law->slope_residual - at->weight * at->u;
      JL_JOINT(lost, l) = loss > JL_JOINT(lost1, l) ? loss : JL_JOINT(lost1, l);
    }
  }
  for (int l = 0; l < JL_JOINTS_PER_PASS; l++) {
    const jl_stress_search *at = search + l;
    const double u = at->u;
    if (at->exceeds && JL_JOINT(stress, l) > JL_JOINT(peak, l))
      JL_JOINT(peak, l) = JL_JOINT(stress, l);
    if (JL_JOINT(lost, l) > JL_JOINT(lost1, l))
      JL_JOINT(m->retention_rate, l) = -at->weight / (S / (u * u) + at->weight * JL_JOINT(rate, l));
  }
  m->slopes_end = 1.0 - lost;
  m->slopes_middle = 0.5 * (m->slopes1 + m->slopes_end);
  jl_store_joint(n, row, lost);
  jl_store_joint(n, jl_peak_stress_row(law), peak);
}

/* Slider forces after degradation: springs that disengage release their force, and the friction limit
 * bounds the rest. A single division serves all quotients; stiffnesses and forces whose squares are
 * below JLAW_MIN_STIFFNESS_PRODUCT count as zero. */
JL_INLINE void jl_degrade_sliders(const double *cell, jl_facet_step *o, const jl_cell_step *c,
                                  jl_real *qs, jl_real *qt, jl_step_kind k)
{
  jl_real G, kappa;
  jl_evaluate_cell(cell, o->yw, o->fw, o->kw, o->z0, o->fz0, o->kz0, k.yields, &G, &kappa);
  const jl_real q2 = *qs * *qs + *qt * *qt, limit2 = o->limit2 * (c->G0 * c->G0);
  const jl_mask stiff0 = kappa * kappa > JLAW_MIN_STIFFNESS_PRODUCT,
                stiff1 = c->k0 * c->k0 > JLAW_MIN_STIFFNESS_PRODUCT;
  const jl_real a = jl_select(stiff0, kappa, 1.0), b = jl_select(stiff1, c->k0, 1.0);
  const jl_real Q = jl_select(q2 > JLAW_MIN_STIFFNESS_PRODUCT, q2, 1.0);
  const jl_real r = 1.0 / (a * b * Q);
  const jl_real compliance0 = jl_select_or_zero(stiff0, b * Q * r);
  const jl_real compliance1 = jl_select_or_zero(stiff1, a * Q * r);
  jl_real factor = jl_select(kappa > c->k0, c->k0 * compliance0, 1.0);
  const jl_mask exceeds = factor * factor * q2 > JL_LIMIT_FACTOR * JL_LIMIT_FACTOR * limit2;
  factor = jl_select(exceeds, jl_sqrt(limit2 * (a * b * r)), factor);
  o->degradation_loss += q2 * (compliance0 - factor * factor * compliance1);
  *qs = factor * *qs;
  *qt = factor * *qt;
}

/* ------------------------------------------------------------- measures of a state */

typedef struct { /* as Measures of kernels/element.py; sheared: energy stored in shear springs */
  jl_joint_real sliding, slipping, separated, stored, max_effective_closure, sheared;
} jl_measures;

typedef struct {
  jl_real sliding, slipping, separated, normal, sheared;
} jl_measure_sums;

JL_INLINE jl_measure_sums jl_zero_measures(void)
{
  const jl_measure_sums none = {jl_broadcast(0.0), jl_broadcast(0.0), jl_broadcast(0.0),
                                jl_broadcast(0.0), jl_broadcast(0.0)};
  return none;
}

/* Add the measures of facets from index `at` on, which jl_evaluate_facets evaluated */
JL_INLINE void jl_measure_facets(const jlaw_law *law, jl_states n, int at, const jl_facet_step *o,
                                 jl_measure_sums *sum)
{
  const int M = law->facets, D = law->cells,
            count = M - at < JL_FACETS_PER_PASS ? M - at : JL_FACETS_PER_PASS;
  const double *f = jl_facet_table(law, at), *cell = jl_cell_table(law, at);
  jl_real limited_G = jl_broadcast(0.0),
          sheared = limited_G;        /* G of cells at their friction limit */
  jl_real slides = jl_broadcast(1.0); /* 1 if all cells are at it */
  for (int i = 0; i < D && jl_any(o->y1 > jl_column(cell, JLAW_ZETA_START)); i++) {
    jl_real G, kappa;
    jl_real qs, qt;
    jl_load_sliders(n, jl_slider_row(law) + at * D + i, M * D, D, count, &qs, &qt);
    const jl_real q2 = qs * qs + qt * qt;
    jl_evaluate_cell(cell, o->y1, o->f1, o->k1, o->z1, o->fz1, o->kz1, law->yields, &G, &kappa);
    const jl_mask stiff = kappa > JLAW_MIN_DIVISOR;
    const jl_mask limited =
        jl_sqrt(q2)
        >= o->strength * (G * (1.0 - JL_FRICTION_TOLERANCE) - JLAW_ROUNDING_TOLERANCE * o->f1);
    limited_G += jl_select_or_zero(limited, G);
    slides = jl_select_or_zero(limited, slides);
    sheared += jl_select_or_zero(stiff, q2 / jl_select(stiff, kappa, 1.0));
    cell += JLAW_ROWS * JLAW_FACET_LANES;
  }
  const jl_mask touches = o->y1 > o->z1;
  const jl_real force = jl_select_or_zero(touches, jl_max(o->f1 - o->fz1, jl_broadcast(0.0))),
                weight = jl_broadcast(jl_column(f, JLAW_WEIGHT));
  const jl_real slipping =
      jl_select_or_zero(force > 0.0, limited_G / jl_select(force > 0.0, force, 1.0));
  sum->sliding += weight * jl_select_or_zero(touches, slides);
  sum->slipping += weight * jl_min(slipping, jl_broadcast(1.0));
  sum->separated += weight * jl_select(touches, 0.0, 1.0);
  jl_real normal = jl_first_loading_energy(law, o->y1);
  if (law->yields) normal = normal - jl_first_loading_energy(law, o->z1) - o->fz1 * (o->y1 - o->z1);
  sum->normal += jl_column(f, JLAW_ENERGY_FACTOR)
                 * jl_select_or_zero(touches, jl_max(normal, jl_broadcast(0.0)));
  sum->sheared += jl_column(f, JLAW_SLIDER_COMPLIANCE) * sheared;
}

/* --------------------------------------------------------------------------- one step */

/* G and kappa of a cell before and after the step. The growth of G is computed from the first-loading
 * curve: the bounds in jl_subtract_plastic would distort it where the curve is small and nearly
 * linear. */
JL_INLINE void jl_evaluate_cell_step(const double *cell, const jl_facet_step *o, jl_cell_step *c,
                                     int yields)
{
  jl_elastic_cell(cell, o->y0, o->f0, o->k0, &c->G0, &c->k0);
  jl_elastic_cell(cell, o->y1, o->f1, o->k1, &c->G1, &c->k1);
  c->growth = c->G1 - c->G0;
  c->kz1 = jl_broadcast(0.0);
  if (!yields) return;
  jl_real H0, H1, kz0;
  jl_elastic_cell(cell, o->z0, o->fz0, o->kz0, &H0, &kz0);
  jl_elastic_cell(cell, o->z1, o->fz1, o->kz1, &H1, &c->kz1);
  c->growth = c->G1 - jl_max(c->G0, H0);
  jl_subtract_plastic(o->y0, o->z0, H0, &c->G0, &c->k0);
  jl_subtract_plastic(o->y1, o->z1, H1, &c->G1, &c->k1);
}

/* Trial force of a slider and its return to the friction limit, |q| <= mu lam A gamma G. Where kappa
 * grows the trial force grows by the chord of G over the step; where kappa falls, the springs that
 * disengage release their force. */
JL_INLINE void jl_map_to_friction_limit(const double *f, const jl_facet_step *o, jl_cell_step *c,
                                        jl_real *qs, jl_real *qt, jl_step_kind k)
{
  jl_mask use_mean = o->is_small;
  if (k.yields) /* plastic springs of a cell engage at the same closure: then G is not smooth */
    use_mean = use_mean & ((c->k0 > 0.0) | (c->k1 <= 0.0));
  const jl_real mean = jl_select(use_mean, 0.5 * (c->k0 + c->k1), c->growth * o->inv_dy);
  c->chord = jl_min(jl_max(mean, c->k0), c->k1); /* k1 where it falls */
  c->q2 = *qs * *qs + *qt * *qt;
  const jl_mask falls = c->k1 < c->k0;
  const jl_real retained = jl_select(falls, c->k1 / jl_select(falls, c->k0, 1.0), 1.0);
  *qs = *qs * retained;
  *qt = *qt * retained;
  const jl_real stiffness = jl_column(f, JLAW_SHEAR_STIFFNESS) * c->chord;
  c->ts = *qs + stiffness * o->es;
  c->tt = *qt + stiffness * o->et;
  c->trial2 = c->ts * c->ts + c->tt * c->tt;
  c->limit = c->strength * c->G1;
  const jl_real largest = JL_LIMIT_FACTOR * c->limit;
  c->slips = c->trial2 > largest * largest;
  c->inv_size = jl_broadcast(0.0);
  c->return_factor = jl_broadcast(1.0);
  if (k.tangent || jl_any_to_compute(c->slips)) {
    c->inv_size = jl_select_or_zero(c->trial2 > JLAW_MIN_DIVISOR, 1.0 / jl_sqrt(c->trial2));
    c->return_factor = jl_select(c->slips, jl_min(c->limit * c->inv_size, jl_broadcast(1.0)), 1.0);
  }
  /* Squares of smaller forces underflow: the force counts as zero. This zero is positive, as it is in a
   * cell that no lane loads, which is skipped: the sign does not depend on the joints in other lanes. */
  const jl_mask is_loaded = (c->trial2 > JLAW_MIN_DIVISOR) & (c->limit > 0.0);
  *qs = jl_select_or_zero(is_loaded, c->return_factor * c->ts);
  *qt = jl_select_or_zero(is_loaded, c->return_factor * c->tt);
}

/* Energy that slip of the sliders, and springs that disengage under shear, dissipate; every term is
 * >= 0 also in floating point */
JL_INLINE jl_real jl_friction_loss(const jl_cell_step *c)
{
  const jl_real high = jl_max(c->chord, c->k0), low = jl_min(c->k0, c->k1);
  const jl_real a = c->k0 * high, b = c->k1 * c->chord;
  const jl_real A = jl_select(a > JLAW_MIN_STIFFNESS_PRODUCT, a, 1.0),
                B = jl_select(b > JLAW_MIN_STIFFNESS_PRODUCT, b, 1.0);
  const jl_real r = 1.0 / (A * B); /* one division for both */
  const jl_real slip =
      c->return_factor
      * (c->return_factor * (c->k1 - c->chord) + 2.0 * (1.0 - c->return_factor) * c->k1);
  return jl_select_or_zero(a > JLAW_MIN_STIFFNESS_PRODUCT, c->q2 * ((high - low) * (B * r)))
         + jl_select_or_zero(b > JLAW_MIN_STIFFNESS_PRODUCT, c->trial2 * (slip * (A * r)));
}

/* Add the tangent of a slider, J_q = beta (I - s s^T) E + v g^T: "The tangent" */
JL_INLINE void jl_add_slider_tangent(const double *f, const double *cell, const jl_cell_step *c,
                                     jl_facet_step *o, jl_step_kind k)
{
  const jl_facet_real a = jl_column(f, JLAW_SHEAR_STIFFNESS);
  const jl_facet_real start = jl_column(cell, JLAW_ZETA_START),
                      end = jl_column(cell, JLAW_ZETA_END);
  const jl_mask inside = (o->y1 > start) & (o->y1 < end);
  const jl_real dkappa = jl_select_or_zero(inside, o->dk1);
  jl_mask use_mean = o->is_small;
  if (k.yields) use_mean = use_mean & ((c->k0 > 0.0) | (c->k1 <= 0.0));
  const jl_real chord1 = jl_select(use_mean, 0.5 * dkappa, (c->k1 - c->chord) * o->inv_dy);
  const jl_mask stiff = c->k1 > JLAW_MIN_DIVISOR;
  const jl_real decay = jl_select_or_zero(stiff, dkappa / jl_select(stiff, c->k1, 1.0));
  /* make the branch independent of rounding: without closure a cell does not stiffen, and a slider at
   * its limit slips */
  const jl_mask stiffer = (c->k1 > c->k0) & (o->dy > JLAW_ROUNDING_TOLERANCE * jl_abs(o->y1));
  const jl_real slip_force =
      c->strength * (c->G1 * (1.0 - JL_FRICTION_TOLERANCE) - JLAW_ROUNDING_TOLERANCE * o->f1);
  const jl_mask limited =
      c->trial2 >= jl_max(slip_force, jl_broadcast(0.0)) * jl_max(slip_force, jl_broadcast(0.0));
  const jl_real vs = jl_select(stiffer, a * chord1 * o->es, decay * c->ts);
  const jl_real vt = jl_select(stiffer, a * chord1 * o->et, decay * c->tt);
  const jl_real us = c->ts * c->inv_size, ut = c->tt * c->inv_size;
  const jl_real dot = us * vs + ut * vt, push = c->strength * c->k1;
  const jl_real beta = jl_select_or_zero(c->limit > 0.0, c->return_factor * (a * c->chord)),
                along = jl_select_or_zero(limited, beta);
  o->vs += jl_select(limited, c->return_factor * (vs - us * dot) + push * us, vs);
  o->vt += jl_select(limited, c->return_factor * (vt - ut * dot) + push * ut, vt);
  o->bss += beta - along * us * us;
  o->bst -= along * us * ut;
  o->btt += beta - along * ut * ut;
  if (k.interlock_decays) {
    const jl_real by_gamma = jl_select_or_zero(limited, c->strength * c->G1);
    o->gs += by_gamma * us;
    o->gt += by_gamma * ut;
  }
  if (k.yields) {
    const jl_mask softens = limited & (c->k1 > 0.0);
    const jl_real softening = c->strength * jl_select_or_zero(softens, c->kz1);
    o->ws += softening * us;
    o->wt += softening * ut;
    o->kappa_sum += c->k1;
  }
}

/* Advance the slider of one cell of facets */
JL_INLINE void jl_step_cell(const double *f, const double *cell, jl_facet_step *o, jl_real *qs,
                            jl_real *qt, jl_step_kind k)
{
  jl_cell_step c;
  jl_evaluate_cell_step(cell, o, &c, k.yields);
  c.strength = o->strength;
  if (k.degrades) {
    jl_degrade_sliders(cell, o, &c, qs, qt, k);
    o->us += *qs;
    o->ut += *qt;
  }
  jl_map_to_friction_limit(f, o, &c, qs, qt, k);
#ifdef JLAW_FLOAT_SLIDERS
  jl_round_sliders(o->noise, qs, qt);
#endif
  o->qs += *qs;
  o->qt += *qt;
  if (k.track_dissipation) o->loss += jl_friction_loss(&c);
  if (k.tangent) jl_add_slider_tangent(f, cell, &c, o, k);
}

/* C += along g^T + E^T B E of facets, minus softening g_z^T where the plastic indentation grows */
JL_INLINE void jl_add_tangent(const jlaw_law *law, const double *f, const jl_facet_step *o,
                              jl_step_sums *sum, jl_step_kind k)
{
  const jl_mask indents = (o->z1 - o->z0 > JLAW_ROUNDING_TOLERANCE * o->z1) & (o->kappa_sum > 0.0);
  const jl_mask own = jl_sets_own_indentation(f, o);
  for (int i = 0; i < k.dim; i++) {
    const jl_facet_real n = jl_column(f, JLAW_N + i) * jl_column(f, JLAW_A);
    const jl_facet_real s = jl_column(f, JLAW_S + i) * law->stiffness_ratio,
                        t = jl_column(f, JLAW_T + i) * law->stiffness_ratio;
    const jl_real along = n * o->k1 + s * o->vs + t * o->vt;
    const jl_real left = s * o->bss + t * o->bst, right = s * o->bst + t * o->btt;
    for (int j = 0; j < k.dim; j++) {
      const jl_real g = jl_broadcast(jl_column(f, JLAW_M + j)); /* dy/dd */
      jl_real C_ij = along * g + left * jl_column(f, JLAW_S + j) + right * jl_column(f, JLAW_T + j);
      if (k.yields) {
        const jl_real softening = jl_select_or_zero(indents, n * o->kz1 + s * o->ws + t * o->wt);
        C_ij -= j > 0 ? softening * jl_select(own, g, -g) : softening * g;
      }
      sum->C[3 * i + j] += C_ij;
    }
  }
}

/* Add the tangent of facets whose interlock decays: with slip their planes rotate and their friction
 * limits fall. It is computed in axes (1, e), then rotated. Es, Et: derivative of the increment in the
 * plane with respect to d; A, B: derivative of the slider force with respect to the slopes along and
 * across; h, H: derivatives of the slopes with respect to the displacement, at the end and mid-step. */
JL_INLINE void jl_add_decaying_tangent(const jlaw_law *law, const double *f, const jl_joint_step *m,
                                       const jl_facet_step *o, jl_step_sums *sum, jl_step_kind k)
{
  const jl_mask indents = (o->z1 - o->z0 > JLAW_ROUNDING_TOLERANCE * o->z1) & (o->kappa_sum > 0.0);
  const jl_mask own = jl_sets_own_indentation(f, o);
  const jl_plane *s = &o->end, *r = &o->middle;
  const jl_real ratio = jl_broadcast(law->stiffness_ratio), none = jl_broadcast(0.0),
                n = jl_broadcast(jl_column(f, JLAW_ENERGY_FACTOR));
  const int columns = k.degrades_by_stress ? 4 : 3; /* the last one: by the slope retention */
  jl_real h[3], H[3], C[3][4]; /* ee, ez, zz */
  jl_slope_derivatives(law, f, s, m->end.w, m->slopes_end, h);
  jl_slope_derivatives(law, f, r, m->middle.w, m->slopes_middle, H);
  const jl_real turn = 0.5 * (o->d0 + r->along * o->de), et = 0.5 * o->et;
  const jl_real rm2 = 1.0 / r->m2, rN2 = 1.0 / r->N2;
  const jl_real ea = -turn * (rm2 * r->inv_m), eb = -(turn * r->inv_mN + et * r->across * rN2);
  const jl_real ta =
      (r->along * o->dz - 0.5 * r->across * o->de) * r->inv_mN - et * r->along * (rm2 + rN2);
  jl_real full[2] = {none, none}, full_middle[2] = {none, none}; /* slopes at a retention of 1 */
  if (k.degrades_by_stress) {
    jl_full_slopes(f, s, m->end.w, full);
    jl_full_slopes(f, r, m->middle.w, full_middle);
  }
  const jl_real Es[4] = {-r->along * r->inv_m, r->inv_m + ea * H[0], ea * H[1],
                         ea * full_middle[0]};
  const jl_real Et[4] = {-r->across * r->inv_mN,
                         -r->along * r->across * r->inv_mN + ta * H[0] + eb * H[1],
                         r->m2 * r->inv_mN + ta * H[1] + eb * H[2],
                         ta * full_middle[0] + eb * full_middle[1]};
  const jl_real cs[3] = {-s->along * s->inv_m, s->inv_m, none};
  const jl_real ct[3] = {-s->across * s->inv_mN, -s->along * s->across * s->inv_mN,
                         s->m2 * s->inv_mN};
  const jl_real rM2 = 1.0 / s->m2, rn2 = 1.0 / s->N2, rm3 = rM2 * s->inv_m;
  const jl_real qa = o->qs * rm3, qt = o->qt * s->inv_mN, fall = s->along * (rM2 + rn2);
  const jl_real A[3] = {-qa - o->qt * ct[0] * fall,
                        -s->along * qa - s->across * qt - o->qt * ct[1] * fall,
                        2.0 * s->along * qt - o->qt * ct[2] * fall};
  const jl_real down = o->qt * s->across * rn2;
  const jl_real B[3] = {-qt - down * ct[0], -s->along * qt - down * ct[1], -down * ct[2]};
  const jl_real ga = s->along * rn2, gb = s->across * rn2; /* of log(gamma) */
  const jl_real g[4] = {jl_broadcast(1.0), s->along, s->across,
                        k.degrades_by_stress ? jl_climb(law, f, &m->end) : none};
  jl_real contact_rate[3];
  for (int j = 0; j < columns; j++) {
    const jl_real ha = j == 3 ? full[0] : j ? h[j - 1] : none,
                  hb = j == 3 ? full[1] : j ? h[j] : none, gamma = ga * ha + gb * hb;
    const jl_real us = o->vs * g[j] + o->bss * Es[j] + o->bst * Et[j] + o->gs * gamma;
    const jl_real ut = o->vt * g[j] + o->bst * Es[j] + o->btt * Et[j] + o->gt * gamma;
    const jl_real g_z =
        k.yields ? jl_select_or_zero(indents, j ? jl_select(own, g[j], -g[j]) : g[j]) : none;
    for (int i = 0; i < 3; i++) {
      const jl_real dslope = i == 1 ? ha : i == 2 ? hb : none;
      C[i][j] = n * (o->k1 * g[i] * g[j] + o->f1 * dslope)
                + ratio * (cs[i] * us + ct[i] * ut + (A[i] * ha + B[i] * hb));
      if (k.yields) C[i][j] -= g_z * (n * g[i] * o->kz1 + ratio * (cs[i] * o->ws + ct[i] * o->wt));
    }
    if (k.degrades_by_stress && j < 3) contact_rate[j] = n * (o->k1 * g[j] - g_z * o->kz1);
  }
  for (int i = 0; i < 3; i++) jl_to_joint_axes(f, &C[i][1], &C[i][2]);
  for (int j = 0; j < columns; j++) jl_to_joint_axes(f, &C[1][j], &C[2][j]);
  if (k.degrades_by_stress) {
    jl_to_joint_axes(f, &contact_rate[1], &contact_rate[2]);
    for (int i = 0; i < k.dim; i++) {
      sum->by_retention[i] += C[i][3];
      sum->contact_rate[i] += contact_rate[i];
    }
  }
  for (int i = 0; i < k.dim; i++)
    for (int j = 0; j < k.dim; j++) sum->C[3 * i + j] += C[i][j];
}

/* Advance facets from index `at` on: effective closure, first-loading curve, sliders. Adds their part
 * of F, C and the dissipated energy to `sum`, and of the measures unless `measures` is NULL. */
JL_INLINE void jl_step_facets(const jlaw_law *law, int at, const jl_joint_step *m, jl_states n,
                              jl_step_sums *sum, jl_step_kind k, jl_measure_sums *measures)
{
  const int M = law->facets, D = law->cells,
            count = M - at < JL_FACETS_PER_PASS ? M - at : JL_FACETS_PER_PASS;
  const int curve_row = k.curve_stored ? jl_state_rows(law) : 0;
  const double *f = jl_facet_table(law, at), *cell = jl_cell_table(law, at);
  jl_facet_step o;
  o.y0 = o.y1 = o.es = o.et = o.dk1 = o.limit2 = o.fw = o.kw = jl_broadcast(0.0);
  for (int i = 0; i < k.dim && !k.interlock_decays; i++) {
    o.y0 += jl_column(f, JLAW_M + i) * m->from[i];
    o.y1 += jl_column(f, JLAW_M + i) * m->to[i];
    o.es += jl_column(f, JLAW_S + i) * m->p[i];
    if (i > 0) o.et += jl_column(f, JLAW_T + i) * m->p[i];
  }
  if (k.interlock_decays) {
    o.y0 = jl_effective_closure(law, f, m->from[0], &m->start, m->slopes1);
    o.y1 = jl_effective_closure(law, f, m->to[0], &m->end, m->slopes_end);
  }
  o.yw = k.degrades
             ? jl_flush_underflow(jl_effective_closure(law, f, m->from[0], &m->start, m->slopes0))
             : o.y0;
  if (!k.yields && !jl_any((o.y0 > 0.0) | (o.y1 > 0.0) | (o.yw > 0.0))) {
    if (measures) measures->separated += jl_column(f, JLAW_WEIGHT);
    return; /* separated: no force */
  }
  if (k.interlock_decays) {
    o.middle = jl_plane_at(f, &m->middle, m->slopes_middle);
    o.end = jl_plane_at(f, &m->end, m->slopes_end);
    jl_project_increment(f, m, &o);
  }
  const jl_facet_real limit = jl_column(f, JLAW_FRICTION_LIMIT) * jl_column(f, JLAW_COS_THETA);
  jl_plane start;
  if (k.degrades) {
    start = jl_plane_at(f, &m->start, m->slopes1);
    o.limit2 = limit * limit * start.N2;
  }
  o.y0 = jl_flush_underflow(o.y0);
  o.y1 = jl_flush_underflow(o.y1);
  o.dy = o.y1 - o.y0;
  o.inv_dy = 1.0 / o.dy;
  o.is_small = jl_abs(o.dy) <= JLAW_MIN_CHORD_STEP * jl_abs(o.y1);
  o.qs = o.qt = o.loss = o.vs = o.vt = o.bss = o.bst = o.btt = o.ws = o.wt = o.kappa_sum =
      jl_broadcast(0.0);
  o.gs = o.gt = o.us = o.ut = o.degradation_loss = jl_broadcast(0.0);
  if (k.curve_stored) {
    o.f0 = jl_load(n, curve_row + at, 1, count);
    o.k0 = jl_load(n, curve_row + M + at, 1, count);
  } else jl_first_loading_curve(law, o.yw, &o.f0, &o.k0, (jl_real *) 0);
  if (k.degrades) {
    o.fw = o.f0, o.kw = o.k0;
    if (jl_any_to_compute(o.y0 != o.yw))
      jl_first_loading_curve(law, o.y0, &o.f0, &o.k0, (jl_real *) 0);
  }
  jl_first_loading_curve(law, o.y1, &o.f1, &o.k1, k.tangent ? &o.dk1 : (jl_real *) 0);
  if (k.curve_stored) {
    jl_store(n, curve_row + at, 1, count, o.f1);
    jl_store(n, curve_row + M + at, 1, count, o.k1);
  }
  o.z0 = o.z1 = o.fz0 = o.fz1 = o.kz0 = o.kz1 = jl_broadcast(0.0);
  if (k.yields) jl_update_plastic_indentation(law, f, n, curve_row, at, count, m, &o);
  o.strength = jl_broadcast(jl_column(f, JLAW_FRICTION_LIMIT));
  if (k.interlock_decays) o.strength = o.strength * o.end.gamma;
  for (int i = 0; i < D; i++, cell += JLAW_ROWS * JLAW_FACET_LANES) {
    const jl_facet_real zeta = jl_column(cell, JLAW_ZETA_START);
    if (!jl_any((o.y0 > zeta) | (o.y1 > zeta) | (o.yw > zeta)))
      break; /* nor do deeper cells touch */
    const int row = k.dim + 1 + at * D + i;
    jl_real qs, qt;
    jl_load_sliders(n, row, M * D, D, count, &qs, &qt);
#ifdef JLAW_FLOAT_SLIDERS
    o.noise = jl_rounding_noise(m->rounding_key, at * D + i, D, qs, qt);
#endif
    jl_step_cell(f, cell, &o, &qs, &qt, k);
    jl_store_sliders(n, row, M * D, D, count, qs, qt);
  }
  if (measures) jl_measure_facets(law, n, at, &o, measures);
  if (k.yields) {
    sum->plastic_work += jl_column(f, JLAW_ENERGY_FACTOR) * jl_plastic_work(f, &o);
    if (k.degrades) jl_subtract_plastic_force(o.yw, o.z0, o.fz0, &o.fw, &o.kw);
    jl_subtract_plastic_force(o.y0, o.z0, o.fz0, &o.f0, &o.k0);
    jl_subtract_plastic_force(o.y1, o.z1, o.fz1, &o.f1, &o.k1);
  }
  if (k.track_dissipation) sum->loss += jl_column(f, JLAW_SLIDER_COMPLIANCE) * o.loss;
  if (k.degrades) {
    sum->degradation_sliders += jl_column(f, JLAW_SLIDER_COMPLIANCE) * o.degradation_loss;
    sum->degradation_normal +=
        0.5 * jl_column(f, JLAW_ENERGY_FACTOR) * ((o.fw + o.f0) * (o.yw - o.y0));
    jl_real F[3];
    jl_facet_traction(law, f, &start, o.f0, o.us, o.ut, F);
    sum->shear0[0] += F[1], sum->shear0[1] += F[2];
  }
  if (k.degrades_by_stress)
    sum->slope_energy_rate +=
        jl_column(f, JLAW_ENERGY_FACTOR)
        * (jl_climb(law, f, &m->start) * o.f0 + jl_climb(law, f, &m->end) * o.f1);
  jl_add_facet_traction(law, f, &o.end, o.f1, o.qs, o.qt, k.dim, k.interlock_decays, sum->F);
  if (!k.tangent) return;
  if (k.interlock_decays) jl_add_decaying_tangent(law, f, m, &o, sum, k);
  else jl_add_tangent(law, f, &o, sum, k);
}

/* Measures of joints from the partial sums over their facets */
JL_INLINE void jl_sum_measures(const jl_measure_sums *sum, jl_measures *all)
{
  all->sliding = jl_total(sum, sliding);
  all->slipping = jl_total(sum, slipping);
  all->separated = jl_total(sum, separated);
  all->sheared = jl_total(sum, sheared);
  all->stored = jl_total(sum, normal) + all->sheared;
}

/* Advance the asperities of joints by the increments d (dim): states n, traction F (dim), and C (dim,
 * dim) for a tangent. Writes the measures after the step, without max_effective_closure, unless `all`
 * is NULL. */
JL_INLINE void jl_step(const jlaw_law *law, jl_states n, const jl_joint_real d[3],
                       jl_joint_real F[3], jl_joint_real C[9], jl_step_kind k, jl_measures *all)
{
  const int dim = k.dim, M = law->facets, plastic_row = jl_plastic_row(law);
  jl_joint_step m;
  jl_step_sums sum[JL_PARTIAL_SUMS];
  for (int i = 0; i < 3; i++) {
    m.p[i] = i < dim ? d[i] : jl_broadcast_joint(0.0);
    m.from[i] = i < dim ? jl_load_joint(n, i) : jl_broadcast_joint(0.0);
    m.to[i] = m.from[i] + m.p[i];
  }
#ifdef JLAW_FLOAT_SLIDERS
  m.rounding_key = jl_rounding_key(m.to, dim);
#endif
  m.slopes0 = m.slopes1 = jl_broadcast_joint(1.0);
  if (k.degrades) jl_degrade_slopes(law, n, &m, k);
  else if (k.degrades_by_stress) m.slopes0 = m.slopes1 = 1.0 - jl_load_joint(n, jl_degradation_row(law));
  if (k.interlock_decays) {
    m.start = jl_offset_at(law, m.from[1], m.from[2]);
    m.middle = jl_offset_at(law, m.from[1] + 0.5 * m.p[1], m.from[2] + 0.5 * m.p[2]);
    m.end = jl_offset_at(law, m.to[1], m.to[2]);
  }
  m.slopes_middle = m.slopes_end = m.slopes1;
  m.retention_rate = jl_broadcast_joint(0.0);
  if (k.degrades_by_stress) jl_degrade_by_stress(law, n, &m, k);
  for (int i = 0; i < JL_PARTIAL_SUMS; i++) {
    for (int j = 0; j < 3; j++) sum[i].F[j] = jl_broadcast(0.0);
    for (int j = 0; k.tangent && j < 9; j++) sum[i].C[j] = jl_broadcast(0.0);
    if (k.track_dissipation) sum[i].loss = jl_broadcast(0.0);
    if (k.yields) sum[i].plastic_work = jl_broadcast(0.0);
    if (k.degrades)
      sum[i].degradation_normal = sum[i].degradation_sliders = sum[i].shear0[0] =
          sum[i].shear0[1] = jl_broadcast(0.0);
    if (!k.degrades_by_stress) continue;
    for (int j = 0; j < 3; j++) sum[i].by_retention[j] = sum[i].contact_rate[j] = jl_broadcast(0.0);
    sum[i].slope_energy_rate = jl_broadcast(0.0);
  }
  jl_measure_sums measures[JL_PARTIAL_SUMS];
  for (int i = 0; all && i < JL_PARTIAL_SUMS; i++) measures[i] = jl_zero_measures();
  for (int at = 0; at < M; at += JL_FACETS_PER_PASS) {
    const int i = at / JL_FACETS_PER_PASS % JL_PARTIAL_SUMS;
    jl_step_facets(law, at, &m, n, sum + i, k, all ? measures + i : (jl_measure_sums *) 0);
  }
  if (all) jl_sum_measures(measures, all);
  for (int i = 0; i < dim; i++) {
    F[i] = jl_total(sum, F[i]);
    for (int j = 0; k.tangent && j < dim; j++) C[dim * i + j] = jl_total(sum, C[3 * i + j]);
    jl_store_joint(n, i, m.to[i]);
  }
  for (int i = 0; k.degrades_by_stress && k.tangent && i < dim; i++)
    for (int j = 0; j < dim; j++)
      C[dim * i + j] +=
          jl_total(sum, by_retention[i]) * (m.retention_rate * jl_total(sum, contact_rate[j]));
  if (!k.track_dissipation) return;
  jl_joint_real dissipated = jl_total(sum, loss);
  if (k.degrades) {
    jl_joint_real normal = jl_total(sum, degradation_normal), work = jl_broadcast_joint(0.0);
    jl_joint_real work0 = work, work1 = work; /* of the shear stress before and after the step */
    for (int i = 1; i < dim; i++) {
      work0 += jl_total(sum, shear0[i - 1]) * m.p[i];
      work1 += F[i] * m.p[i];
    }
    for (int l = 0; l < JL_JOINTS_PER_PASS;
         l++) { /* only work of the joint's own shear degrades asperities */
      const double shear = 0.5 * (fabs(JL_JOINT(work0, l)) + fabs(JL_JOINT(work1, l))),
                   friction = JL_JOINT(dissipated, l);
      JL_JOINT(work, l) = shear < friction ? shear : friction;
      /* >= 0 in the sum over opposite facets, but for rounding */
      JL_JOINT(normal, l) = JL_JOINT(normal, l) > 0.0 ? JL_JOINT(normal, l) : 0.0;
    }
    jl_store_joint(n, jl_degradation_row(law) + 1,
                   jl_load_joint(n, jl_degradation_row(law) + 1) + work);
    dissipated += jl_total(sum, degradation_sliders) + normal;
  }
  if (k.degrades_by_stress) {
    jl_joint_real normal =
        0.5 * jl_total(sum, slope_energy_rate) * (m.slopes1 - m.slopes_end);
    for (int l = 0; l < JL_JOINTS_PER_PASS; l++) /* >= 0, but for rounding */
      JL_JOINT(normal, l) = JL_JOINT(normal, l) > 0.0 ? JL_JOINT(normal, l) : 0.0;
    dissipated += normal;
  }
  if (k.yields) {
    const jl_joint_real plastic_work = jl_total(sum, plastic_work);
    jl_store_joint(n, plastic_row + M, jl_load_joint(n, plastic_row + M) + plastic_work);
    dissipated += plastic_work;
  }
  jl_store_joint(n, dim, jl_load_joint(n, dim) + dissipated);
}

/* ------------------------------------------------------------- evaluation of a state */

/* Evaluate facets from index `at` on in a state: y1, z1, and the first-loading curve at both;
 * strength, the friction limit of q over G */
JL_INLINE void jl_evaluate_facets(const jlaw_law *law, jl_states n, int at, jl_facet_step *o)
{
  const int count = law->facets - at < JL_FACETS_PER_PASS ? law->facets - at : JL_FACETS_PER_PASS;
  const double *f = jl_facet_table(law, at);
  jl_joint_real slopes = jl_broadcast_joint(1.0), to[3];
  for (int i = 0; i < 3; i++) to[i] = i < law->dim ? jl_load_joint(n, i) : jl_broadcast_joint(0.0);
  if (jl_slopes_change(law)) slopes = 1.0 - jl_load_joint(n, jl_degradation_row(law));
  o->y1 = o->z1 = o->fz1 = o->kz1 = jl_broadcast(0.0);
  o->strength = jl_broadcast(jl_column(f, JLAW_FRICTION_LIMIT));
  for (int i = 0; i < law->dim && !law->interlock_decays; i++)
    o->y1 += jl_column(f, JLAW_M + i) * to[i];
  if (law->interlock_decays) {
    const jl_offset here = jl_offset_at(law, to[1], to[2]);
    o->y1 = jl_effective_closure(law, f, to[0], &here, slopes);
    o->strength = o->strength * jl_plane_at(f, &here, slopes).gamma;
  }
  o->y1 = jl_flush_underflow(o->y1);
  jl_first_loading_curve(law, o->y1, &o->f1, &o->k1, (jl_real *) 0);
  if (!law->yields) return;
  o->z1 = jl_load(n, jl_plastic_row(law) + at, 1, count);
  jl_first_loading_curve(law, o->z1, &o->fz1, &o->kz1, (jl_real *) 0);
}

/* Add the energy stored in the elements of elements.h to the measures; Coulomb's law sets the others
 * of a joint without asperities */
JL_INLINE void jl_add_element_measures(const jlaw_law *law, jl_states n, jl_joint_real stored,
                                       jl_measures *all)
{
  all->stored += stored;
  for (int l = 0; law->coulomb && !law->asperities && l < JL_JOINTS_PER_PASS; l++) {
    double fractions[3];
    jl_coulomb_fractions(law, n.s + l, n.stride, fractions);
    JL_JOINT(all->sliding, l) = fractions[0], JL_JOINT(all->slipping, l) = fractions[1];
    JL_JOINT(all->separated, l) = fractions[2], JL_JOINT(all->max_effective_closure, l) = n.s[l];
  }
}

/* Measures of joints in their present states */
JL_INLINE jl_measures jl_measure(const jlaw_law *law, jl_states n)
{
  const int M = law->facets;
  jl_measure_sums sum[JL_PARTIAL_SUMS];
  jl_measures all;
  all.max_effective_closure = jl_broadcast_joint(-DBL_MAX);
  for (int i = 0; i < JL_PARTIAL_SUMS; i++) sum[i] = jl_zero_measures();
  for (int at = 0; at < M; at += JL_FACETS_PER_PASS) {
    jl_facet_step o;
    jl_evaluate_facets(law, n, at, &o);
    jl_measure_facets(law, n, at, &o, sum + at / JL_FACETS_PER_PASS % JL_PARTIAL_SUMS);
#ifdef JLAW_FACET_VECTORS
    for (int l = 0; l < JL_FACETS_PER_PASS && at + l < M; l++)
      all.max_effective_closure =
          all.max_effective_closure > o.y1[l] ? all.max_effective_closure : o.y1[l];
#else
    all.max_effective_closure = jl_max(all.max_effective_closure, o.y1);
#endif
  }
  jl_sum_measures(sum, &all);
  if (!jl_has_elements(law)) return all;
  jl_joint_real delta[3], zero[3];
  for (int i = 0; i < law->dim; i++)
    delta[i] = jl_load_joint(n, i), zero[i] = jl_broadcast_joint(0.0);
  const jl_joint_real stored =
      jl_step_elements(law, n, jl_element_row(law), delta, zero, NULL, NULL, 0, 0);
  jl_add_element_measures(law, n, stored, &all);
  return all;
}

/* Traction F (dim) of joints in their present states, bitwise equal to the traction of the step that
 * wrote them: facets and cells are summed in the same order */
JL_INLINE void jl_traction(const jlaw_law *law, jl_states n, jl_joint_real F[3])
{
  const int dim = law->dim, M = law->facets, D = law->cells;
  struct {
    jl_real F[3];
  } sum[JL_PARTIAL_SUMS];
  jl_joint_real delta[3], slopes = jl_broadcast_joint(1.0);
  for (int i = 0; i < 3; i++)
    delta[i] = i < dim ? jl_load_joint(n, i) : jl_broadcast_joint(0.0);
  if (jl_slopes_change(law)) slopes = 1.0 - jl_load_joint(n, jl_degradation_row(law));
  for (int i = 0; i < JL_PARTIAL_SUMS; i++)
    for (int j = 0; j < 3; j++) sum[i].F[j] = jl_broadcast(0.0);
  for (int at = 0; at < M; at += JL_FACETS_PER_PASS) {
    const int count = M - at < JL_FACETS_PER_PASS ? M - at : JL_FACETS_PER_PASS;
    const double *f = jl_facet_table(law, at);
    jl_facet_step o;
    jl_evaluate_facets(law, n, at, &o);
    const jl_offset here = jl_offset_at(law, delta[1], delta[2]);
    o.end = jl_plane_at(f, &here, slopes);
    if (law->yields) jl_subtract_plastic_force(o.y1, o.z1, o.fz1, &o.f1, &o.k1);
    o.qs = o.qt = jl_broadcast(0.0);
    for (int i = 0; i < D; i++) {
      jl_real qs, qt;
      jl_load_sliders(n, jl_slider_row(law) + at * D + i, M * D, D, count, &qs, &qt);
      o.qs += qs;
      o.qt += qt;
    }
    jl_add_facet_traction(law, f, &o.end, o.f1, o.qs, o.qt, dim, law->interlock_decays,
                          sum[at / JL_FACETS_PER_PASS % JL_PARTIAL_SUMS].F);
  }
  for (int i = 0; i < dim; i++) F[i] = jl_total(sum, F[i]);
  if (jl_element_rows(law)) jl_add_element_traction(law, n, jl_element_row(law), delta, F);
}

/* Upper bound of |C| over A/c1 of a facet with this Phi', without the part of decaying slopes */
JL_INLINE jl_real jl_facet_stiffness_bound(const jlaw_law *law, jl_real slope)
{
  const double stick = law->stiffness_ratio > 1.0 ? law->stiffness_ratio : 1.0;
  const jl_real engagement = jl_min(law->engagement_stiffness_factor * slope,
                                    jl_broadcast(law->engagement_stiffness_limit));
  return (stick + law->mu) * slope + law->mu * engagement;
}

/* Upper bound of |C| (Pa/m) of joints in their present states */
JL_INLINE jl_joint_real jl_stiffness_bound(const jlaw_law *law, jl_states n)
{
  const double rotation = JLAW_MAX_OFFSET_CURVATURE / law->mating_length;
  struct {
    jl_real bound;
  } sum[JL_PARTIAL_SUMS];
  for (int i = 0; i < JL_PARTIAL_SUMS; i++) sum[i].bound = jl_broadcast(0.0);
  for (int at = 0; at < law->facets; at += JL_FACETS_PER_PASS) {
    const double *f = jl_facet_table(law, at);
    const jl_facet_real c1 = jl_column(f, JLAW_COS_THETA);
    jl_facet_step o;
    jl_evaluate_facets(law, n, at, &o);
    jl_real bound = jl_column(f, JLAW_SHEAR_STIFFNESS) * jl_facet_stiffness_bound(law, o.k1);
    if (law->interlock_decays)
      bound += rotation * jl_column(f, JLAW_A) * jl_column(f, JLAW_TAN_THETA)
               * (c1 + law->mu * (1.0 + c1)) * o.f1;
    sum[at / JL_FACETS_PER_PASS % JL_PARTIAL_SUMS].bound += bound;
  }
  jl_joint_real bound = jl_total(sum, bound);
  for (int l = 0; l < JL_JOINTS_PER_PASS; l++)
    JL_JOINT(bound, l) += jl_elements_stiffness_bound(law, n.s + l, jl_element_row(law), n.stride);
  return bound;
}

/* ------------------------------------------------------------------ kinds of a step */

/* The step is compiled for several kinds. A step in a plane costs half of a step in space, and a
 * tangent, the dissipated energy or measures that are not requested cost nothing. Yielding and
 * degrading asperities always need the dissipated energy. Batches (JL_BATCH) have kinds with and
 * without it, kinds for degrading asperities, and one function per kind, because compilers allocate
 * registers better for one kind at a time. The header has fewer kinds, which limits the memory of the
 * compiler, and never computes measures in a step. */
#ifdef JL_BATCH
#define JL_STEP_FUNCTION static __attribute__((noinline))
#else
#define JL_BATCH 0
#ifndef JL_STEP_FUNCTION
#define JL_STEP_FUNCTION JL_INLINE
#endif
#endif
#define JL_DEFINE_STEP(name, tangent, measured, ...)                                               \
  JL_STEP_FUNCTION void jl_step_##name(const jlaw_law *law, jl_states n, const jl_joint_real d[3], \
                                       jl_joint_real F[3], jl_joint_real C[9],                     \
                                       int track_dissipation, int curve_stored, jl_measures *all)  \
  {                                                                                                \
    const jl_step_kind untracked = {__VA_ARGS__, tangent, 0, curve_stored};                        \
    const jl_step_kind k = {__VA_ARGS__, tangent, JL_BATCH || track_dissipation, curve_stored};    \
    if (!(measured)) all = NULL;                                                                   \
    if (JL_BATCH && !track_dissipation && !k.degrades) jl_step(law, n, d, F, C, untracked, all);   \
    else jl_step(law, n, d, F, C, k, all);                                                         \
  }
#if JL_BATCH
#define JL_DEFINE_STEPS(name, ...)                   \
  JL_DEFINE_STEP(name, 0, 0, __VA_ARGS__)            \
  JL_DEFINE_STEP(name##_measured, 0, 1, __VA_ARGS__) \
  JL_DEFINE_STEP(name##_C, 1, 0, __VA_ARGS__)
JL_DEFINE_STEPS(plane_degrading, 2, 0, 1, 1, 0)
JL_DEFINE_STEPS(space_degrading, 3, 0, 1, 1, 0)
#else
#define JL_DEFINE_STEPS(name, ...)        \
  JL_DEFINE_STEP(name, 0, 0, __VA_ARGS__) \
  JL_DEFINE_STEP(name##_C, 1, 0, __VA_ARGS__)
#endif
JL_DEFINE_STEPS(plane, 2, 0, 0, 0, 0)
JL_DEFINE_STEPS(plane_decaying, 2, 0, 1, 0, 0)
JL_DEFINE_STEPS(space, 3, 0, 0, 0, 0)
JL_DEFINE_STEPS(space_decaying, 3, 0, 1, 0, 0)
JL_DEFINE_STEPS(general, law->dim, law->yields, 0, 0, 0) /* asperities yield, or closure only */
JL_DEFINE_STEPS(general_decaying, law->dim, law->yields, 1, law->degrades, law->degrades_by_stress)

/* Advance joints with all their elements by the step of their kind. Measures are written unless `all`
 * is NULL, which it must be for a tangent. */
JL_INLINE void jl_step_of_kind(const jlaw_law *law, jl_states n, const jl_joint_real d[3],
                               jl_joint_real F[3], jl_joint_real C[9], int track_dissipation,
                               int tangent, int curve_stored, jl_measures *all)
{
  const int dim = law->dim, yields = law->yields, degrades = law->degrades;
  jl_joint_real from[3];
  for (int i = 0; i < dim; i++) from[i] = jl_load_joint(n, i);
  track_dissipation = track_dissipation || yields || degrades;
#if JL_BATCH
#define JL_STEP_MEASURED(name) \
  else if (all) jl_step_##name##_measured(law, n, d, F, C, track_dissipation, curve_stored, all);
#else
#define JL_STEP_MEASURED(name)
#endif
#define JL_STEP(name)                                                                       \
  {                                                                                         \
    if (tangent) jl_step_##name##_C(law, n, d, F, C, track_dissipation, curve_stored, all); \
    JL_STEP_MEASURED(name)                                                                  \
    else jl_step_##name(law, n, d, F, C, track_dissipation, curve_stored, all);             \
  }
  if (law->interlock_decays
      && (yields || dim == 1 || law->degrades_by_stress || (degrades && !JL_BATCH)))
    JL_STEP(general_decaying)
  else if (yields || dim == 1) JL_STEP(general)
#if JL_BATCH
  else if (dim == 2 && degrades) JL_STEP(plane_degrading)
  else if (degrades) JL_STEP(space_degrading)
#endif
  else if (dim == 2 && law->interlock_decays) JL_STEP(plane_decaying)
  else if (dim == 2) JL_STEP(plane)
  else if (law->interlock_decays) JL_STEP(space_decaying)
  else JL_STEP(space)
#undef JL_STEP_MEASURED
#undef JL_STEP
  if (!jl_has_elements(law)) return;
  const jl_joint_real stored =
      jl_step_elements(law, n, jl_element_row(law), from, d, F, C, tangent, track_dissipation);
  if (all) jl_add_element_measures(law, n, stored, all);
}
