/* law.h: one step of a rock joint, and what a state amounts to, in lanes (lanes.h).
 *
 * Symbols and order are those of docs/theory-incremental.md and of kernels/asperities.py. Rows of
 * a state: delta (dim) from the mated position | dissipated energy | q_s (M D) | q_t (M D), q times
 * lam; where asperities yield flattened depth (M) | plastic work; with wear the share of the slopes
 * that is gone | work that wears them; then the rows of elements.h. A batch keeps beside them Phi and
 * Phi' of every facet (M each), which saves half the look-ups, and with yielding the same at that
 * depth.
 *
 * The last digit of expm1 and pow depends on the C library, that of all else here does not. exp and
 * log are avoided: zig links its own, which differ from those of the system. */

typedef struct { /* constants of a step: the compiler leaves out what they exclude */
  int dim, yields, fades, wears, tangent, ledger;
  int kept; /* whether Phi and Phi' lie beside the state */
} jl_kind;

typedef struct { /* in the plane of a joint: o, offset over the mating length; w^2 = 1 - |o|^2 */
  jl_of_joint o[2], w;
} jl_site;

typedef struct { /* a joint in a step */
  jl_of_joint p[3], from[3],
      to[3]; /* increment; closure and in-plane displacement before and after */
  jl_site start, middle, end;
  jl_of_joint had, has; /* share of the slopes that was left before the step, and is in it */
} jl_motion;

typedef struct { /* the plane of facets: slope along the azimuth e and across it, in axes (1, e) */
  jl_real x, z;  /* offset over the mating length along e and across */
  jl_real along, across;
  jl_real m2, N2, rm, rmn; /* 1 + along^2, that + across^2; 1/m, 1/(m N) */
  jl_real gamma;           /* c1 N */
} jl_plane;

typedef struct { /* facets in a step: y, Phi, Phi', Phi'' before and after; de */
  jl_real y0, y1, f0, f1, k0, k1, bend, es, et;
  jl_plane middle, end;
  jl_real yw, fw, kw, limit2, worn; /* before wear: y, Phi, Phi'; after it: (q/G)^2 at most; loss */
  jl_real d0, de, dz;               /* increment: closure, along the azimuth and across it */
  jl_real dy, rdy;                  /* y1 - y0, and 1 over it */
  jl_yes near;                      /* y has hardly changed */
  jl_real z0, z1, fz0, fz1, kz0, kz1;          /* flattened depth; Phi and Phi' there */
  jl_real qs, qt, lost, vs, vt, bss, bst, btt; /* sums over the cells: q, loss, v and B of C */
  jl_real ws, wt, open;                        /* v of the softening by z1; sum of kappa */
  jl_real us, ut;           /* sums over the cells of q before the step, where slopes wear */
  jl_real gs, gt, strength; /* derivative of q by log(gamma); mu lam A gamma */
} jl_facets;

typedef struct {                /* the sliders of one depth cell of facets */
  jl_real G0, G1, k0, k1, kz1;  /* G and kappa before and after; kappa at z1 */
  jl_real gained;               /* what G grows by, before springs yield at the new y */
  jl_real strength, cap, chord; /* mu lam A; friction limit; of G over the step */
  jl_real ts, tt, unit, share;  /* trial force, 1 over its size, cap over its size or 1 */
  jl_real old2, new2;           /* squares of q before and of the trial force */
  jl_yes slips;
} jl_sliders;

typedef struct { /* what facets add up to */
  jl_real F[3], C[9], lost;
  jl_real crushed, lowered, worn; /* plastic work; what the wear of slopes takes: normal, sliders */
  jl_real before[2];              /* shear stress before the step, where slopes wear */
} jl_sums;

/* Rows of a state: first of the sliders, first after them, worn slopes, elements; number of rows */
JL_IN int jl_slider_row(const jlaw_law *law) { return law->dim + 1; }
JL_IN int jl_rest_row(const jlaw_law *law) { return law->dim + 1 + 2 * law->facets * law->cells; }
JL_IN int jl_worn_row(const jlaw_law *law)
{
  return jl_rest_row(law) + (law->yields ? law->facets + 1 : 0);
}
JL_IN int jl_element_row(const jlaw_law *law) { return jl_worn_row(law) + 2 * law->wears; }
JL_IN int jl_state_rows(const jlaw_law *law) { return jl_element_row(law) + jl_element_rows(law); }

/* Tables of facets from number `at` on, and of their first depth cell */
JL_IN const double *jl_facet_of(const jlaw_law *law, int at)
{
  const int lane = at % JLAW_LANES;
  return law->facet + (size_t) (at - lane) * JLAW_COLUMNS + lane;
}
JL_IN const double *jl_cell_of(const jlaw_law *law, int at)
{
  const int lane = at % JLAW_LANES;
  return law->depth + (size_t) (at - lane) * (size_t) law->cells * JLAW_ROWS + lane;
}

/* ------------------------------------------------------------------- the virgin curve */

/* Effective closures below it count as zero: powers and squares of them underflow */
JL_IN jl_real jl_resolved(jl_real y) { return jl_only(jl_size_of(y) >= JLAW_UNDERFLOW, y); }

typedef struct { /* in the tables of the virgin curve: sqrt(y), and the place x in piece i */
  jl_real y, v, r, x;
  jl_whole i;
} jl_spot;

JL_IN jl_spot jl_spot_of(const jlaw_law *law, jl_real y)
{
  const double pieces = law->pieces;
  jl_spot at;
  at.y = jl_only(y > 0.0, y);
  at.v = jl_root(at.y);
  at.r = 1.0 / (at.v + law->scale);
  at.x = at.v * at.r * pieces;
  at.i = jl_to_whole(jl_smaller(at.x, jl_each(pieces - 1.0)));
  at.x = at.x - jl_to_real(at.i);
  return at;
}

/* x^p, zero at x = 0 */
JL_IN jl_real jl_raised(jl_real x, double p)
{
  for (int l = 0; l < JL_W; l++) JL_LANE(x, l) = JL_LANE(x, l) > 0.0 ? pow(JL_LANE(x, l), p) : 0.0;
  return x;
}

/* y^eta, zero at y = 0 */
JL_IN jl_real jl_power_of(const jlaw_law *law, const jl_spot *at)
{
  if (law->eta == 0.0) return jl_only(at->y > 0.0, jl_each(1.0));
  return law->eta == 0.5 ? at->v : jl_raised(at->y, law->eta);
}

/* Phi and Phi' at y, and Phi'' if asked for; zero where y <= 0 */
JL_IN void jl_virgin_curve(const jlaw_law *law, jl_real y, jl_real *force, jl_real *slope,
                           jl_real *bend)
{
  const double n = law->pieces, eta = law->eta;
  const jl_spot at = jl_spot_of(law, y);
  const jl_real x = at.x, ts = at.v * at.r * at.r * law->scale; /* t (1 - t) */
  jl_real c[4];
  jl_fetch(law->curve, at.i, c);
  jl_real S = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
  jl_real DS = 0.5 * n * ts * (c[1] + x * (2.0 * c[2] + x * (3.0 * c[3])));
  jl_real DDS = jl_each(0.0);
  if (bend)
    DDS = 0.25 * n * n * ts * ts * (2.0 * c[2] + x * (6.0 * c[3]))
          + 0.5 * (law->scale - at.v) * at.r * DS;
  if (law->rise > 0.0) {
    const jl_real w = at.y / (at.y + law->scale * law->scale), more = law->rise * (1.0 - w);
    const jl_real up = jl_raised(w, law->rise); /* the curve is tabulated over w^rise */
    DDS = up * (DDS + 2.0 * more * DS + more * (more - w) * S);
    DS = up * (DS + more * S);
    S = up * S;
  }
  const jl_real power = jl_power_of(law, &at);
  *force = power * at.y * S;
  *slope = power * ((1.0 + eta) * S + DS);
  if (bend)
    *bend =
        power / jl_pick(y > 0.0, y, 1.0) * (eta * (1.0 + eta) * S + (1.0 + 2.0 * eta) * DS + DDS);
}

/* Psi, the integral of Phi, at y */
JL_IN jl_real jl_psi(const jlaw_law *law, jl_real y)
{
  const jl_spot at = jl_spot_of(law, y);
  jl_real c[4];
  jl_fetch(law->energy, at.i, c);
  jl_real T = c[0] + at.x * (c[1] + at.x * (c[2] + at.x * c[3]));
  if (law->rise > 0.0) T = T * jl_raised(at.y / (at.y + law->scale * law->scale), law->rise);
  return jl_power_of(law, &at) * at.y * at.y * T;
}

/* Share G of a depth cell in Phi at y, and its slope kappa */
JL_IN void jl_share_of(const double *cell, jl_real y, jl_real force, jl_real slope, jl_real *G,
                       jl_real *kappa)
{
  const jl_real low = y - jl_column(cell, JLAW_LOW), high = y - jl_column(cell, JLAW_HIGH);
  const jl_of_facet end = jl_column(cell, JLAW_KAPPA);
  const jl_real k = jl_pick(high > 0.0, end, slope - jl_column(cell, JLAW_SLOPE));
  const jl_real g =
      jl_pick(high > 0.0, jl_column(cell, JLAW_G) + end * high,
              force - jl_column(cell, JLAW_FORCE) - jl_column(cell, JLAW_SLOPE) * low);
  *kappa = jl_only(low > 0.0, jl_larger(k, jl_each(0.0)));
  *G = jl_larger(jl_smaller(g, *kappa * low), jl_each(0.0));
}

/* -------------------------------------------------------------- asperities that yield */

/* G and kappa of a cell, less H, its G at the flattened depth z: "Yielding" */
JL_IN void jl_flatten(jl_real y, jl_real z, jl_real H, jl_real *G, jl_real *kappa)
{
  const jl_real over = y - z;
  *kappa = jl_only(over > 0.0, *kappa);
  *G = jl_larger(jl_smaller(*G - H, *kappa * over), jl_each(0.0));
}

/* G and kappa of a cell at y, of facets with the flattened depth z */
JL_IN void jl_hold_cell(const double *cell, jl_real y, jl_real f, jl_real k, jl_real z, jl_real fz,
                        jl_real kz, int yields, jl_real *G, jl_real *kappa)
{
  jl_real H, less;
  jl_share_of(cell, y, f, k, G, kappa);
  if (!yields) return;
  jl_share_of(cell, z, fz, kz, &H, &less);
  jl_flatten(y, z, H, G, kappa);
}

/* Phi less its value at the flattened depth */
JL_IN void jl_flatten_facets(jl_real y, jl_real z, jl_real less, jl_real *force, jl_real *slope)
{
  *force = jl_only(y > z, jl_larger(*force - less, jl_each(0.0)));
  *slope = jl_only(y > z, *slope);
}

/* Flattened depths of facets, before and after the step, and the virgin curve there */
JL_IN void jl_press(const jlaw_law *law, const double *f, jl_numbers n, int kept, int at, int some,
                    const jl_motion *m, jl_facets *o)
{
  const int M = law->facets, depth = jl_rest_row(law);
  jl_real y = o->y1;
  if (law->fades) /* one depth for a facet and its opposite */
    y = jl_larger(y, 2.0 * jl_column(f, JLAW_M) * m->to[0] - y);
  o->z0 = jl_take(n, depth + at, 1, some);
  o->z1 = jl_larger(y - jl_column(f, JLAW_YIELD), o->z0);
  if (kept) {
    o->fz0 = jl_take(n, kept + 2 * M + at, 1, some);
    o->kz0 = jl_take(n, kept + 3 * M + at, 1, some);
  } else jl_virgin_curve(law, o->z0, &o->fz0, &o->kz0, (jl_real *) 0);
  o->fz1 = o->fz0, o->kz1 = o->kz0;
  if (!jl_any(o->z1 > o->z0)) return;
  jl_virgin_curve(law, o->z1, &o->fz1, &o->kz1, (jl_real *) 0);
  jl_put(n, depth + at, 1, some, o->z1);
  if (kept) {
    jl_put(n, kept + 2 * M + at, 1, some, o->fz1);
    jl_put(n, kept + 3 * M + at, 1, some, o->kz1);
  }
}

/* Whether facets flatten themselves; else the opposite one does. Both do, but for rounding, where
 * the shear does not move them, as at a right angle to it. */
JL_IN jl_yes jl_flattens_itself(const double *f, const jl_facets *o)
{
  return o->y1 - jl_column(f, JLAW_YIELD) >= o->z1 - JLAW_ROUNDING_TOLERANCE * jl_size_of(o->y1);
}

/* Plastic work of facets over A c1: exact where they press themselves flat, else by the mean */
JL_IN jl_real jl_crush(const double *f, const jl_facets *o)
{
  const jl_of_facet most = jl_column(f, JLAW_YIELD);
  const jl_real c0 = jl_smaller(jl_larger(o->y0 - o->z0, jl_each(0.0)), jl_each(most));
  const jl_real c1 = jl_smaller(jl_larger(o->y1 - o->z1, jl_each(0.0)), jl_each(most));
  return jl_pick(jl_flattens_itself(f, o), jl_each(most), 0.5 * (c0 + c1)) * (o->fz1 - o->fz0);
}

/* --------------------------------------------------------------------- slopes that fade */

/* Offset, over the mating length, at the in-plane displacement p0, p1: "Mating" */
JL_IN jl_site jl_site_of(const jlaw_law *law, jl_of_joint p0, jl_of_joint p1)
{
  jl_site at;
  p0 = p0 / law->mating_length;
  p1 = p1 / law->mating_length;
  at.w = 1.0 / jl_root_joint(1.0 + (p0 * p0 + p1 * p1));
  at.o[0] = at.w * p0;
  at.o[1] = at.w * p1;
  return at;
}

/* Effective closure of facets at this closure, where this share of the slopes is left */
JL_IN jl_real jl_climb(const jlaw_law *law, const double *f, jl_of_joint closure, const jl_site *at,
                       jl_of_joint slopes)
{
  const jl_real rise = jl_column(f, JLAW_M + 1) * at->o[0] + jl_column(f, JLAW_M + 2) * at->o[1];
  return closure + slopes * law->mating_length * rise;
}

JL_IN jl_plane jl_plane_at(const double *f, const jl_site *at, jl_of_joint slopes)
{
  jl_plane s;
  s.x = jl_column(f, JLAW_E) * at->o[0] + jl_column(f, JLAW_E + 1) * at->o[1];
  s.z = jl_column(f, JLAW_E) * at->o[1] - jl_column(f, JLAW_E + 1) * at->o[0];
  const jl_real steep = slopes * at->w * jl_column(f, JLAW_STEEP);
  s.along = steep * (1.0 - s.x * s.x);
  s.across = -steep * s.x * s.z;
  s.m2 = 1.0 + s.along * s.along;
  s.N2 = s.m2 + s.across * s.across;
  const jl_real m = jl_root(s.m2), N = jl_root(s.N2);
  s.rmn = 1.0 / (m * N);
  s.rm = N * s.rmn;
  s.gamma = jl_column(f, JLAW_COSINE) * N;
  return s;
}

/* Components of a vector along e and across it, in the axes of the joint */
JL_IN void jl_to_axes(const double *f, jl_real *along, jl_real *across)
{
  const jl_real v1 = jl_column(f, JLAW_E) * *along - jl_column(f, JLAW_E + 1) * *across;
  *across = jl_column(f, JLAW_E + 1) * *along + jl_column(f, JLAW_E) * *across;
  *along = v1;
}

/* Derivative of the slopes by the displacement, both along the azimuth and across: ee, ez, zz */
JL_IN void jl_curvature(const jlaw_law *law, const double *f, const jl_plane *s, jl_of_joint w,
                        jl_of_joint slopes, jl_real h[3])
{
  const jl_real bend = -(slopes * w * w / law->mating_length) * jl_column(f, JLAW_STEEP);
  h[0] = bend * (3.0 * s->x * (1.0 - s->x * s->x));
  h[1] = bend * (s->z * (1.0 - 3.0 * s->x * s->x));
  h[2] = bend * (s->x * (1.0 - 3.0 * s->z * s->z));
}

/* The increment in the plane of facets at mid-step */
JL_IN void jl_move_in_plane(const double *f, const jl_motion *m, jl_facets *o)
{
  const jl_plane *s = &o->middle;
  const jl_real p1 = jl_each(0.0) + m->p[1], p2 = jl_each(0.0) + m->p[2];
  o->d0 = jl_each(0.0) + m->p[0];
  o->de = jl_column(f, JLAW_E) * p1 + jl_column(f, JLAW_E + 1) * p2;
  o->dz = jl_column(f, JLAW_E) * p2 - jl_column(f, JLAW_E + 1) * p1;
  o->es = (o->de - s->along * o->d0) * s->rm;
  o->et = (s->m2 * o->dz - s->across * (o->d0 + s->along * o->de)) * s->rmn;
}

/* F of facets in a plane: A Phi n and the sliders, in axes (1, e), then in those of the joint */
JL_IN void jl_traction_in(const jlaw_law *law, const double *f, const jl_plane *s, jl_real force,
                          jl_real qs, jl_real qt, jl_real F[3])
{
  const jl_real n = jl_column(f, JLAW_POTENTIAL) * force;
  qs = law->soft * s->rm * qs;
  qt = law->soft * s->rmn * qt;
  F[0] = n - (s->along * qs + s->across * qt);
  F[1] = n * s->along + (qs - s->along * s->across * qt);
  F[2] = n * s->across + s->m2 * qt;
  jl_to_axes(f, &F[1], &F[2]);
}

/* ------------------------------------------------------------------------------- wear */

/* Shares of the slopes that were left before the step, and are after the work of shear so far */
JL_IN void jl_wear_slopes(const jlaw_law *law, jl_numbers n, jl_motion *m)
{
  const int row = jl_worn_row(law);
  jl_of_joint worn = jl_take_joint(n, row);
  const jl_of_joint work = jl_take_joint(n, row + 1);
  m->had = 1.0 - worn;
  for (int l = 0; l < JL_JOINTS; l++) {
    const double now = (law->slope_residual - 1.0) * expm1(-JL_JOINT(work, l) / law->slope_wear);
    JL_JOINT(worn, l) = now > JL_JOINT(worn, l) ? now : JL_JOINT(worn, l);
  }
  m->has = 1.0 - worn;
  jl_put_joint(n, row, worn);
}

/* Slopes have worn: springs that part take their force along, and friction limits the rest. One
 * division for all: stiffnesses and forces below 1e-75 count as none. */
JL_IN void jl_wear_sliders(const double *cell, jl_facets *o, const jl_sliders *c, jl_real *qs,
                           jl_real *qt, jl_kind k)
{
  jl_real G, kappa;
  jl_hold_cell(cell, o->yw, o->fw, o->kw, o->z0, o->fz0, o->kz0, k.yields, &G, &kappa);
  const jl_real q2 = *qs * *qs + *qt * *qt, cap2 = o->limit2 * (c->G0 * c->G0);
  const jl_yes had = kappa * kappa > JLAW_MIN_STIFFNESS_PRODUCT;
  const jl_yes has = c->k0 * c->k0 > JLAW_MIN_STIFFNESS_PRODUCT;
  const jl_real a = jl_pick(had, kappa, 1.0), b = jl_pick(has, c->k0, 1.0);
  const jl_real Q = jl_pick(q2 > JLAW_MIN_STIFFNESS_PRODUCT, q2, 1.0);
  const jl_real r = 1.0 / (a * b * Q), was = jl_only(had, b * Q * r), is = jl_only(has, a * Q * r);
  jl_real share = jl_pick(kappa > c->k0, c->k0 * was, 1.0);
  const jl_yes beyond = share * share * q2 > cap2;
  share = jl_pick(beyond, jl_root(cap2 * (a * b * r)), share);
  o->worn += q2 * (was - share * share * is);
  *qs = share * *qs;
  *qt = share * *qt;
}

/* ------------------------------------------------------------ what a state amounts to */

typedef struct { /* as element.Measures; of the stored energy that of the shear springs */
  jl_of_joint sliding, slipping, separated, stored, reach, sheared;
} jl_amounts;

typedef struct {
  jl_real sliding, slipping, separated, normal, sheared;
} jl_amount_sums;

JL_IN jl_amount_sums jl_no_amounts(void)
{
  const jl_amount_sums none = {jl_each(0.0), jl_each(0.0), jl_each(0.0), jl_each(0.0),
                               jl_each(0.0)};
  return none;
}

/* Facets from number `at` on, as jl_facets_now leaves them */
JL_IN void jl_measure_facets(const jlaw_law *law, jl_numbers n, int at, const jl_facets *o,
                             jl_amount_sums *sum)
{
  const int M = law->facets, D = law->cells, some = M - at < JL_TOGETHER ? M - at : JL_TOGETHER;
  const double *f = jl_facet_of(law, at), *cell = jl_cell_of(law, at);
  jl_real held = jl_each(0.0), sheared = held, slips = jl_each(1.0); /* G of cells at their limit */
  for (int i = 0; i < D && jl_any(o->y1 > jl_column(cell, JLAW_LOW)); i++) {
    jl_real G, kappa;
    const int row = jl_slider_row(law) + at * D + i;
    const jl_real qs = jl_take(n, row, D, some), qt = jl_take(n, row + M * D, D, some);
    const jl_real q2 = qs * qs + qt * qt;
    jl_hold_cell(cell, o->y1, o->f1, o->k1, o->z1, o->fz1, o->kz1, law->yields, &G, &kappa);
    const jl_yes stiff = kappa > JLAW_MIN_DIVISOR;
    const jl_yes limited =
        jl_root(q2) >= o->strength
                           * (G * (1.0 - JLAW_FRICTION_TOLERANCE)
                              - JLAW_ROUNDING_TOLERANCE * o->f1);
    held += jl_only(limited, G);
    slips = jl_only(limited, slips);
    sheared += jl_only(stiff, q2 / jl_pick(stiff, kappa, 1.0));
    cell += JLAW_ROWS * JLAW_LANES;
  }
  const jl_yes touches = o->y1 > o->z1;
  const jl_real force = jl_only(touches, jl_larger(o->f1 - o->fz1, jl_each(0.0))),
                share = jl_each(jl_column(f, JLAW_SHARE));
  const jl_real part = jl_only(force > 0.0, held / jl_pick(force > 0.0, force, 1.0));
  sum->sliding += share * jl_only(touches, slips);
  sum->slipping += share * jl_smaller(part, jl_each(1.0));
  sum->separated += share * jl_pick(touches, 0.0, 1.0);
  jl_real normal = jl_psi(law, o->y1);
  if (law->yields) normal = normal - jl_psi(law, o->z1) - o->fz1 * (o->y1 - o->z1);
  sum->normal += jl_column(f, JLAW_POTENTIAL) * jl_only(touches, jl_larger(normal, jl_each(0.0)));
  sum->sheared += jl_column(f, JLAW_COMPLIANCE) * sheared;
}

/* --------------------------------------------------------------------------- one step */

/* G and kappa of a cell before and after the step. What G gains is taken from the virgin curve: the
 * bounds of jl_flatten would show in it where that curve is small and hardly convex. */
JL_IN void jl_cells_of(const double *cell, const jl_facets *o, jl_sliders *c, int yields)
{
  jl_share_of(cell, o->y0, o->f0, o->k0, &c->G0, &c->k0);
  jl_share_of(cell, o->y1, o->f1, o->k1, &c->G1, &c->k1);
  c->gained = c->G1 - c->G0;
  c->kz1 = jl_each(0.0);
  if (!yields) return;
  jl_real H0, H1, kz0;
  jl_share_of(cell, o->z0, o->fz0, o->kz0, &H0, &kz0);
  jl_share_of(cell, o->z1, o->fz1, o->kz1, &H1, &c->kz1);
  c->gained = c->G1 - jl_larger(c->G0, H0);
  jl_flatten(o->y0, o->z0, H0, &c->G0, &c->k0);
  jl_flatten(o->y1, o->z1, H1, &c->G1, &c->k1);
}

/* Trial force: loaded by the chord of G where kappa grows; where kappa falls, the springs that part
 * take their force along. Then the friction limit, |q| <= mu lam A G. */
JL_IN void jl_load(const double *f, const jl_facets *o, jl_sliders *c, jl_real *qs, jl_real *qt,
                   jl_kind k)
{
  jl_yes near = o->near;
  if (k.yields) near = near & ((c->k0 > 0.0) | (c->k1 <= 0.0)); /* flattened ones touch together */
  const jl_real mean = jl_pick(near, 0.5 * (c->k0 + c->k1), c->gained * o->rdy);
  c->chord = jl_smaller(jl_larger(mean, c->k0), c->k1); /* k1 where it falls */
  c->old2 = *qs * *qs + *qt * *qt;
  const jl_yes falls = c->k1 < c->k0;
  const jl_real kept = jl_pick(falls, c->k1 / jl_pick(falls, c->k0, 1.0), 1.0);
  *qs = *qs * kept;
  *qt = *qt * kept;
  const jl_real add = jl_column(f, JLAW_STIFF) * c->chord;
  c->ts = *qs + add * o->es;
  c->tt = *qt + add * o->et;
  c->new2 = c->ts * c->ts + c->tt * c->tt;
  c->cap = c->strength * c->G1;
  c->slips = c->new2 > c->cap * c->cap;
  c->unit = jl_each(0.0);
  c->share = jl_each(1.0);
  if (k.tangent || jl_somewhere(c->slips)) {
    c->unit = jl_only(c->new2 > JLAW_MIN_DIVISOR, 1.0 / jl_root(c->new2));
    c->share = jl_pick(c->slips, jl_smaller(c->cap * c->unit, jl_each(1.0)), 1.0);
  }
  const jl_real part =
      jl_only(c->new2 > JLAW_MIN_DIVISOR, c->share); /* squares of smaller forces underflow */
  *qs = part * c->ts;
  *qt = part * c->tt;
}

/* What sliders, and springs that part under shear, lose: every term is >= 0 as written */
JL_IN jl_real jl_friction_loss(const jl_sliders *c)
{
  const jl_real high = jl_larger(c->chord, c->k0), low = jl_smaller(c->k0, c->k1);
  const jl_real a = c->k0 * high, b = c->k1 * c->chord;
  const jl_real A = jl_pick(a > JLAW_MIN_STIFFNESS_PRODUCT, a, 1.0);
  const jl_real B = jl_pick(b > JLAW_MIN_STIFFNESS_PRODUCT, b, 1.0);
  const jl_real r = 1.0 / (A * B); /* one division for both */
  const jl_real rub = c->share * (c->share * (c->k1 - c->chord) + 2.0 * (1.0 - c->share) * c->k1);
  return jl_only(a > JLAW_MIN_STIFFNESS_PRODUCT, c->old2 * ((high - low) * (B * r)))
         + jl_only(b > JLAW_MIN_STIFFNESS_PRODUCT, c->new2 * (rub * (A * r)));
}

/* "The tangent": J_q = beta (I - s s^T) E + v g^T of sliders */
JL_IN void jl_slide_tangent(const double *f, const double *cell, const jl_sliders *c, jl_facets *o,
                            jl_kind k)
{
  const jl_of_facet a = jl_column(f, JLAW_STIFF);
  const jl_of_facet begin = jl_column(cell, JLAW_LOW), end = jl_column(cell, JLAW_HIGH);
  const jl_yes inside = (o->y1 > begin) & (o->y1 < end);
  const jl_real bend = jl_only(inside, o->bend);
  jl_yes near = o->near;
  if (k.yields) near = near & ((c->k0 > 0.0) | (c->k1 <= 0.0));
  const jl_real chord1 = jl_pick(near, 0.5 * bend, (c->k1 - c->chord) * o->rdy);
  const jl_yes stiff = c->k1 > JLAW_MIN_DIVISOR;
  const jl_real fade = jl_only(stiff, bend / jl_pick(stiff, c->k1, 1.0));
  /* rounding must not decide: what did not close has not grown, what is at its limit slips */
  const jl_yes stiffer = (c->k1 > c->k0) & (o->dy > JLAW_ROUNDING_TOLERANCE * jl_size_of(o->y1));
  const jl_real least = c->strength
                        * (c->G1 * (1.0 - JLAW_FRICTION_TOLERANCE)
                           - JLAW_ROUNDING_TOLERANCE * o->f1);
  const jl_yes limited = c->new2 >= jl_larger(least, jl_each(0.0)) * jl_larger(least, jl_each(0.0));
  const jl_real vs = jl_pick(stiffer, a * chord1 * o->es, fade * c->ts);
  const jl_real vt = jl_pick(stiffer, a * chord1 * o->et, fade * c->tt);
  const jl_real us = c->ts * c->unit, ut = c->tt * c->unit;
  const jl_real dot = us * vs + ut * vt, push = c->strength * c->k1;
  const jl_real beta = jl_only(c->cap > 0.0, c->share * (a * c->chord)),
                along = jl_only(limited, beta);
  o->vs += jl_pick(limited, c->share * (vs - us * dot) + push * us, vs);
  o->vt += jl_pick(limited, c->share * (vt - ut * dot) + push * ut, vt);
  o->bss += beta - along * us * us;
  o->bst -= along * us * ut;
  o->btt += beta - along * ut * ut;
  if (k.fades) {
    const jl_real by_gamma = jl_only(limited, c->strength * c->G1);
    o->gs += by_gamma * us;
    o->gt += by_gamma * ut;
  }
  if (k.yields) {
    const jl_yes pulls = limited & (c->k1 > 0.0);
    const jl_real pull = c->strength * jl_only(pulls, c->kz1);
    o->ws += pull * us;
    o->wt += pull * ut;
    o->open += c->k1;
  }
}

/* One depth cell of facets: from the sliders before the step to those after it */
JL_IN void jl_slide(const double *f, const double *cell, jl_facets *o, jl_real *qs, jl_real *qt,
                    jl_kind k)
{
  jl_sliders c;
  jl_cells_of(cell, o, &c, k.yields);
  c.strength = o->strength;
  if (k.wears) {
    jl_wear_sliders(cell, o, &c, qs, qt, k);
    o->us += *qs;
    o->ut += *qt;
  }
  jl_load(f, o, &c, qs, qt, k);
  o->qs += *qs;
  o->qt += *qt;
  if (k.ledger) o->lost += jl_friction_loss(&c);
  if (k.tangent) jl_slide_tangent(f, cell, &c, o, k);
}

/* C += along g^T + E^T B E of facets; where the flattened depth moves, less softening g_z^T */
JL_IN void jl_add_tangent(const jlaw_law *law, const double *f, const jl_facets *o, jl_sums *sum,
                          jl_kind k)
{
  const jl_yes moves = (o->z1 - o->z0 > JLAW_ROUNDING_TOLERANCE * o->z1) & (o->open > 0.0);
  const jl_yes own = jl_flattens_itself(f, o);
  for (int i = 0; i < k.dim; i++) {
    const jl_of_facet n = jl_column(f, JLAW_N + i) * jl_column(f, JLAW_A);
    const jl_of_facet s = jl_column(f, JLAW_S + i) * law->soft,
                      t = jl_column(f, JLAW_T + i) * law->soft;
    const jl_real along = n * o->k1 + s * o->vs + t * o->vt;
    const jl_real left = s * o->bss + t * o->bst, right = s * o->bst + t * o->btt;
    for (int j = 0; j < k.dim; j++) {
      const jl_real g = jl_each(jl_column(f, JLAW_M + j)); /* dy/dd */
      jl_real to = along * g + left * jl_column(f, JLAW_S + j) + right * jl_column(f, JLAW_T + j);
      if (k.yields) {
        const jl_real less = jl_only(moves, n * o->kz1 + s * o->ws + t * o->wt);
        to -= j > 0 ? less * jl_pick(own, g, -g) : less * g;
      }
      sum->C[3 * i + j] += to;
    }
  }
}

/* The same where slopes fade, and with them planes turn and friction limits fall: worked out in
 * axes (1, e), then turned. E: derivative of the increment in the plane; A, B: of the sliders'
 * force by the slopes along and across; h: of these by the displacement. */
JL_IN void jl_add_fading_tangent(const jlaw_law *law, const double *f, const jl_motion *m,
                                 const jl_facets *o, jl_sums *sum, jl_kind k)
{
  const jl_yes moves = (o->z1 - o->z0 > JLAW_ROUNDING_TOLERANCE * o->z1) & (o->open > 0.0);
  const jl_yes own = jl_flattens_itself(f, o);
  const jl_plane *s = &o->end, *r = &o->middle;
  const jl_real soft = jl_each(law->soft), none = jl_each(0.0),
                n = jl_each(jl_column(f, JLAW_POTENTIAL));
  jl_real h[3], H[3], C[3][3]; /* ee, ez, zz */
  jl_curvature(law, f, s, m->end.w, m->has, h);
  jl_curvature(law, f, r, m->middle.w, m->has, H);
  const jl_real turn = 0.5 * (o->d0 + r->along * o->de), et = 0.5 * o->et;
  const jl_real rm2 = 1.0 / r->m2, rN2 = 1.0 / r->N2;
  const jl_real ea = -turn * (rm2 * r->rm), eb = -(turn * r->rmn + et * r->across * rN2);
  const jl_real ta =
      (r->along * o->dz - 0.5 * r->across * o->de) * r->rmn - et * r->along * (rm2 + rN2);
  const jl_real Es[3] = {-r->along * r->rm, r->rm + ea * H[0], ea * H[1]};
  const jl_real Et[3] = {-r->across * r->rmn,
                         -r->along * r->across * r->rmn + ta * H[0] + eb * H[1],
                         r->m2 * r->rmn + ta * H[1] + eb * H[2]};
  const jl_real cs[3] = {-s->along * s->rm, s->rm, none};
  const jl_real ct[3] = {-s->across * s->rmn, -s->along * s->across * s->rmn, s->m2 * s->rmn};
  const jl_real rM2 = 1.0 / s->m2, rn2 = 1.0 / s->N2, rm3 = rM2 * s->rm;
  const jl_real qa = o->qs * rm3, qt = o->qt * s->rmn, fall = s->along * (rM2 + rn2);
  const jl_real A[3] = {-qa - o->qt * ct[0] * fall,
                        -s->along * qa - s->across * qt - o->qt * ct[1] * fall,
                        2.0 * s->along * qt - o->qt * ct[2] * fall};
  const jl_real down = o->qt * s->across * rn2;
  const jl_real B[3] = {-qt - down * ct[0], -s->along * qt - down * ct[1], -down * ct[2]};
  const jl_real ga = s->along * rn2, gb = s->across * rn2; /* of log(gamma) */
  const jl_real g[3] = {jl_each(1.0), s->along, s->across};
  for (int j = 0; j < 3; j++) {
    const jl_real ha = j ? h[j - 1] : none, hb = j ? h[j] : none, gamma = ga * ha + gb * hb;
    const jl_real us = o->vs * g[j] + o->bss * Es[j] + o->bst * Et[j] + o->gs * gamma;
    const jl_real ut = o->vt * g[j] + o->bst * Es[j] + o->btt * Et[j] + o->gt * gamma;
    const jl_real pressing = k.yields ? jl_only(moves, j ? jl_pick(own, g[j], -g[j]) : g[j]) : none;
    for (int i = 0; i < 3; i++) {
      const jl_real bend = i == 1 ? ha : i == 2 ? hb : none;
      C[i][j] = n * (o->k1 * g[i] * g[j] + o->f1 * bend)
                + soft * (cs[i] * us + ct[i] * ut + (A[i] * ha + B[i] * hb));
      if (k.yields)
        C[i][j] -= pressing * (n * g[i] * o->kz1 + soft * (cs[i] * o->ws + ct[i] * o->wt));
    }
  }
  for (int i = 0; i < 3; i++) jl_to_axes(f, &C[i][1], &C[i][2]);
  for (int j = 0; j < 3; j++) jl_to_axes(f, &C[1][j], &C[2][j]);
  for (int i = 0; i < k.dim; i++)
    for (int j = 0; j < k.dim; j++) sum->C[3 * i + j] += C[i][j];
}

/* Facets from number `at` on: closures, virgin curve, sliders, and their part of F and C; and, where
 * `seen` is given, of what the state then amounts to */
JL_IN void jl_step_facets(const jlaw_law *law, int at, const jl_motion *m, jl_numbers n,
                          jl_sums *sum, jl_kind k, jl_amount_sums *seen)
{
  const int M = law->facets, D = law->cells, some = M - at < JL_TOGETHER ? M - at : JL_TOGETHER;
  const int kept = k.kept ? jl_state_rows(law) : 0;
  const double *f = jl_facet_of(law, at), *cell = jl_cell_of(law, at);
  jl_facets o;
  o.y0 = o.y1 = o.es = o.et = o.bend = o.limit2 = o.fw = o.kw = jl_each(0.0);
  for (int i = 0; i < k.dim && !k.fades; i++) {
    o.y0 += jl_column(f, JLAW_M + i) * m->from[i];
    o.y1 += jl_column(f, JLAW_M + i) * m->to[i];
    o.es += jl_column(f, JLAW_S + i) * m->p[i];
    if (i > 0) o.et += jl_column(f, JLAW_T + i) * m->p[i];
  }
  if (k.fades) {
    o.y0 = jl_climb(law, f, m->from[0], &m->start, m->has);
    o.y1 = jl_climb(law, f, m->to[0], &m->end, m->has);
  }
  o.yw = k.wears ? jl_resolved(jl_climb(law, f, m->from[0], &m->start, m->had)) : o.y0;
  if (!k.yields && !jl_any((o.y0 > 0.0) | (o.y1 > 0.0) | (o.yw > 0.0))) {
    if (seen) seen->separated += jl_column(f, JLAW_SHARE);
    return; /* apart: holds zero */
  }
  if (k.fades) {
    o.middle = jl_plane_at(f, &m->middle, m->has);
    o.end = jl_plane_at(f, &m->end, m->has);
    jl_move_in_plane(f, m, &o);
  }
  const jl_of_facet limit = jl_column(f, JLAW_STRENGTH) * jl_column(f, JLAW_COSINE);
  jl_plane start;
  if (k.wears) {
    start = jl_plane_at(f, &m->start, m->has);
    o.limit2 = limit * limit * start.N2;
  }
  o.y0 = jl_resolved(o.y0);
  o.y1 = jl_resolved(o.y1);
  o.dy = o.y1 - o.y0;
  o.rdy = 1.0 / o.dy;
  o.near = jl_size_of(o.dy) <= JLAW_MIN_CHORD_STEP * jl_size_of(o.y1);
  o.qs = o.qt = o.lost = o.vs = o.vt = o.bss = o.bst = o.btt = o.ws = o.wt = o.open = jl_each(0.0);
  o.gs = o.gt = o.us = o.ut = o.worn = jl_each(0.0);
  if (k.kept) {
    o.f0 = jl_take(n, kept + at, 1, some);
    o.k0 = jl_take(n, kept + M + at, 1, some);
  } else jl_virgin_curve(law, o.yw, &o.f0, &o.k0, (jl_real *) 0);
  if (k.wears) {
    o.fw = o.f0, o.kw = o.k0;
    if (jl_somewhere(o.y0 != o.yw)) jl_virgin_curve(law, o.y0, &o.f0, &o.k0, (jl_real *) 0);
  }
  jl_virgin_curve(law, o.y1, &o.f1, &o.k1, k.tangent ? &o.bend : (jl_real *) 0);
  if (k.kept) {
    jl_put(n, kept + at, 1, some, o.f1);
    jl_put(n, kept + M + at, 1, some, o.k1);
  }
  o.z0 = o.z1 = o.fz0 = o.fz1 = o.kz0 = o.kz1 = jl_each(0.0);
  if (k.yields) jl_press(law, f, n, kept, at, some, m, &o);
  o.strength = jl_each(jl_column(f, JLAW_STRENGTH));
  if (k.fades) o.strength = o.strength * o.end.gamma;
  for (int i = 0; i < D; i++, cell += JLAW_ROWS * JLAW_LANES) {
    const jl_of_facet low = jl_column(cell, JLAW_LOW);
    if (!jl_any((o.y0 > low) | (o.y1 > low) | (o.yw > low))) break; /* nor does what is deeper */
    const int row = k.dim + 1 + at * D + i;
    jl_real qs = jl_take(n, row, D, some), qt = jl_take(n, row + M * D, D, some);
    jl_slide(f, cell, &o, &qs, &qt, k);
    jl_put(n, row, D, some, qs);
    jl_put(n, row + M * D, D, some, qt);
  }
  if (seen) jl_measure_facets(law, n, at, &o, seen);
  if (k.yields) {
    sum->crushed += jl_column(f, JLAW_POTENTIAL) * jl_crush(f, &o);
    if (k.wears) jl_flatten_facets(o.yw, o.z0, o.fz0, &o.fw, &o.kw);
    jl_flatten_facets(o.y0, o.z0, o.fz0, &o.f0, &o.k0);
    jl_flatten_facets(o.y1, o.z1, o.fz1, &o.f1, &o.k1);
  }
  if (k.ledger) sum->lost += jl_column(f, JLAW_COMPLIANCE) * o.lost;
  if (k.wears) {
    sum->worn += jl_column(f, JLAW_COMPLIANCE) * o.worn;
    sum->lowered += 0.5 * jl_column(f, JLAW_POTENTIAL) * ((o.fw + o.f0) * (o.yw - o.y0));
    jl_real F[3];
    jl_traction_in(law, f, &start, o.f0, o.us, o.ut, F);
    sum->before[0] += F[1], sum->before[1] += F[2];
  }
  if (k.fades) {
    jl_real F[3];
    jl_traction_in(law, f, &o.end, o.f1, o.qs, o.qt, F);
    for (int i = 0; i < k.dim; i++) sum->F[i] += F[i];
    if (k.tangent) jl_add_fading_tangent(law, f, m, &o, sum, k);
    return;
  }
  const jl_real normal = jl_column(f, JLAW_A) * o.f1, qs = law->soft * o.qs, qt = law->soft * o.qt;
  for (int i = 0; i < k.dim; i++) {
    const jl_real pull = jl_column(f, JLAW_N + i) * normal;
    sum->F[i] += pull + (jl_column(f, JLAW_S + i) * qs + jl_column(f, JLAW_T + i) * qt);
  }
  if (k.tangent) jl_add_tangent(law, f, &o, sum, k);
}

/* Amounts of joints from the sums over their facets */
JL_IN void jl_add_up(const jl_amount_sums *sum, jl_amounts *all)
{
  all->sliding = jl_total(sum, sliding);
  all->slipping = jl_total(sum, slipping);
  all->separated = jl_total(sum, separated);
  all->sheared = jl_total(sum, sheared);
  all->stored = jl_total(sum, normal) + all->sheared;
}

/* Advance joints by the increments d: their numbers n, F (dim), and C (dim, dim) for a tangent; what
 * they then amount to, but for `reach`, where `all` is given */
JL_IN void jl_step(const jlaw_law *law, jl_numbers n, const jl_of_joint d[3], jl_of_joint F[3],
                   jl_of_joint C[9], jl_kind k, jl_amounts *all)
{
  const int dim = k.dim, M = law->facets, rest = jl_rest_row(law);
  jl_motion m;
  jl_sums sum[JL_SUMS];
  for (int i = 0; i < 3; i++) {
    m.p[i] = i < dim ? d[i] : jl_each_joint(0.0);
    m.from[i] = i < dim ? jl_take_joint(n, i) : jl_each_joint(0.0);
    m.to[i] = m.from[i] + m.p[i];
  }
  m.had = m.has = jl_each_joint(1.0);
  if (k.wears) jl_wear_slopes(law, n, &m);
  if (k.fades) {
    m.start = jl_site_of(law, m.from[1], m.from[2]);
    m.middle = jl_site_of(law, m.from[1] + 0.5 * m.p[1], m.from[2] + 0.5 * m.p[2]);
    m.end = jl_site_of(law, m.to[1], m.to[2]);
  }
  for (int i = 0; i < JL_SUMS; i++) {
    for (int j = 0; j < 3; j++) sum[i].F[j] = jl_each(0.0);
    for (int j = 0; k.tangent && j < 9; j++) sum[i].C[j] = jl_each(0.0);
    sum[i].lost = sum[i].crushed = sum[i].lowered = sum[i].worn = jl_each(0.0);
    sum[i].before[0] = sum[i].before[1] = jl_each(0.0);
  }
  jl_amount_sums seen[JL_SUMS];
  for (int i = 0; all && i < JL_SUMS; i++) seen[i] = jl_no_amounts();
  for (int at = 0; at < M; at += JL_TOGETHER) {
    const int i = at / JL_TOGETHER % JL_SUMS;
    jl_step_facets(law, at, &m, n, sum + i, k, all ? seen + i : (jl_amount_sums *) 0);
  }
  if (all) jl_add_up(seen, all);
  for (int i = 0; i < dim; i++) {
    F[i] = jl_total(sum, F[i]);
    for (int j = 0; k.tangent && j < dim; j++) C[dim * i + j] = jl_total(sum, C[3 * i + j]);
    jl_put_joint(n, i, m.to[i]);
  }
  if (!k.ledger) return;
  jl_of_joint lost = jl_total(sum, lost);
  if (k.wears) {
    jl_of_joint lowered = jl_total(sum, lowered), work = jl_each_joint(0.0);
    for (int i = 1; i < dim; i++) work += 0.5 * (jl_total(sum, before[i - 1]) + F[i]) * m.p[i];
    for (int l = 0; l < JL_JOINTS; l++) { /* what wears is work of the joint's own shear */
      const double shear = fabs(JL_JOINT(work, l)), rubbed = JL_JOINT(lost, l);
      JL_JOINT(work, l) = shear < rubbed ? shear : rubbed;
      /* >= 0 by the pairs of facets, but for rounding */
      JL_JOINT(lowered, l) = JL_JOINT(lowered, l) > 0.0 ? JL_JOINT(lowered, l) : 0.0;
    }
    jl_put_joint(n, jl_worn_row(law) + 1, jl_take_joint(n, jl_worn_row(law) + 1) + work);
    lost += jl_total(sum, worn) + lowered;
  }
  if (k.yields) {
    const jl_of_joint crushed = jl_total(sum, crushed);
    jl_put_joint(n, rest + M, jl_take_joint(n, rest + M) + crushed);
    lost += crushed;
  }
  jl_put_joint(n, dim, jl_take_joint(n, dim) + lost);
}

/* ------------------------------------------------------------------ what a state is */

/* Facets from number `at` on in a state: y, z, and the virgin curve there as in y1 and z1; the
 * friction limit of q over G */
JL_IN void jl_facets_now(const jlaw_law *law, jl_numbers n, int at, jl_facets *o)
{
  const int some = law->facets - at < JL_TOGETHER ? law->facets - at : JL_TOGETHER;
  const double *f = jl_facet_of(law, at);
  jl_of_joint slopes = jl_each_joint(1.0), to[3];
  for (int i = 0; i < 3; i++) to[i] = i < law->dim ? jl_take_joint(n, i) : jl_each_joint(0.0);
  if (law->wears) slopes = 1.0 - jl_take_joint(n, jl_worn_row(law));
  o->y1 = o->z1 = o->fz1 = o->kz1 = jl_each(0.0);
  o->strength = jl_each(jl_column(f, JLAW_STRENGTH));
  for (int i = 0; i < law->dim && !law->fades; i++) o->y1 += jl_column(f, JLAW_M + i) * to[i];
  if (law->fades) {
    const jl_site here = jl_site_of(law, to[1], to[2]);
    o->y1 = jl_climb(law, f, to[0], &here, slopes);
    o->strength = o->strength * jl_plane_at(f, &here, slopes).gamma;
  }
  o->y1 = jl_resolved(o->y1);
  jl_virgin_curve(law, o->y1, &o->f1, &o->k1, (jl_real *) 0);
  if (!law->yields) return;
  o->z1 = jl_take(n, jl_rest_row(law) + at, 1, some);
  jl_virgin_curve(law, o->z1, &o->fz1, &o->kz1, (jl_real *) 0);
}

/* Adds what the elements beside the asperities, or in place of them, amount to */
JL_IN void jl_add_elements(const jlaw_law *law, jl_numbers n, jl_of_joint stored, jl_amounts *all)
{
  all->stored += stored;
  for (int l = 0; law->coulomb && l < JL_JOINTS; l++) {
    double shares[3];
    jl_coulomb_shares(law, n.s + l, n.stride, shares);
    JL_JOINT(all->sliding, l) = shares[0], JL_JOINT(all->slipping, l) = shares[1];
    JL_JOINT(all->separated, l) = shares[2], JL_JOINT(all->reach, l) = n.s[l];
  }
}

JL_IN jl_amounts jl_measure(const jlaw_law *law, jl_numbers n)
{
  const int M = law->facets;
  jl_amount_sums sum[JL_SUMS];
  jl_amounts all;
  all.reach = jl_each_joint(-DBL_MAX);
  for (int i = 0; i < JL_SUMS; i++) sum[i] = jl_no_amounts();
  for (int at = 0; at < M; at += JL_TOGETHER) {
    jl_facets o;
    jl_facets_now(law, n, at, &o);
    jl_measure_facets(law, n, at, &o, sum + at / JL_TOGETHER % JL_SUMS);
#ifdef JLAW_ABREAST
    for (int l = 0; l < JL_TOGETHER && at + l < M; l++)
      all.reach = all.reach > o.y1[l] ? all.reach : o.y1[l];
#else
    all.reach = jl_larger(all.reach, o.y1);
#endif
  }
  jl_add_up(sum, &all);
  if (!jl_element_rows(law)) return all;
  jl_of_joint here[3], still[3];
  for (int i = 0; i < law->dim; i++) here[i] = jl_take_joint(n, i), still[i] = jl_each_joint(0.0);
  const jl_of_joint stored =
      jl_step_elements(law, n, jl_element_row(law), here, still, NULL, NULL, 0, 0);
  jl_add_elements(law, n, stored, &all);
  return all;
}

/* Bound of |C| over A/c1 of a facet with this Phi', less what slopes that fade add */
JL_IN jl_real jl_stiffness_over(const jlaw_law *law, jl_real slope)
{
  const double stick = law->soft > 1.0 ? law->soft : 1.0;
  const jl_real joins = jl_smaller(law->joining_more * slope, jl_each(law->joining_most));
  return (stick + law->mu) * slope + law->mu * joins;
}

/* Bound of |C| (Pa/m) of joints as they are */
JL_IN jl_of_joint jl_stiffness(const jlaw_law *law, jl_numbers n)
{
  const double turn = JLAW_MAX_OFFSET_CURVATURE / law->mating_length;
  struct {
    jl_real bound;
  } sum[JL_SUMS];
  for (int i = 0; i < JL_SUMS; i++) sum[i].bound = jl_each(0.0);
  for (int at = 0; at < law->facets; at += JL_TOGETHER) {
    const double *f = jl_facet_of(law, at);
    const jl_of_facet c1 = jl_column(f, JLAW_COSINE);
    jl_facets o;
    jl_facets_now(law, n, at, &o);
    jl_real bound = jl_column(f, JLAW_STIFF) * jl_stiffness_over(law, o.k1);
    if (law->fades)
      bound += turn * jl_column(f, JLAW_A) * jl_column(f, JLAW_STEEP) * (c1 + law->mu * (1.0 + c1))
               * o.f1;
    sum[at / JL_TOGETHER % JL_SUMS].bound += bound;
  }
  jl_of_joint bound = jl_total(sum, bound);
  for (int l = 0; l < JL_JOINTS; l++)
    JL_JOINT(bound, l) += jl_stiffness_of_elements(law, n.s + l, jl_element_row(law), n.stride);
  return bound;
}

/* ------------------------------------------------------------- kinds of a step */

/* The step, compiled for each kind. A plane costs half of space; a tangent, a ledger or `all` that is
 * not asked for costs nothing. Where asperities yield or slopes wear, the law needs the ledger.
 * Batches (JL_BATCH) have each kind with a ledger and without one, kinds of their own for slopes that
 * wear, and a function for each: compilers find registers for one kind at a time. The header has
 * fewer kinds, for the memory that compiling takes, and never asks for `all`. */
#ifdef JL_BATCH
#define JL_OF_KIND static __attribute__((noinline))
#else
#define JL_BATCH 0
#define JL_OF_KIND JL_IN
#endif
#define JL_STEP_AS(name, tangent, seen, ...)                                                \
  JL_OF_KIND void jl_step_##name(const jlaw_law *law, jl_numbers n, const jl_of_joint d[3], \
                                 jl_of_joint F[3], jl_of_joint C[9], int ledger, int kept,  \
                                 jl_amounts *all)                                           \
  {                                                                                         \
    const jl_kind plain = {__VA_ARGS__, tangent, 0, kept};                                  \
    const jl_kind k = {__VA_ARGS__, tangent, JL_BATCH || ledger, kept};                     \
    if (!(seen)) all = NULL;                                                                \
    if (JL_BATCH && !ledger && !k.wears) jl_step(law, n, d, F, C, plain, all);              \
    else jl_step(law, n, d, F, C, k, all);                                                  \
  }
#define JL_KIND(name, ...)                   \
  JL_STEP_AS(name, 0, 0, __VA_ARGS__)        \
  JL_STEP_AS(name##_seen, 0, 1, __VA_ARGS__) \
  JL_STEP_AS(name##_C, 1, 0, __VA_ARGS__)
JL_KIND(plane, 2, 0, 0, 0)
JL_KIND(plane_fades, 2, 0, 1, 0)
JL_KIND(plane_wears, 2, 0, 1, 1)
JL_KIND(space, 3, 0, 0, 0)
JL_KIND(space_fades, 3, 0, 1, 0)
JL_KIND(space_wears, 3, 0, 1, 1)
JL_KIND(rare, law->dim, law->yields, 0, 0) /* asperities yield, or closure only */
JL_KIND(rare_fades, law->dim, law->yields, 1, law->wears)

/* What joints then amount to is asked for by `all`, not together with a tangent */
JL_IN void jl_step_of_kind(const jlaw_law *law, jl_numbers n, const jl_of_joint d[3],
                           jl_of_joint F[3], jl_of_joint C[9], int ledger, int tangent, int kept,
                           jl_amounts *all)
{
  const int dim = law->dim, y = law->yields, w = law->wears;
  jl_of_joint from[3];
  for (int i = 0; i < dim; i++) from[i] = jl_take_joint(n, i);
  ledger = ledger || y || w;
#define JL_STEP(name)                                                        \
  {                                                                          \
    if (tangent) jl_step_##name##_C(law, n, d, F, C, ledger, kept, all);     \
    else if (JL_BATCH && all)                                                \
      jl_step_##name##_seen(law, n, d, F, C, ledger, kept, all);             \
    else jl_step_##name(law, n, d, F, C, ledger, kept, all);                 \
  }
  if (law->fades && (y || dim == 1 || (w && !JL_BATCH))) JL_STEP(rare_fades)
  else if (y || dim == 1) JL_STEP(rare)
  else if (JL_BATCH && dim == 2 && w) JL_STEP(plane_wears)
  else if (dim == 2 && law->fades) JL_STEP(plane_fades)
  else if (dim == 2) JL_STEP(plane)
  else if (JL_BATCH && w) JL_STEP(space_wears)
  else if (law->fades) JL_STEP(space_fades)
  else JL_STEP(space)
#undef JL_STEP
  if (!jl_element_rows(law)) return;
  const jl_of_joint stored =
      jl_step_elements(law, n, jl_element_row(law), from, d, F, C, tangent, ledger);
  if (all) jl_add_elements(law, n, stored, all);
}
