/* coulomb.h: Coulomb's joint, one of them; symbols and order of kernels/coulomb.py */

typedef struct {                     /* the part of a step in which faces touch */
  double q[2], dq[2], start, end, w; /* before; growth of q; normal stress at both ends */
  double now[2], w1, lost, trial[2], size, hold; /* after; q before it is cut to the strength */
  int slides;
} jl_coulomb_slip;

JL_INLINE double jl_coulomb_friction(const jlaw_law *law, double w)
{
  const double slid = w < 1.0 ? w : 1.0;
  return law->coulomb_friction + (law->coulomb_residual_friction - law->coulomb_friction) * slid;
}

/* Strength in shear at this w and this normal stress */
JL_INLINE double jl_coulomb_strength(const jlaw_law *law, double w, double sigma)
{
  const double c =
      law->coulomb_cohesion + (law->coulomb_residual_cohesion - law->coulomb_cohesion) * w;
  const double cap = (w > 1.0 ? 0.0 : c) + jl_coulomb_friction(law, w) * sigma;
  return cap > 0.0 ? cap : 0.0;
}

/* |q + t dq|, squared */
JL_INLINE double jl_squared_norm(const double q[2], double t, const double dq[2])
{
  const double x = q[0] + t * dq[0], y = q[1] + t * dq[1];
  return x * x + y * y;
}

/* Whether |q + t dq| is above cap + t rise at t = 1, and since which t; 1 if it is not */
JL_INLINE int jl_exceeds_strength(const double q[2], const double dq[2], double cap, double rise,
                                  double *at)
{
  *at = 1.0;
  if (!(sqrt(jl_squared_norm(q, 1.0, dq)) > (cap + rise) * (1.0 + JLAW_ROUNDING_TOLERANCE)))
    return 0;
  const double A = (dq[0] * dq[0] + dq[1] * dq[1]) - rise * rise;
  const double B = (q[0] * dq[0] + q[1] * dq[1]) - cap * rise;
  const double within = cap * cap - (q[0] * q[0] + q[1] * q[1]), C = within > 0.0 ? within : 0.0;
  const double inside = B * B + A * C, root = sqrt(inside > 0.0 ? inside : 0.0);
  const double top = B > 0.0 ? C : root - B, bottom = B > 0.0 ? B + root : A;
  const double t = bottom > 0.0 ? top / bottom : 0.0;
  *at = t < 1.0 ? t : 1.0;
  return 1;
}

/* Shear by dq while the normal stress goes from start to end */
JL_INLINE void jl_map_to_coulomb_limit(const jlaw_law *law, jl_coulomb_slip *s)
{
  const double first = jl_coulomb_strength(law, s->w, s->start), change = s->end - s->start;
  const double cap = jl_coulomb_strength(law, s->w, s->end);
  double at, done;
  s->slides = jl_exceeds_strength(s->q, s->dq, first, cap - first, &at);
  s->size = sqrt(jl_squared_norm(s->q, 1.0, s->dq));
  for (int i = 0; i < 2; i++) s->now[i] = s->trial[i] = s->q[i] + s->dq[i];
  s->w1 = s->w, s->hold = cap, s->lost = 0.0;
  if (!s->slides) return;

  const double way =
      law->coulomb_shear_stiffness * law->coulomb_weakening_length; /* of |q*| - k, w from 0 to 1 */
  const double far = way > 0.0 ? s->w + (s->size - cap) / way : 1.0;
  s->w1 = far < 1.0 ? far : s->w > 1.0 ? s->w : 1.0;
  s->hold = jl_coulomb_strength(law, s->w1, s->end);
  const double left = s->w < 1.0 ? 1.0 - s->w : 0.0;
  const int ends = jl_exceeds_strength(s->q, s->dq, first + way * left, cap - first, &done);
  if (ends && done < at) done = at;
  const double begin = jl_coulomb_strength(law, s->w, s->start + at * change);
  const double middle =
      jl_coulomb_strength(law, 0.5 * (s->w + s->w1), s->start + 0.5 * (at + done) * change);
  const double weak = jl_coulomb_strength(law, s->w1, s->start + done * change);
  const double reached = done < 1.0 ? sqrt(jl_squared_norm(s->q, done, s->dq)) : s->size;
  double area = (reached - begin) * (begin + 4.0 * middle + weak) / 6.0;
  area = area + (s->size - reached) * (0.5 * (weak + s->hold));
  const double lost = 0.5 * (begin * begin - s->hold * s->hold) + area;
  s->lost = lost > 0.0 ? lost / law->coulomb_shear_stiffness : 0.0;
  for (int i = 0; i < 2; i++) s->now[i] = s->hold / s->size * s->trial[i];
}

/* Tangent of a joint that touches; w is that before the slide, ks less in the step of touch */
JL_INLINE void jl_coulomb_tangent(const jlaw_law *law, const jl_coulomb_slip *s, double ks,
                                  double C[9])
{
  const double kn = law->coulomb_normal_stiffness, L = law->coulomb_weakening_length;
  double n[2] = {0.0, 0.0}, turn = s->hold > 0.0 ? ks : 0.0, across = turn, push = 0.0;
  if (s->size > 0.0) n[0] = s->trial[0] / s->size, n[1] = s->trial[1] / s->size;
  if (s->slides) {
    turn = ks * s->hold / s->size, across = 0.0;
    push = kn * jl_coulomb_friction(law, s->w1);
    if (s->w1 < 1.0) {
      const double slope =
          (jl_coulomb_strength(law, 0.0, s->end) - jl_coulomb_strength(law, 1.0, s->end)) / L;
      across = across - slope;
      push = push + slope * (kn * jl_coulomb_friction(law, s->w) / law->coulomb_shear_stiffness);
    }
  }
  C[0] = kn;
  for (int i = 1; i < law->dim; i++) {
    C[3 * i] = push * n[i - 1];
    for (int j = 1; j < law->dim; j++)
      C[3 * i + j] = (i == j ? turn : 0.0) + (across - turn) * n[i - 1] * n[j - 1];
  }
}

/* One step of Coulomb's joint; returns the stored energy after it */
JL_INLINE double jl_coulomb_step(const jlaw_law *law, jl_element_step *p, int tangent)
{
  const double kn = law->coulomb_normal_stiffness, ks = law->coulomb_shear_stiffness,
               T = law->coulomb_tension;
  const int last = law->dim - 1, intact = p->row[last] == 0.0;
  const double u = p->from[0] + p->d[0], before = kn * p->from[0], after = kn * u;
  const double change = after - before, moved = change == 0.0 ? 1.0 : fabs(change);
  jl_coulomb_slip s = {{0.0}, {0.0}, before, after, p->row[last], {0.0},
                       0.0,   0.0,   {0.0},  0.0,   0.0,          0};
  for (int i = 0; i < 3; i++) p->F[i] = 0.0;
  for (int i = 0; i < 9; i++) p->C[i] = 0.0;
  for (int i = 0; i < last; i++) s.q[i] = p->row[i];

  /* an intact joint leaves what it bears once; under tension it tears */
  const int pulled = after < -T * (1.0 + JLAW_ROUNDING_TOLERANCE);
  double torn = 0.0, at, until = 1.0, to = after;
  int leaves = 0, tears = 0;
  if (intact) {
    if (pulled) {
      const double met = (before + T) / moved;
      until = met < 0.0 ? 0.0 : met < 1.0 ? met : 1.0, to = -T;
    }
    for (int i = 0; i < last; i++) s.dq[i] = ks * p->d[i + 1] * until;
    const double cap = jl_coulomb_strength(law, 0.0, before);
    leaves = jl_exceeds_strength(s.q, s.dq, cap, jl_coulomb_strength(law, 0.0, to) - cap, &at);
    const double sigma = before + at * (to - before);
    tears = leaves ? sigma < 0.0 : pulled;
    if (tears) torn = 0.5 * sigma * sigma / kn + 0.5 * jl_squared_norm(s.q, at, s.dq) / ks;
  }

  /* the part of the step in which faces touch */
  const int held = intact && !leaves && !pulled, touches = held || after >= 0.0;
  const int apart = tears || (!intact && p->from[0] < 0.0), parts = !touches && !apart;
  double share = parts ? before / moved : 1.0;
  if (apart) {
    share = (after > 0.0 ? after : 0.0) / moved;
    s.start = 0.0, s.w = JLAW_SEPARATED_STATE, s.q[0] = s.q[1] = 0.0;
  }
  s.end = touches ? after : 0.0;
  for (int i = 0; i < last; i++) s.dq[i] = ks * p->d[i + 1] * share;
  jl_map_to_coulomb_limit(law, &s);
  const double shear = 0.5 * (s.now[0] * s.now[0] + s.now[1] * s.now[1]) / ks;
  p->lost = torn + s.lost + (parts ? shear : 0.0);
  for (int i = 0; i < last; i++) p->F[i + 1] = p->row[i] = touches ? s.now[i] : 0.0;
  p->F[0] = s.end;
  p->row[last] = touches ? s.w1 : JLAW_SEPARATED_STATE;
  if (tangent && touches) jl_coulomb_tangent(law, &s, ks * share, p->C);
  return touches ? 0.5 * kn * u * u + shear : 0.0;
}

JL_INLINE int jl_coulomb_rows(const jlaw_law *law) { return law->dim; }

JL_INLINE double jl_coulomb_stiffness(const jlaw_law *law, double damage, double closure)
{
  if (damage > 0.0 && closure < 0.0) return 0.0; /* apart */
  const double mu = jl_coulomb_friction(law, law->coulomb_weakening_length > 0.0 ? damage : 1.0);
  const double slides =
      law->coulomb_normal_stiffness * (mu < JLAW_INFINITE_FRICTION ? sqrt(1.0 + mu * mu) : 1.0);
  return slides > law->coulomb_shear_stiffness ? slides : law->coulomb_shear_stiffness;
}

/* Shares of element.Measures in a state of these numbers: slides, of the strength too; is apart */
JL_INLINE void jl_coulomb_fractions(const jlaw_law *law, const double *s, size_t stride,
                                    double shares[3])
{
  const int dim = law->dim;
  const double u = s[0], *row = s + (size_t) (dim + 1) * stride;
  const double w = row[(size_t) (dim - 1) * stride], q[2] = {row[0], dim > 2 ? row[stride] : 0.0};
  const double none[2] = {0.0, 0.0},
               cap = jl_coulomb_strength(law, w, law->coulomb_normal_stiffness * u);
  const int apart = w > 0.0 && u < 0.0;
  shares[0] = shares[1] =
      !apart && sqrt(jl_squared_norm(q, 0.0, none)) >= cap * (1.0 - JLAW_FRICTION_TOLERANCE);
  shares[2] = apart;
}
