/* law.h: one step of a rock joint, and what a state amounts to, in lanes (lanes.h).
 *
 * Symbols and order are those of docs/theory-incremental.md and of kernels/reference.py. Rows of
 * a state: delta (dim) from the mated position | dissipated energy | q_s (M D) | q_t (M D), q times
 * lam; where asperities yield flattened depth (M) | plastic work; with wear the share of the slopes
 * that is gone | work of friction; with a bond its damage. A batch keeps beside them Phi and Phi' of
 * every facet (M each), which saves half the look-ups, and with yielding the same at that depth.
 *
 * The last digit of expm1 and pow depends on the C library, that of all else here does not. exp and
 * log are avoided: zig links its own, which differ from those of the system. */

typedef struct { /* constants of a step: the compiler leaves out what they exclude */
  int dim, yields, fades, wears, ledger, tangent;
  int kept; /* whether Phi and Phi' lie beside the state */
} kind;

typedef struct { /* in the plane of a joint: o, offset over the mating length; w^2 = 1 - |o|^2 */
  of_joint o[2], w;
} site;

typedef struct {                 /* a joint in a step */
  of_joint p[3], from[3], to[3]; /* increment; closure and in-plane displacement before and after */
  site start, middle, end;
  of_joint had, has; /* share of the slopes that was left before the step, and is in it */
} motion;

typedef struct { /* the plane of facets: slope along the azimuth e and across it, in axes (1, e) */
  real x, z;     /* offset over the mating length along e and across */
  real along, across;
  real m2, N2, rm, rmn; /* 1 + along^2, that + across^2; 1/m, 1/(m N) */
  real gamma;           /* c1 N */
} plane;

typedef struct { /* facets in a step: y, Phi, Phi', Phi'' before and after; de */
  real y0, y1, f0, f1, k0, k1, bend, es, et;
  plane middle, end;
  real yw, fw, kw, limit2, worn;   /* before wear: y, Phi, Phi'; after it: (q/G)^2 at most; loss */
  real d0, de, dz;                 /* increment: closure, along the azimuth and across it */
  real dy, rdy;                    /* y1 - y0, and 1 over it */
  yes near;                        /* y has hardly changed */
  real z0, z1, fz0, fz1, kz0, kz1; /* flattened depth; Phi and Phi' there */
  real qs, qt, lost, vs, vt, bss, bst, btt; /* sums over the cells: q, loss, v and B of C */
  real ws, wt, open;                        /* v of the softening by z1; sum of kappa */
  real gs, gt, strength;                    /* derivative of q by log(gamma); mu lam A gamma */
} facets;

typedef struct {             /* the sliders of one depth cell of facets */
  real G0, G1, k0, k1, kz1;  /* G and kappa before and after; kappa at z1 */
  real gained;               /* what G grows by, before springs yield at the new y */
  real strength, cap, chord; /* mu lam A; friction limit; of G over the step */
  real ts, tt, unit, share;  /* trial force, 1 over its size, cap over its size or 1 */
  real old2, new2;           /* squares of q before and of the trial force */
  yes slips;
} sliders;

typedef struct { /* what facets add up to */
  real F[3], C[9], lost;
  real crushed, lowered, worn; /* plastic work; what the wear of slopes takes: normal, sliders */
} sums;

/* Rows of a state: first of the sliders, first after them, worn slopes, damage; number of rows */
IN int slider_row(const jlaw_law *law) { return law->dim + 1; }
IN int rest_row(const jlaw_law *law) { return law->dim + 1 + 2 * law->facets * law->cells; }
IN int worn_row(const jlaw_law *law) { return rest_row(law) + (law->yields ? law->facets + 1 : 0); }
IN int damage_row(const jlaw_law *law) { return worn_row(law) + 2 * law->wears; }
IN int state_rows(const jlaw_law *law) { return damage_row(law) + law->bonded; }

/* Tables of facets from number `at` on, and of their first depth cell */
IN const double *facet_of(const jlaw_law *law, int at)
{
  const int lane = at % JLAW_LANES;
  return law->facet + (size_t) (at - lane) * JLAW_COLUMNS + lane;
}
IN const double *cell_of(const jlaw_law *law, int at)
{
  const int lane = at % JLAW_LANES;
  return law->depth + (size_t) (at - lane) * (size_t) law->cells * JLAW_ROWS + lane;
}

/* ------------------------------------------------------------------- the virgin curve */

/* Effective closures below it count as zero: powers and squares of them underflow */
IN real resolved(real y) { return only(size_of(y) >= JLAW_UNDERFLOW, y); }

typedef struct { /* in the tables of the virgin curve: sqrt(y), and the place x in piece i */
  real y, v, r, x;
  whole i;
} spot;

IN spot spot_of(const jlaw_law *law, real y)
{
  const double pieces = law->pieces;
  spot at;
  at.y = only(y > 0.0, y);
  at.v = root(at.y);
  at.r = 1.0 / (at.v + law->scale);
  at.x = at.v * at.r * pieces;
  at.i = to_whole(smaller(at.x, each(pieces - 1.0)));
  at.x = at.x - to_real(at.i);
  return at;
}

/* x^p, zero at x = 0 */
IN real raised(real x, double p)
{
  for (int l = 0; l < W; l++) LANE(x, l) = LANE(x, l) > 0.0 ? pow(LANE(x, l), p) : 0.0;
  return x;
}

/* y^eta, zero at y = 0 */
IN real power_of(const jlaw_law *law, const spot *at)
{
  if (law->eta == 0.0) return only(at->y > 0.0, each(1.0));
  return law->eta == 0.5 ? at->v : raised(at->y, law->eta);
}

/* Phi and Phi' at y, and Phi'' if asked for; zero where y <= 0 */
IN void virgin_curve(const jlaw_law *law, real y, real *force, real *slope, real *bend)
{
  const double n = law->pieces, eta = law->eta;
  const spot at = spot_of(law, y);
  const real x = at.x, ts = at.v * at.r * at.r * law->scale; /* t (1 - t) */
  real c[4];
  fetch(law->curve, at.i, c);
  real S = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
  real DS = 0.5 * n * ts * (c[1] + x * (2.0 * c[2] + x * (3.0 * c[3])));
  real DDS = each(0.0);
  if (bend)
    DDS = 0.25 * n * n * ts * ts * (2.0 * c[2] + x * (6.0 * c[3]))
          + 0.5 * (law->scale - at.v) * at.r * DS;
  if (law->rise > 0.0) {
    const real w = at.y / (at.y + law->scale * law->scale), more = law->rise * (1.0 - w);
    const real up = raised(w, law->rise); /* the curve is tabulated over w^rise */
    DDS = up * (DDS + 2.0 * more * DS + more * (more - w) * S);
    DS = up * (DS + more * S);
    S = up * S;
  }
  const real power = power_of(law, &at);
  *force = power * at.y * S;
  *slope = power * ((1.0 + eta) * S + DS);
  if (bend)
    *bend = power / pick(y > 0.0, y, 1.0) * (eta * (1.0 + eta) * S + (1.0 + 2.0 * eta) * DS + DDS);
}

/* Psi, the integral of Phi, at y */
IN real psi(const jlaw_law *law, real y)
{
  const spot at = spot_of(law, y);
  real c[4];
  fetch(law->energy, at.i, c);
  real T = c[0] + at.x * (c[1] + at.x * (c[2] + at.x * c[3]));
  if (law->rise > 0.0) T = T * raised(at.y / (at.y + law->scale * law->scale), law->rise);
  return power_of(law, &at) * at.y * at.y * T;
}

/* Share G of a depth cell in Phi at y, and its slope kappa */
IN void share_of(const double *cell, real y, real force, real slope, real *G, real *kappa)
{
  const real low = y - column(cell, JLAW_LOW), high = y - column(cell, JLAW_HIGH);
  const of_facet end = column(cell, JLAW_KAPPA);
  const real k = pick(high > 0.0, end, slope - column(cell, JLAW_SLOPE));
  const real g = pick(high > 0.0, column(cell, JLAW_G) + end * high,
                      force - column(cell, JLAW_FORCE) - column(cell, JLAW_SLOPE) * low);
  *kappa = only(low > 0.0, larger(k, each(0.0)));
  *G = larger(smaller(g, *kappa * low), each(0.0));
}

/* -------------------------------------------------------------- asperities that yield */

/* G and kappa of a cell, less H, its G at the flattened depth z: "Yielding" */
IN void flatten(real y, real z, real H, real *G, real *kappa)
{
  const real over = y - z;
  *kappa = only(over > 0.0, *kappa);
  *G = larger(smaller(*G - H, *kappa * over), each(0.0));
}

/* G and kappa of a cell at y, of facets with the flattened depth z */
IN void hold_cell(const double *cell, real y, real f, real k, real z, real fz, real kz, int yields,
                  real *G, real *kappa)
{
  real H, less;
  share_of(cell, y, f, k, G, kappa);
  if (!yields) return;
  share_of(cell, z, fz, kz, &H, &less);
  flatten(y, z, H, G, kappa);
}

/* Phi less its value at the flattened depth */
IN void flatten_facets(real y, real z, real less, real *force, real *slope)
{
  *force = only(y > z, larger(*force - less, each(0.0)));
  *slope = only(y > z, *slope);
}

/* Flattened depths of facets, before and after the step, and the virgin curve there */
IN void press(const jlaw_law *law, const double *f, numbers n, int kept, int at, int some,
              const motion *m, facets *o)
{
  const int M = law->facets, depth = rest_row(law);
  real y = o->y1;
  if (law->fades) /* one depth for a facet and its opposite */
    y = larger(y, 2.0 * column(f, JLAW_M) * m->to[0] - y);
  o->z0 = take(n, depth + at, 1, some);
  o->z1 = larger(y - column(f, JLAW_YIELD), o->z0);
  if (kept) {
    o->fz0 = take(n, kept + 2 * M + at, 1, some);
    o->kz0 = take(n, kept + 3 * M + at, 1, some);
  } else virgin_curve(law, o->z0, &o->fz0, &o->kz0, (real *) 0);
  o->fz1 = o->fz0, o->kz1 = o->kz0;
  if (!any(o->z1 > o->z0)) return;
  virgin_curve(law, o->z1, &o->fz1, &o->kz1, (real *) 0);
  put(n, depth + at, 1, some, o->z1);
  if (kept) {
    put(n, kept + 2 * M + at, 1, some, o->fz1);
    put(n, kept + 3 * M + at, 1, some, o->kz1);
  }
}

/* Whether facets flatten themselves; else the opposite one does. Both do, but for rounding, where
 * the shear does not move them, as at a right angle to it. */
IN yes flattens_itself(const double *f, const facets *o)
{
  return o->y1 - column(f, JLAW_YIELD) >= o->z1 - JLAW_ROUNDED * size_of(o->y1);
}

/* Plastic work of facets over A c1: exact where they press themselves flat, else by the mean */
IN real crush(const double *f, const facets *o)
{
  const of_facet most = column(f, JLAW_YIELD);
  const real c0 = smaller(larger(o->y0 - o->z0, each(0.0)), each(most));
  const real c1 = smaller(larger(o->y1 - o->z1, each(0.0)), each(most));
  return pick(flattens_itself(f, o), each(most), 0.5 * (c0 + c1)) * (o->fz1 - o->fz0);
}

/* --------------------------------------------------------------------- slopes that fade */

/* Offset, over the mating length, at the in-plane displacement p0, p1: "Mating" */
IN site site_of(const jlaw_law *law, of_joint p0, of_joint p1)
{
  site at;
  p0 = p0 / law->mating_length;
  p1 = p1 / law->mating_length;
  at.w = 1.0 / root_joint(1.0 + (p0 * p0 + p1 * p1));
  at.o[0] = at.w * p0;
  at.o[1] = at.w * p1;
  return at;
}

/* Effective closure of facets at this closure, where this share of the slopes is left */
IN real climb(const jlaw_law *law, const double *f, of_joint closure, const site *at,
              of_joint slopes)
{
  const real rise = column(f, JLAW_M + 1) * at->o[0] + column(f, JLAW_M + 2) * at->o[1];
  return closure + slopes * law->mating_length * rise;
}

IN plane plane_at(const double *f, const site *at, of_joint slopes)
{
  plane s;
  s.x = column(f, JLAW_E) * at->o[0] + column(f, JLAW_E + 1) * at->o[1];
  s.z = column(f, JLAW_E) * at->o[1] - column(f, JLAW_E + 1) * at->o[0];
  const real steep = slopes * at->w * column(f, JLAW_STEEP);
  s.along = steep * (1.0 - s.x * s.x);
  s.across = -steep * s.x * s.z;
  s.m2 = 1.0 + s.along * s.along;
  s.N2 = s.m2 + s.across * s.across;
  const real m = root(s.m2), N = root(s.N2);
  s.rmn = 1.0 / (m * N);
  s.rm = N * s.rmn;
  s.gamma = column(f, JLAW_COSINE) * N;
  return s;
}

/* Components of a vector along e and across it, in the axes of the joint */
IN void to_axes(const double *f, real *along, real *across)
{
  const real v1 = column(f, JLAW_E) * *along - column(f, JLAW_E + 1) * *across;
  *across = column(f, JLAW_E + 1) * *along + column(f, JLAW_E) * *across;
  *along = v1;
}

/* Derivative of the slopes by the displacement, both along the azimuth and across: ee, ez, zz */
IN void curvature(const jlaw_law *law, const double *f, const plane *s, of_joint w, of_joint slopes,
                  real h[3])
{
  const real bend = -(slopes * w * w / law->mating_length) * column(f, JLAW_STEEP);
  h[0] = bend * (3.0 * s->x * (1.0 - s->x * s->x));
  h[1] = bend * (s->z * (1.0 - 3.0 * s->x * s->x));
  h[2] = bend * (s->x * (1.0 - 3.0 * s->z * s->z));
}

/* The increment in the plane of facets at mid-step */
IN void move_in_plane(const double *f, const motion *m, facets *o)
{
  const plane *s = &o->middle;
  const real p1 = each(0.0) + m->p[1], p2 = each(0.0) + m->p[2];
  o->d0 = each(0.0) + m->p[0];
  o->de = column(f, JLAW_E) * p1 + column(f, JLAW_E + 1) * p2;
  o->dz = column(f, JLAW_E) * p2 - column(f, JLAW_E + 1) * p1;
  o->es = (o->de - s->along * o->d0) * s->rm;
  o->et = (s->m2 * o->dz - s->across * (o->d0 + s->along * o->de)) * s->rmn;
}

/* F of facets that fade: A Phi n and the sliders, in axes (1, e), then in those of the joint */
IN void add_traction(const jlaw_law *law, const double *f, const facets *o, sums *sum, int dim)
{
  const plane *s = &o->end;
  const real n = column(f, JLAW_POTENTIAL) * o->f1;
  const real qs = law->soft * s->rm * o->qs, qt = law->soft * s->rmn * o->qt;
  real along = n * s->along + (qs - s->along * s->across * qt);
  real across = n * s->across + s->m2 * qt;
  to_axes(f, &along, &across);
  sum->F[0] += n - (s->along * qs + s->across * qt);
  if (dim > 1) sum->F[1] += along;
  if (dim > 2) sum->F[2] += across;
}

/* ------------------------------------------------------------------------------- wear */

/* Shares of the slopes that were left before the step, and are after the work of friction so far */
IN void wear_slopes(const jlaw_law *law, numbers n, motion *m)
{
  const int row = worn_row(law);
  of_joint worn = take_joint(n, row);
  const of_joint work = take_joint(n, row + 1);
  m->had = 1.0 - worn;
  for (int l = 0; l < JOINTS; l++) {
    const double now = (law->slope_residual - 1.0) * expm1(-JOINT(work, l) / law->slope_wear);
    JOINT(worn, l) = now > JOINT(worn, l) ? now : JOINT(worn, l);
  }
  m->has = 1.0 - worn;
  put_joint(n, row, worn);
}

/* Slopes have worn: springs that part take their force along, and friction limits the rest. One
 * division for all: stiffnesses and forces below 1e-75 count as none. */
IN void wear_sliders(const double *cell, facets *o, const sliders *c, real *qs, real *qt, kind k)
{
  real G, kappa;
  hold_cell(cell, o->yw, o->fw, o->kw, o->z0, o->fz0, o->kz0, k.yields, &G, &kappa);
  const real q2 = *qs * *qs + *qt * *qt, cap2 = o->limit2 * (c->G0 * c->G0);
  const yes had = kappa * kappa > JLAW_FAINT, has = c->k0 * c->k0 > JLAW_FAINT;
  const real a = pick(had, kappa, 1.0), b = pick(has, c->k0, 1.0);
  const real Q = pick(q2 > JLAW_FAINT, q2, 1.0);
  const real r = 1.0 / (a * b * Q), was = only(had, b * Q * r), is = only(has, a * Q * r);
  real share = pick(kappa > c->k0, c->k0 * was, 1.0);
  const yes beyond = share * share * q2 > cap2;
  if (somewhere(beyond)) share = pick(beyond, root(cap2 * (a * b * r)), share);
  o->worn += q2 * (was - share * share * is);
  *qs = share * *qs;
  *qt = share * *qt;
}

/* --------------------------------------------------------------------------- one step */

/* G and kappa of a cell before and after the step. What G gains is taken from the virgin curve: the
 * bounds of `flatten` would show in it where that curve is small and hardly convex. */
IN void cells_of(const double *cell, const facets *o, sliders *c, int yields)
{
  share_of(cell, o->y0, o->f0, o->k0, &c->G0, &c->k0);
  share_of(cell, o->y1, o->f1, o->k1, &c->G1, &c->k1);
  c->gained = c->G1 - c->G0;
  c->kz1 = each(0.0);
  if (!yields) return;
  real H0, H1, kz0;
  share_of(cell, o->z0, o->fz0, o->kz0, &H0, &kz0);
  share_of(cell, o->z1, o->fz1, o->kz1, &H1, &c->kz1);
  c->gained = c->G1 - larger(c->G0, H0);
  flatten(o->y0, o->z0, H0, &c->G0, &c->k0);
  flatten(o->y1, o->z1, H1, &c->G1, &c->k1);
}

/* Trial force: loaded by the chord of G where kappa grows; where kappa falls, the springs that part
 * take their force along. Then the friction limit, |q| <= mu lam A G. */
IN void load(const double *f, const facets *o, sliders *c, real *qs, real *qt, kind k)
{
  yes near = o->near;
  if (k.yields) near = near & ((c->k0 > 0.0) | (c->k1 <= 0.0)); /* flattened ones touch together */
  const real mean = pick(near, 0.5 * (c->k0 + c->k1), c->gained * o->rdy);
  c->chord = smaller(larger(mean, c->k0), c->k1); /* k1 where it falls */
  c->old2 = *qs * *qs + *qt * *qt;
  const yes falls = c->k1 < c->k0;
  if (somewhere(falls)) {
    const real kept = pick(falls, c->k1 / pick(falls, c->k0, 1.0), 1.0);
    *qs = *qs * kept;
    *qt = *qt * kept;
  }
  const real add = column(f, JLAW_STIFF) * c->chord;
  c->ts = *qs + add * o->es;
  c->tt = *qt + add * o->et;
  c->new2 = c->ts * c->ts + c->tt * c->tt;
  c->cap = c->strength * c->G1;
  c->slips = c->new2 > c->cap * c->cap;
  c->unit = each(0.0);
  c->share = each(1.0);
  if (k.tangent || somewhere(c->slips)) {
    c->unit = only(c->new2 > JLAW_TINY, 1.0 / root(c->new2));
    c->share = pick(c->slips, smaller(c->cap * c->unit, each(1.0)), 1.0);
  }
  const real part = only(c->new2 > JLAW_TINY, c->share); /* squares of smaller forces underflow */
  *qs = part * c->ts;
  *qt = part * c->tt;
}

/* What sliders, and springs that part under shear, lose: every term is >= 0 as written */
IN real friction_loss(const sliders *c)
{
  const real high = larger(c->chord, c->k0), low = smaller(c->k0, c->k1);
  const real a = c->k0 * high, b = c->k1 * c->chord;
  const real A = pick(a > JLAW_FAINT, a, 1.0), B = pick(b > JLAW_FAINT, b, 1.0);
  const real r = 1.0 / (A * B); /* one division for both */
  const real rub = c->k1 - c->chord + 2.0 * c->share * (1.0 - c->share) * c->chord;
  return only(a > JLAW_FAINT, c->old2 * ((high - low) * (B * r)))
         + only(b > JLAW_FAINT, c->new2 * (rub * (A * r)));
}

/* "The tangent": J_q = beta (I - s s^T) E + v g^T of sliders */
IN void slide_tangent(const double *f, const double *cell, const sliders *c, facets *o, kind k)
{
  const of_facet a = column(f, JLAW_STIFF);
  const of_facet begin = column(cell, JLAW_LOW), end = column(cell, JLAW_HIGH);
  const yes inside = (o->y1 > begin) & (o->y1 < end);
  const real bend = only(inside, o->bend);
  yes near = o->near;
  if (k.yields) near = near & ((c->k0 > 0.0) | (c->k1 <= 0.0));
  const real chord1 = pick(near, 0.5 * bend, (c->k1 - c->chord) * o->rdy);
  const yes stiff = c->k1 > JLAW_TINY;
  const real fade = only(stiff, bend / pick(stiff, c->k1, 1.0));
  /* rounding must not decide: what did not close has not grown, what is at its limit slips */
  const yes stiffer = (c->k1 > c->k0) & (o->dy > JLAW_ROUNDED * size_of(o->y1));
  const real least = c->strength * (c->G1 * (1.0 - JLAW_LIMIT) - JLAW_ROUNDED * o->f1);
  const yes limited = c->new2 >= larger(least, each(0.0)) * larger(least, each(0.0));
  const real vs = pick(stiffer, a * chord1 * o->es, fade * c->ts);
  const real vt = pick(stiffer, a * chord1 * o->et, fade * c->tt);
  const real us = c->ts * c->unit, ut = c->tt * c->unit;
  const real dot = us * vs + ut * vt, push = c->strength * c->k1;
  const real beta = only(c->cap > 0.0, c->share * (a * c->chord)), along = only(limited, beta);
  o->vs += pick(limited, c->share * (vs - us * dot) + push * us, vs);
  o->vt += pick(limited, c->share * (vt - ut * dot) + push * ut, vt);
  o->bss += beta - along * us * us;
  o->bst -= along * us * ut;
  o->btt += beta - along * ut * ut;
  if (k.fades) {
    const real by_gamma = only(limited, c->strength * c->G1);
    o->gs += by_gamma * us;
    o->gt += by_gamma * ut;
  }
  if (k.yields) {
    const yes pulls = limited & (c->k1 > 0.0);
    const real pull = c->strength * only(pulls, c->kz1);
    o->ws += pull * us;
    o->wt += pull * ut;
    o->open += c->k1;
  }
}

/* One depth cell of facets: from the sliders before the step to those after it */
IN void slide(const double *f, const double *cell, facets *o, real *qs, real *qt, kind k)
{
  sliders c;
  cells_of(cell, o, &c, k.yields);
  c.strength = each(column(f, JLAW_STRENGTH));
  if (k.fades) c.strength = c.strength * o->end.gamma;
  if (k.wears) wear_sliders(cell, o, &c, qs, qt, k);
  load(f, o, &c, qs, qt, k);
  o->qs += *qs;
  o->qt += *qt;
  if (k.ledger) o->lost += friction_loss(&c);
  if (k.tangent) slide_tangent(f, cell, &c, o, k);
}

/* C += along g^T + E^T B E of facets; where the flattened depth moves, less softening g_z^T */
IN void add_tangent(const jlaw_law *law, const double *f, const facets *o, sums *sum, kind k)
{
  const yes moves = (o->z1 - o->z0 > JLAW_ROUNDED * o->z1) & (o->open > 0.0);
  const yes own = flattens_itself(f, o);
  for (int i = 0; i < k.dim; i++) {
    const of_facet n = column(f, JLAW_N + i) * column(f, JLAW_A);
    const of_facet s = column(f, JLAW_S + i) * law->soft, t = column(f, JLAW_T + i) * law->soft;
    const real along = n * o->k1 + s * o->vs + t * o->vt;
    const real left = s * o->bss + t * o->bst, right = s * o->bst + t * o->btt;
    for (int j = 0; j < k.dim; j++) {
      const real g = each(column(f, JLAW_M + j)); /* dy/dd */
      real to = along * g + left * column(f, JLAW_S + j) + right * column(f, JLAW_T + j);
      if (k.yields) {
        const real less = only(moves, n * o->kz1 + s * o->ws + t * o->wt);
        to -= j > 0 ? less * pick(own, g, -g) : less * g;
      }
      sum->C[3 * i + j] += to;
    }
  }
}

/* The same where slopes fade, and with them planes turn and friction limits fall: worked out in
 * axes (1, e), then turned. E: derivative of the increment in the plane; A, B: of the sliders'
 * force by the slopes along and across; h: of these by the displacement. */
IN void add_fading_tangent(const jlaw_law *law, const double *f, const motion *m, const facets *o,
                           sums *sum, kind k)
{
  const yes moves = (o->z1 - o->z0 > JLAW_ROUNDED * o->z1) & (o->open > 0.0);
  const yes own = flattens_itself(f, o);
  const plane *s = &o->end, *r = &o->middle;
  const real soft = each(law->soft), none = each(0.0), n = each(column(f, JLAW_POTENTIAL));
  real h[3], H[3], C[3][3]; /* ee, ez, zz */
  curvature(law, f, s, m->end.w, m->has, h);
  curvature(law, f, r, m->middle.w, m->has, H);
  const real turn = 0.5 * (o->d0 + r->along * o->de), et = 0.5 * o->et;
  const real rm2 = 1.0 / r->m2, rN2 = 1.0 / r->N2;
  const real ea = -turn * (rm2 * r->rm), eb = -(turn * r->rmn + et * r->across * rN2);
  const real ta =
      (r->along * o->dz - 0.5 * r->across * o->de) * r->rmn - et * r->along * (rm2 + rN2);
  const real Es[3] = {-r->along * r->rm, r->rm + ea * H[0], ea * H[1]};
  const real Et[3] = {-r->across * r->rmn, -r->along * r->across * r->rmn + ta * H[0] + eb * H[1],
                      r->m2 * r->rmn + ta * H[1] + eb * H[2]};
  const real cs[3] = {-s->along * s->rm, s->rm, none};
  const real ct[3] = {-s->across * s->rmn, -s->along * s->across * s->rmn, s->m2 * s->rmn};
  const real rM2 = 1.0 / s->m2, rn2 = 1.0 / s->N2, rm3 = rM2 * s->rm;
  const real qa = o->qs * rm3, qt = o->qt * s->rmn, fall = s->along * (rM2 + rn2);
  const real A[3] = {-qa - o->qt * ct[0] * fall,
                     -s->along * qa - s->across * qt - o->qt * ct[1] * fall,
                     2.0 * s->along * qt - o->qt * ct[2] * fall};
  const real down = o->qt * s->across * rn2;
  const real B[3] = {-qt - down * ct[0], -s->along * qt - down * ct[1], -down * ct[2]};
  const real ga = s->along * rn2, gb = s->across * rn2; /* of log(gamma) */
  const real g[3] = {each(1.0), s->along, s->across};
  for (int j = 0; j < 3; j++) {
    const real ha = j ? h[j - 1] : none, hb = j ? h[j] : none, gamma = ga * ha + gb * hb;
    const real us = o->vs * g[j] + o->bss * Es[j] + o->bst * Et[j] + o->gs * gamma;
    const real ut = o->vt * g[j] + o->bst * Es[j] + o->btt * Et[j] + o->gt * gamma;
    const real pressing = k.yields ? only(moves, j ? pick(own, g[j], -g[j]) : g[j]) : none;
    for (int i = 0; i < 3; i++) {
      const real bend = i == 1 ? ha : i == 2 ? hb : none;
      C[i][j] = n * (o->k1 * g[i] * g[j] + o->f1 * bend)
                + soft * (cs[i] * us + ct[i] * ut + (A[i] * ha + B[i] * hb));
      if (k.yields)
        C[i][j] -= pressing * (n * g[i] * o->kz1 + soft * (cs[i] * o->ws + ct[i] * o->wt));
    }
  }
  for (int i = 0; i < 3; i++) to_axes(f, &C[i][1], &C[i][2]);
  for (int j = 0; j < 3; j++) to_axes(f, &C[1][j], &C[2][j]);
  for (int i = 0; i < k.dim; i++)
    for (int j = 0; j < k.dim; j++) sum->C[3 * i + j] += C[i][j];
}

/* Facets from number `at` on: closures, virgin curve, sliders, and their part of F and C */
IN void step_facets(const jlaw_law *law, int at, const motion *m, numbers n, sums *sum, kind k)
{
  const int M = law->facets, D = law->cells, some = M - at < TOGETHER ? M - at : TOGETHER;
  const int kept = k.kept ? state_rows(law) : 0;
  const double *f = facet_of(law, at), *cell = cell_of(law, at);
  facets o;
  o.y0 = o.y1 = o.es = o.et = o.bend = o.limit2 = o.fw = o.kw = each(0.0);
  for (int i = 0; i < k.dim && !k.fades; i++) {
    o.y0 += column(f, JLAW_M + i) * m->from[i];
    o.y1 += column(f, JLAW_M + i) * m->to[i];
    o.es += column(f, JLAW_S + i) * m->p[i];
    if (i > 0) o.et += column(f, JLAW_T + i) * m->p[i];
  }
  if (k.fades) {
    o.y0 = climb(law, f, m->from[0], &m->start, m->has);
    o.y1 = climb(law, f, m->to[0], &m->end, m->has);
  }
  o.yw = k.wears ? resolved(climb(law, f, m->from[0], &m->start, m->had)) : o.y0;
  if (!k.yields && !any((o.y0 > 0.0) | (o.y1 > 0.0) | (o.yw > 0.0))) return; /* apart: holds zero */
  if (k.fades) {
    o.middle = plane_at(f, &m->middle, m->has);
    o.end = plane_at(f, &m->end, m->has);
    move_in_plane(f, m, &o);
  }
  const of_facet limit = column(f, JLAW_STRENGTH) * column(f, JLAW_COSINE);
  if (k.wears) o.limit2 = limit * limit * plane_at(f, &m->start, m->has).N2;
  o.y0 = resolved(o.y0);
  o.y1 = resolved(o.y1);
  o.dy = o.y1 - o.y0;
  o.rdy = 1.0 / o.dy;
  o.near = size_of(o.dy) <= JLAW_NEAR * size_of(o.y1);
  o.qs = o.qt = o.lost = o.vs = o.vt = o.bss = o.bst = o.btt = o.ws = o.wt = o.open = each(0.0);
  o.gs = o.gt = o.worn = each(0.0);
  if (k.kept) {
    o.f0 = take(n, kept + at, 1, some);
    o.k0 = take(n, kept + M + at, 1, some);
  } else virgin_curve(law, o.yw, &o.f0, &o.k0, (real *) 0);
  if (k.wears) {
    o.fw = o.f0, o.kw = o.k0;
    if (somewhere(o.y0 != o.yw)) virgin_curve(law, o.y0, &o.f0, &o.k0, (real *) 0);
  }
  virgin_curve(law, o.y1, &o.f1, &o.k1, k.tangent ? &o.bend : (real *) 0);
  if (k.kept) {
    put(n, kept + at, 1, some, o.f1);
    put(n, kept + M + at, 1, some, o.k1);
  }
  o.z0 = o.z1 = o.fz0 = o.fz1 = o.kz0 = o.kz1 = each(0.0);
  if (k.yields) press(law, f, n, kept, at, some, m, &o);
  for (int i = 0; i < D; i++, cell += JLAW_ROWS * JLAW_LANES) {
    const of_facet low = column(cell, JLAW_LOW);
    if (!any((o.y0 > low) | (o.y1 > low) | (o.yw > low))) break; /* nor does what is deeper */
    const int row = k.dim + 1 + at * D + i;
    real qs = take(n, row, D, some), qt = take(n, row + M * D, D, some);
    slide(f, cell, &o, &qs, &qt, k);
    put(n, row, D, some, qs);
    put(n, row + M * D, D, some, qt);
  }
  if (k.yields) {
    sum->crushed += column(f, JLAW_POTENTIAL) * crush(f, &o);
    if (k.wears) flatten_facets(o.yw, o.z0, o.fz0, &o.fw, &o.kw);
    flatten_facets(o.y0, o.z0, o.fz0, &o.f0, &o.k0);
    flatten_facets(o.y1, o.z1, o.fz1, &o.f1, &o.k1);
  }
  if (k.ledger) sum->lost += column(f, JLAW_COMPLIANCE) * o.lost;
  if (k.wears) {
    sum->worn += column(f, JLAW_COMPLIANCE) * o.worn;
    sum->lowered += 0.5 * column(f, JLAW_POTENTIAL) * ((o.fw + o.f0) * (o.yw - o.y0));
  }
  if (k.fades) {
    add_traction(law, f, &o, sum, k.dim);
    if (k.tangent) add_fading_tangent(law, f, m, &o, sum, k);
    return;
  }
  const real normal = column(f, JLAW_A) * o.f1, qs = law->soft * o.qs, qt = law->soft * o.qt;
  for (int i = 0; i < k.dim; i++) {
    const real pull = column(f, JLAW_N + i) * normal;
    sum->F[i] += pull + (column(f, JLAW_S + i) * qs + column(f, JLAW_T + i) * qt);
  }
  if (k.tangent) add_tangent(law, f, &o, sum, k);
}

/* Advance joints by the increments d: their numbers n, F (dim), and C (dim, dim) for a tangent */
IN void step(const jlaw_law *law, numbers n, const of_joint d[3], of_joint F[3], of_joint C[9],
             kind k)
{
  const int dim = k.dim, M = law->facets, rest = rest_row(law);
  motion m;
  sums sum[SUMS];
  for (int i = 0; i < 3; i++) {
    m.p[i] = i < dim ? d[i] : each_joint(0.0);
    m.from[i] = i < dim ? take_joint(n, i) : each_joint(0.0);
    m.to[i] = m.from[i] + m.p[i];
  }
  m.had = m.has = each_joint(1.0);
  if (k.wears) wear_slopes(law, n, &m);
  if (k.fades) {
    m.start = site_of(law, m.from[1], m.from[2]);
    m.middle = site_of(law, m.from[1] + 0.5 * m.p[1], m.from[2] + 0.5 * m.p[2]);
    m.end = site_of(law, m.to[1], m.to[2]);
  }
  for (int i = 0; i < SUMS; i++) {
    for (int j = 0; j < 3; j++) sum[i].F[j] = each(0.0);
    for (int j = 0; k.tangent && j < 9; j++) sum[i].C[j] = each(0.0);
    sum[i].lost = sum[i].crushed = sum[i].lowered = sum[i].worn = each(0.0);
  }
  for (int at = 0; at < M; at += TOGETHER)
    step_facets(law, at, &m, n, sum + at / TOGETHER % SUMS, k);
  for (int i = 0; i < dim; i++) {
    F[i] = total(sum, F[i]);
    for (int j = 0; k.tangent && j < dim; j++) C[dim * i + j] = total(sum, C[3 * i + j]);
    put_joint(n, i, m.to[i]);
  }
  if (!k.ledger) return;
  of_joint lost = total(sum, lost);
  if (k.wears) {
    of_joint lowered = total(sum, lowered);
    for (int l = 0; l < JOINTS; l++) /* >= 0 by the pairs of facets, but for rounding */
      JOINT(lowered, l) = JOINT(lowered, l) > 0.0 ? JOINT(lowered, l) : 0.0;
    put_joint(n, worn_row(law) + 1, take_joint(n, worn_row(law) + 1) + lost);
    lost += total(sum, worn) + lowered;
  }
  if (k.yields) {
    const of_joint crushed = total(sum, crushed);
    put_joint(n, rest + M, take_joint(n, rest + M) + crushed);
    lost += crushed;
  }
  put_joint(n, dim, take_joint(n, dim) + lost);
}

/* ------------------------------------------------------------------ what a state is */

/* Facets from number `at` on in a state: y, z, and the virgin curve there as in y1 and z1; the
 * friction limit of q over G */
IN void facets_now(const jlaw_law *law, numbers n, int at, facets *o)
{
  const int some = law->facets - at < TOGETHER ? law->facets - at : TOGETHER;
  const double *f = facet_of(law, at);
  of_joint slopes = each_joint(1.0), to[3];
  for (int i = 0; i < 3; i++) to[i] = i < law->dim ? take_joint(n, i) : each_joint(0.0);
  if (law->wears) slopes = 1.0 - take_joint(n, worn_row(law));
  o->y1 = o->z1 = o->fz1 = o->kz1 = each(0.0);
  o->strength = each(column(f, JLAW_STRENGTH));
  for (int i = 0; i < law->dim && !law->fades; i++) o->y1 += column(f, JLAW_M + i) * to[i];
  if (law->fades) {
    const site here = site_of(law, to[1], to[2]);
    o->y1 = climb(law, f, to[0], &here, slopes);
    o->strength = o->strength * plane_at(f, &here, slopes).gamma;
  }
  o->y1 = resolved(o->y1);
  virgin_curve(law, o->y1, &o->f1, &o->k1, (real *) 0);
  if (!law->yields) return;
  o->z1 = take(n, rest_row(law) + at, 1, some);
  virgin_curve(law, o->z1, &o->fz1, &o->kz1, (real *) 0);
}

typedef struct { /* as reference.Measures; of the stored energy that of the shear springs */
  of_joint sliding, slipping, separated, stored, reach, sheared;
} amounts;

typedef struct {
  real sliding, slipping, separated, normal, sheared;
} amount_sums;

IN void measure_facets(const jlaw_law *law, numbers n, int at, amount_sums *sum, of_joint *reach)
{
  const int M = law->facets, D = law->cells, some = M - at < TOGETHER ? M - at : TOGETHER;
  const double *f = facet_of(law, at), *cell = cell_of(law, at);
  real held = each(0.0), sheared = each(0.0), whole_slips = each(1.0);
  facets o;
  facets_now(law, n, at, &o);
  for (int i = 0; i < D && any(o.y1 > column(cell, JLAW_LOW)); i++) {
    real G, kappa;
    const int row = slider_row(law) + at * D + i;
    const real qs = take(n, row, D, some), qt = take(n, row + M * D, D, some);
    hold_cell(cell, o.y1, o.f1, o.k1, o.z1, o.fz1, o.kz1, law->yields, &G, &kappa);
    const real q2 = qs * qs + qt * qt;
    const yes stiff = kappa > JLAW_TINY;
    const yes limited = root(q2) >= o.strength * (G * (1.0 - JLAW_LIMIT) - JLAW_ROUNDED * o.f1);
    held += only(limited, G);
    whole_slips = only(limited, whole_slips);
    sheared += only(stiff, q2 / pick(stiff, kappa, 1.0));
    cell += JLAW_ROWS * JLAW_LANES;
  }
  const yes touches = o.y1 > o.z1;
  const real force = only(touches, larger(o.f1 - o.fz1, each(0.0))),
             share = each(column(f, JLAW_SHARE));
  sum->sliding += share * only(touches, whole_slips);
  sum->slipping +=
      share * smaller(only(force > 0.0, held / pick(force > 0.0, force, 1.0)), each(1.0));
  sum->separated += share * pick(touches, 0.0, 1.0);
  real normal = psi(law, o.y1);
  if (law->yields) normal = normal - psi(law, o.z1) - o.fz1 * (o.y1 - o.z1);
  sum->normal += column(f, JLAW_POTENTIAL) * only(touches, larger(normal, each(0.0)));
  sum->sheared += column(f, JLAW_COMPLIANCE) * sheared;
#ifdef JLAW_ABREAST
  for (int l = 0; l < some; l++) *reach = *reach > o.y1[l] ? *reach : o.y1[l];
#else
  *reach = larger(*reach, o.y1);
#endif
}

IN amounts measure(const jlaw_law *law, numbers n)
{
  amount_sums sum[SUMS];
  amounts all;
  all.reach = each_joint(-DBL_MAX);
  const amount_sums none = {each(0.0), each(0.0), each(0.0), each(0.0), each(0.0)};
  for (int i = 0; i < SUMS; i++) sum[i] = none;
  for (int at = 0; at < law->facets; at += TOGETHER)
    measure_facets(law, n, at, sum + at / TOGETHER % SUMS, &all.reach);
  all.sliding = total(sum, sliding);
  all.slipping = total(sum, slipping);
  all.separated = total(sum, separated);
  all.sheared = total(sum, sheared);
  all.stored = total(sum, normal) + all.sheared;
  if (law->bonded) all.stored += step_bond(law, n, damage_row(law), NULL, NULL, 0, 0);
  return all;
}

/* ------------------------------------------------------------- kinds of a step */

IN kind kind_of(int dim, int yields, int fades, int wears, int ledger, int tangent, int kept)
{
  const kind k = {dim, yields, fades, wears, ledger, tangent, kept};
  return k;
}

/* The step, compiled for each kind: a plane costs half of space; a tangent or ledger that is not
 * asked for costs nothing. Where asperities yield or slopes wear, the law needs the ledger. */
IN void step_of_kind(const jlaw_law *law, numbers n, const of_joint d[3], of_joint F[3],
                     of_joint C[9], int ledger, int tangent, int kept)
{
#define STEP(dim, yields, fades, wears, ledger)                                         \
  (tangent ? step(law, n, d, F, C, kind_of(dim, yields, fades, wears, ledger, 1, kept)) \
           : step(law, n, d, F, C, kind_of(dim, yields, fades, wears, ledger, 0, kept)))
  const int dim = law->dim, y = law->yields, w = law->wears;
  if (law->fades && (y || w || dim == 1)) STEP(dim, y, 1, w, 1);
  else if (law->fades && dim == 3) STEP(3, 0, 1, 0, ledger);
  else if (law->fades) STEP(2, 0, 1, 0, ledger);
  else if (y || dim == 1) STEP(dim, y, 0, 0, 1);
  else if (dim == 3 && ledger) STEP(3, 0, 0, 0, 1);
  else if (dim == 3) STEP(3, 0, 0, 0, 0);
  else if (ledger) STEP(2, 0, 0, 0, 1);
  else STEP(2, 0, 0, 0, 0);
#undef STEP
  if (law->bonded) step_bond(law, n, damage_row(law), F, C, tangent, ledger || y || w);
}
