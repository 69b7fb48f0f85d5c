/* law.h: one step of a rock joint, and what a state amounts to, in lanes (lanes.h).
 *
 * Symbols and order are those of docs/theory-incremental.md and of kernels/reference.py. Rows of
 * a state: delta (dim) | in-plane offset (dim - 1) | dissipated energy | q_s (M D) | q_t (M D),
 * q times lam; where asperities yield flattened depth (M) | plastic work; with wear slip of the
 * asperities | by how much mu had fallen in the last step. A batch keeps beside them Phi and Phi'
 * of every facet (M each), which saves half the look-ups, and with yielding the same at z.
 *
 * Of the functions of the C library that round differently, only expm1, log1p, pow and hypot are
 * called: zig links exp and log of its own.
 */

typedef struct { /* what the compiler knows of a step: it leaves out the rest */
  int dim, yields, wears, ledger, tangent;
  int kept; /* whether Phi and Phi' lie beside the state */
} kind;

typedef struct {                 /* a joint in a step */
  of_joint p[3], from[3], to[3]; /* increment; closure and in-plane offset before and after */
  of_joint J[4], slip;           /* d offset/d p; way along the offset at its limit */
  of_joint worn, since;          /* mu over that of unworn asperities; over that of the last step */
} motion;

typedef struct { /* facets in a step: y, Phi, Phi', Phi'' before and after; de */
  real y0, y1, f0, f1, k0, k1, bend, es, et;
  real dy, rdy;                             /* y1 - y0, and 1 over it */
  yes near;                                 /* y has hardly changed */
  real z0, z1, fz0, fz1, kz0, kz1;          /* flattened depth; Phi and Phi' there */
  real qs, qt, lost, vs, vt, bss, bst, btt; /* sums over the cells: q, loss, v and B of C */
  real ws, wt, open;                        /* the same of the softening by z1; any kappa */
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
  real F[3], C[9], pull[2], lost;
  real crushed, normal; /* plastic work; A Phi before and after */
} sums;

/* Rows of a state: the first after the sliders, that of the slip of the asperities, and how many */
IN int rest_row(const jlaw_law *law) { return 2 * law->dim + 2 * law->facets * law->cells; }
IN int slip_row(const jlaw_law *law) { return rest_row(law) + (law->yields ? law->facets + 1 : 0); }
IN int state_rows(const jlaw_law *law) { return slip_row(law) + 2 * law->wears; }

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

/* y^eta, zero at y = 0 */
IN real power_of(const jlaw_law *law, const spot *at)
{
  real power = at->v;
  if (law->eta == 0.0) power = only(at->y > 0.0, each(1.0));
  else if (law->eta != 0.5)
    for (int l = 0; l < W; l++)
      LANE(power, l) = LANE(at->y, l) > 0.0 ? pow(LANE(at->y, l), law->eta) : 0.0;
  return power;
}

/* w^rise of curves that are tabulated over it, w = y/(y + V^2) */
IN real rise_of(const jlaw_law *law, real w)
{
  for (int l = 0; l < W; l++) LANE(w, l) = LANE(w, l) > 0.0 ? pow(LANE(w, l), law->rise) : 0.0;
  return w;
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
    const real up = rise_of(law, w);
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
  if (law->rise > 0.0) T = T * rise_of(law, at.y / (at.y + law->scale * law->scale));
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

/* G and kappa of a cell less what it holds, H, at the flattened depth z: "Yielding" */
IN void flatten(real y, real z, real H, real *G, real *kappa)
{
  const real over = y - z;
  *kappa = only(over > 0.0, *kappa);
  *G = larger(smaller(*G - H, *kappa * over), each(0.0));
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
  if (law->critical_slip < DBL_MAX) /* one depth for a facet and its opposite */
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

/* ------------------------------------------------------------------------------- wear */

/* mu after the slip of the asperities, over that of unworn ones and over that of the last step */
IN void wear_friction(const jlaw_law *law, of_joint slip, of_joint fallen, motion *m)
{
  m->worn = m->since = each_joint(1.0);
  if (!(law->mu > 0.0)) return;
  for (int l = 0; l < JOINTS; l++) {
    const double left = 1.0 + expm1(-JOINT(slip, l) / law->wear_slip);
    const double now = law->mu_residual + (law->mu - law->mu_residual) * left;
    const double last = law->mu - JOINT(fallen, l);
    JOINT(m->worn, l) = now / law->mu;
    JOINT(m->since, l) = now < last ? now / last : 1.0;
  }
}

/* mu has fallen: sliders come back to their limit, and lose what they held beyond it */
IN void wear_sliders(const sliders *c, of_joint since, real *qs, real *qt, real *lost)
{
  const real size2 = *qs * *qs + *qt * *qt, cap = c->strength * c->G0;
  const real back = pick(size2 > cap * cap, each(0.0) + since, 1.0);
  const real gone = (1.0 - back) * (1.0 + back) * size2;
  *lost += only(c->k0 > JLAW_TINY, gone / pick(c->k0 > JLAW_TINY, c->k0, 1.0));
  *qs = back * *qs;
  *qt = back * *qt;
}

/* ------------------------------------------------------------------------ large shear */

/* The in-plane offset a of one joint moves by p, dragged along at its limit D; then it is to[0],
 * to[1], its way along itself to[2], and its derivative by p to[3] to to[6] */
IN void drag(double D, int dim, double a0, double a1, double p0, double p1, double to[7])
{
  const double length = hypot(p0, p1), e0 = p0 / length, e1 = p1 / length;
  const double along = a0 * e0 + a1 * e1;
  const double before = D * D - (a0 * a0 + a1 * a1) + along * along;
  double inside = sqrt(before > 0.0 ? before : 0.0) - along; /* way until it is at its limit */
  inside = inside > 0.0 ? (inside < length ? inside : length) : 0.0;
  a0 += inside * e0;
  a1 += inside * e1;
  const double x = (length - inside) / D, rest = -expm1(-x), decay = 1.0 - rest;
  double cosine = (a0 * e0 + a1 * e1) / D;
  cosine = cosine > 0.0 ? (cosine < 1.0 ? cosine : 1.0) : 0.0;
  const double sine = (a1 * e0 - a0 * e1) / D;
  const double bottom = (1.0 + cosine) + (1.0 - cosine) * decay * decay;
  const double cos1 = ((1.0 + cosine) - (1.0 - cosine) * decay * decay) / bottom;
  const double sin1 = 2.0 * sine * decay / bottom;
  to[0] = D * (cos1 * e0 - sin1 * e1);
  to[1] = D * (cos1 * e1 + sin1 * e0);
  to[2] = D * (x + log1p(0.5 * bottom - 1.0));
  const double grazing = cosine > JLAW_GRAZING ? cosine : JLAW_GRAZING;
  double turn = (rest * rest + cosine * rest * (1.0 + decay)) / bottom;
  turn += inside / (D * grazing) * (2.0 * decay / bottom - sin1 * sine);
  turn /= length;
  const int turns = dim == 3; /* along one line the offset does not turn */
  const double row0 = turns ? -turn * e1 - sin1 / D * e0 : 0.0;
  const double row1 = turns ? turn * e0 - sin1 / D * e1 : 0.0;
  to[3] = -to[1] * row0;
  to[4] = -to[1] * row1;
  to[5] = to[0] * row0;
  to[6] = to[0] * row1;
}

/* Offsets that have come to their limit are dragged along: "Large shear" */
IN void limit_offset(const jlaw_law *law, int dim, motion *m)
{
  const double D = law->critical_slip;
  m->J[0] = m->J[3] = each_joint(1.0);
  m->J[1] = m->J[2] = m->slip = each_joint(0.0);
  if (!(D < DBL_MAX) || dim == 1) return;
  for (int l = 0; l < JOINTS; l++) {
    const double p0 = JOINT(m->p[1], l), p1 = dim > 2 ? JOINT(m->p[2], l) : 0.0;
    const double a0 = JOINT(m->from[1], l), a1 = dim > 2 ? JOINT(m->from[2], l) : 0.0;
    const double b0 = a0 + p0, b1 = a1 + p1;
    if (!(b0 * b0 + b1 * b1 > D * D) || !(b0 * p0 + b1 * p1 > 0.0)) continue;
    double to[7];
    drag(D, dim, a0, a1, p0, p1, to);
    JOINT(m->to[1], l) = to[0];
    if (dim > 2) JOINT(m->to[2], l) = to[1];
    JOINT(m->slip, l) = to[2];
    for (int j = 0; j < 4; j++) JOINT(m->J[j], l) = to[3 + j];
  }
}

/* Energy that dragging the offset takes; pull: the in-plane part of the normal forces */
IN of_joint drag_loss(const jlaw_law *law, int dim, const motion *m, const sums *sum)
{
  of_joint along = total(sum, pull[0]) * m->to[1];
  if (dim > 2) along += total(sum, pull[1]) * m->to[2];
  for (int l = 0; l < JOINTS; l++) /* >= 0 by symmetry of the facets, but for rounding */
    JOINT(along, l) = JOINT(along, l) > 0.0 ? JOINT(along, l) : 0.0;
  return m->slip * along / law->critical_slip;
}

/* --------------------------------------------------------------------------- one step */

/* G and kappa of a cell before and after the step. What G gains is taken from the virgin curve: the
 * bounds of `flatten` would show in it where that curve is small and hardly convex. */
IN void cells_of(const double *cell, const facets *o, sliders *c, int yields)
{
  share_of(cell, o->y0, o->f0, o->k0, &c->G0, &c->k0);
  share_of(cell, o->y1, o->f1, o->k1, &c->G1, &c->k1);
  c->gained = c->G1 - c->G0;
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
  if (k.yields) {
    const yes pulls = limited & (c->k1 > 0.0);
    const real pull = c->strength * only(pulls, c->kz1);
    o->ws += pull * us;
    o->wt += pull * ut;
    o->open += c->k1;
  }
}

/* One depth cell of facets: from the sliders before the step to those after it */
IN void slide(const double *f, const double *cell, const motion *m, facets *o, real *qs, real *qt,
              kind k)
{
  sliders c;
  cells_of(cell, o, &c, k.yields);
  c.strength = each(column(f, JLAW_STRENGTH));
  if (k.wears) {
    c.strength = c.strength * m->worn;
    wear_sliders(&c, m->since, qs, qt, &o->lost);
  }
  load(f, o, &c, qs, qt, k);
  o->qs += *qs;
  o->qt += *qt;
  if (k.ledger) o->lost += friction_loss(&c);
  if (k.tangent) slide_tangent(f, cell, &c, o, k);
}

/* C += along g^T + E^T B E of facets; where the flattened depth moves, less softening g_z^T */
IN void add_tangent(const jlaw_law *law, const double *f, const motion *m, const facets *o,
                    sums *sum, kind k)
{
  const int drags = law->critical_slip < DBL_MAX;
  const yes moves = (o->z1 - o->z0 > JLAW_ROUNDED * o->z1) & (o->open > 0.0);
  const yes own = flattens_itself(f, o);
  for (int i = 0; i < k.dim; i++) {
    const of_facet n = column(f, JLAW_N + i) * column(f, JLAW_A);
    const of_facet s = column(f, JLAW_S + i) * law->soft, t = column(f, JLAW_T + i) * law->soft;
    const real along = n * o->k1 + s * o->vs + t * o->vt;
    const real left = s * o->bss + t * o->bst, right = s * o->bst + t * o->btt;
    for (int j = 0; j < k.dim; j++) {
      real g = each(column(f, JLAW_M + j)); /* dy/dd */
      if (j > 0 && drags) {
        g = column(f, JLAW_M + 1) * m->J[j - 1];
        if (k.dim > 2) g += column(f, JLAW_M + 2) * m->J[j + 1];
      }
      real to = along * g + left * column(f, JLAW_S + j) + right * column(f, JLAW_T + j);
      if (k.yields) {
        const real less = only(moves, n * o->kz1 + s * o->ws + t * o->wt);
        to -= j > 0 ? less * pick(own, g, -g) : less * g;
      }
      sum->C[3 * i + j] += to;
    }
  }
}

/* Facets from number `at` on: closures, virgin curve, sliders, and their part of F and C */
IN void step_facets(const jlaw_law *law, int at, const motion *m, numbers n, sums *sum, kind k)
{
  const int M = law->facets, D = law->cells, some = M - at < TOGETHER ? M - at : TOGETHER;
  const int kept = k.kept ? state_rows(law) : 0;
  const double *f = facet_of(law, at), *cell = cell_of(law, at);
  facets o;
  o.y0 = o.y1 = o.es = o.et = o.bend = each(0.0);
  for (int i = 0; i < k.dim; i++) {
    o.y0 += column(f, JLAW_M + i) * m->from[i];
    o.y1 += column(f, JLAW_M + i) * m->to[i];
    o.es += column(f, JLAW_S + i) * m->p[i];
    if (i > 0) o.et += column(f, JLAW_T + i) * m->p[i];
  }
  if (!k.yields && !any((o.y0 > 0.0) | (o.y1 > 0.0))) return; /* apart: all it holds is zero */
  o.y0 = resolved(o.y0);
  o.y1 = resolved(o.y1);
  o.dy = o.y1 - o.y0;
  o.rdy = 1.0 / o.dy;
  o.near = size_of(o.dy) <= JLAW_NEAR * size_of(o.y1);
  o.qs = o.qt = o.lost = o.vs = o.vt = o.bss = o.bst = o.btt = o.ws = o.wt = o.open = each(0.0);
  if (k.kept) {
    o.f0 = take(n, kept + at, 1, some);
    o.k0 = take(n, kept + M + at, 1, some);
  } else virgin_curve(law, o.y0, &o.f0, &o.k0, (real *) 0);
  virgin_curve(law, o.y1, &o.f1, &o.k1, k.tangent ? &o.bend : (real *) 0);
  if (k.kept) {
    put(n, kept + at, 1, some, o.f1);
    put(n, kept + M + at, 1, some, o.k1);
  }
  o.z0 = o.z1 = o.fz0 = o.fz1 = o.kz0 = o.kz1 = each(0.0);
  if (k.yields) press(law, f, n, kept, at, some, m, &o);
  for (int i = 0; i < D; i++, cell += JLAW_ROWS * JLAW_LANES) {
    const of_facet low = column(cell, JLAW_LOW);
    if (!any((o.y0 > low) | (o.y1 > low))) break; /* nor does what is deeper */
    const int row = 2 * k.dim + at * D + i;
    real qs = take(n, row, D, some), qt = take(n, row + M * D, D, some);
    slide(f, cell, m, &o, &qs, &qt, k);
    put(n, row, D, some, qs);
    put(n, row + M * D, D, some, qt);
  }
  if (k.yields) {
    sum->crushed += column(f, JLAW_POTENTIAL) * crush(f, &o);
    flatten_facets(o.y0, o.z0, o.fz0, &o.f0, &o.k0);
    flatten_facets(o.y1, o.z1, o.fz1, &o.f1, &o.k1);
  }
  if (k.wears) sum->normal += column(f, JLAW_A) * (o.f0 + o.f1);
  if (k.ledger) sum->lost += column(f, JLAW_COMPLIANCE) * o.lost;
  const real normal = column(f, JLAW_A) * o.f1, qs = law->soft * o.qs, qt = law->soft * o.qt;
  for (int i = 0; i < k.dim; i++) {
    const real pull = column(f, JLAW_N + i) * normal;
    sum->F[i] += pull + (column(f, JLAW_S + i) * qs + column(f, JLAW_T + i) * qt);
    if (i > 0 && k.ledger) sum->pull[i - 1] += pull;
  }
  if (k.tangent) add_tangent(law, f, m, &o, sum, k);
}

/* Advance joints by the increments d: their numbers n, F (dim), and C (dim, dim) for a tangent */
IN void step(const jlaw_law *law, numbers n, const of_joint d[3], of_joint F[3], of_joint C[9],
             kind k)
{
  const int dim = k.dim, M = law->facets, rest = rest_row(law), slip = slip_row(law);
  motion m;
  sums sum[SUMS];
  for (int i = 0; i < 3; i++) {
    m.p[i] = i < dim ? d[i] : each_joint(0.0);
    m.from[i] = i < dim ? take_joint(n, i ? dim + i - 1 : 0) : each_joint(0.0);
    m.to[i] = m.from[i] + m.p[i];
  }
  limit_offset(law, dim, &m);
  m.worn = m.since = each_joint(1.0);
  if (k.wears) wear_friction(law, take_joint(n, slip), take_joint(n, slip + 1), &m);
  for (int i = 0; i < SUMS; i++) {
    for (int j = 0; j < 3; j++) sum[i].F[j] = each(0.0);
    for (int j = 0; k.tangent && j < 9; j++) sum[i].C[j] = each(0.0);
    sum[i].pull[0] = sum[i].pull[1] = sum[i].lost = sum[i].crushed = sum[i].normal = each(0.0);
  }
  for (int at = 0; at < M; at += TOGETHER)
    step_facets(law, at, &m, n, sum + at / TOGETHER % SUMS, k);
  for (int i = 0; i < dim; i++) {
    F[i] = total(sum, F[i]);
    for (int j = 0; k.tangent && j < dim; j++) C[dim * i + j] = total(sum, C[3 * i + j]);
    put_joint(n, i, take_joint(n, i) + m.p[i]);
    if (i > 0) put_joint(n, dim + i - 1, m.to[i]);
  }
  if (!k.ledger) return;
  of_joint lost = total(sum, lost);
  if (dim > 1 && law->critical_slip < DBL_MAX) lost += drag_loss(law, dim, &m, sum);
  if (k.wears) { /* slip of the asperities: the loss over the mean friction limit */
    const of_joint limit = 0.5 * law->mu * m.worn * total(sum, normal);
    of_joint way = take_joint(n, slip);
    for (int l = 0; l < JOINTS; l++)
      if (JOINT(limit, l) > 0.0) JOINT(way, l) += JOINT(lost, l) / JOINT(limit, l);
    put_joint(n, slip, way);
    put_joint(n, slip + 1, law->mu - law->mu * m.worn);
  }
  if (k.yields) {
    const of_joint crushed = total(sum, crushed);
    put_joint(n, rest + M, take_joint(n, rest + M) + crushed);
    lost += crushed;
  }
  put_joint(n, 2 * dim - 1, take_joint(n, 2 * dim - 1) + lost);
}

/* ------------------------------------------------------------------ what a state is */

/* Facets from number `at` on in a state: y and z with the virgin curve there, as y1 and z1 */
IN void facets_now(const jlaw_law *law, numbers n, int at, facets *o)
{
  const int dim = law->dim, some = law->facets - at < TOGETHER ? law->facets - at : TOGETHER;
  const double *f = facet_of(law, at);
  o->y1 = o->z1 = o->fz1 = o->kz1 = each(0.0);
  for (int i = 0; i < dim; i++) o->y1 += column(f, JLAW_M + i) * take_joint(n, i ? dim + i - 1 : 0);
  o->y1 = resolved(o->y1);
  virgin_curve(law, o->y1, &o->f1, &o->k1, (real *) 0);
  if (!law->yields) return;
  o->z1 = take(n, rest_row(law) + at, 1, some);
  virgin_curve(law, o->z1, &o->fz1, &o->kz1, (real *) 0);
}

/* G and kappa of a cell of these facets */
IN void cell_now(const double *cell, const facets *o, int yields, real *G, real *kappa)
{
  share_of(cell, o->y1, o->f1, o->k1, G, kappa);
  if (!yields) return;
  real H, kz;
  share_of(cell, o->z1, o->fz1, o->kz1, &H, &kz);
  flatten(o->y1, o->z1, H, G, kappa);
}

/* Friction now over that of unworn asperities */
IN of_joint worn_now(const jlaw_law *law, numbers n)
{
  const int slip = slip_row(law);
  motion m;
  m.worn = each_joint(1.0);
  if (law->wears) wear_friction(law, take_joint(n, slip), take_joint(n, slip + 1), &m);
  return m.worn;
}

typedef struct { /* as reference.Measures; the energies of normal and shear springs */
  of_joint sliding, slipping, separated, normal, sheared, reach;
} amounts;

typedef struct {
  real sliding, slipping, separated, normal, sheared;
} amount_sums;

IN void measure_facets(const jlaw_law *law, numbers n, int at, of_joint worn, amount_sums *sum,
                       of_joint *reach)
{
  const int M = law->facets, D = law->cells, some = M - at < TOGETHER ? M - at : TOGETHER;
  const double *f = facet_of(law, at), *cell = cell_of(law, at);
  const real strength = column(f, JLAW_STRENGTH) * worn, one = each(1.0);
  real held = each(0.0), sheared = each(0.0), whole_slips = one;
  facets o;
  facets_now(law, n, at, &o);
  for (int i = 0; i < D && any(o.y1 > column(cell, JLAW_LOW)); i++) {
    real G, kappa;
    const int row = 2 * law->dim + at * D + i;
    const real qs = take(n, row, D, some), qt = take(n, row + M * D, D, some);
    cell_now(cell, &o, law->yields, &G, &kappa);
    const real q2 = qs * qs + qt * qt;
    const yes stiff = kappa > JLAW_TINY;
    const yes limited = root(q2) >= strength * (G * (1.0 - JLAW_LIMIT) - JLAW_ROUNDED * o.f1);
    held += only(limited, G);
    whole_slips = only(limited, whole_slips);
    sheared += only(stiff, q2 / pick(stiff, kappa, 1.0));
    cell += JLAW_ROWS * JLAW_LANES;
  }
  const yes touches = o.y1 > o.z1;
  const real force = only(touches, larger(o.f1 - o.fz1, each(0.0))),
             share = each(column(f, JLAW_SHARE));
  real normal = psi(law, o.y1);
  if (law->yields) normal = normal - psi(law, o.z1) - o.fz1 * (o.y1 - o.z1);
  sum->sliding += share * only(touches, whole_slips);
  sum->slipping += share * smaller(only(force > 0.0, held / pick(force > 0.0, force, 1.0)), one);
  sum->separated += share * pick(touches, 0.0, 1.0);
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
  const of_joint worn = worn_now(law, n);
  amount_sums sum[SUMS];
  amounts all;
  all.reach = each_joint(-DBL_MAX);
  for (int i = 0; i < SUMS; i++)
    sum[i].sliding = sum[i].slipping = sum[i].separated = sum[i].normal = sum[i].sheared =
        each(0.0);
  for (int at = 0; at < law->facets; at += TOGETHER)
    measure_facets(law, n, at, worn, sum + at / TOGETHER % SUMS, &all.reach);
  all.sliding = total(sum, sliding);
  all.slipping = total(sum, slipping);
  all.separated = total(sum, separated);
  all.normal = total(sum, normal);
  all.sheared = total(sum, sheared);
  return all;
}

/* ------------------------------------------------------------- kinds of a step */

IN kind kind_of(int dim, int yields, int wears, int ledger, int tangent, int kept)
{
  const kind k = {dim, yields, wears, ledger, tangent, kept};
  return k;
}

/* The step, compiled for each kind apart: a plane costs half of space, and what is not asked for
 * nothing. Where asperities yield or wear, the ledger is part of the law. */
IN void step_of_kind(const jlaw_law *law, numbers n, const of_joint d[3], of_joint F[3],
                     of_joint C[9], int ledger, int tangent, int kept)
{
  const int dim = law->dim, y = law->yields, w = law->wears;
  if (y || w || dim == 1) {
    if (tangent) step(law, n, d, F, C, kind_of(dim, y, w, 1, 1, kept));
    else step(law, n, d, F, C, kind_of(dim, y, w, 1, 0, kept));
  } else if (dim == 3) {
    if (tangent) step(law, n, d, F, C, kind_of(3, 0, 0, ledger, 1, kept));
    else if (ledger) step(law, n, d, F, C, kind_of(3, 0, 0, 1, 0, kept));
    else step(law, n, d, F, C, kind_of(3, 0, 0, 0, 0, kept));
  } else {
    if (tangent) step(law, n, d, F, C, kind_of(2, 0, 0, ledger, 1, kept));
    else if (ledger) step(law, n, d, F, C, kind_of(2, 0, 0, 1, 0, kept));
    else step(law, n, d, F, C, kind_of(2, 0, 0, 0, 0, kept));
  }
}
