/* coulomb.h: Coulomb's law for one joint; symbols and order of kernels/coulomb.py.
 *
 * A spring in closure and a spring-slider in shear: the shear stress q is at most c + mu sigma. The
 * state w softens both from their intact values (w = 0) to the residual ones (w = 1) with slip.
 * After separation (w = JLAW_SEPARATED_STATE) cohesion and tension are zero.
 *
 * A step moves the normal stress and the trial shear stress along a straight line, on which four
 * events can lie: the line leaves the strength of the intact joint (slip, or tensile failure), the
 * faces separate, separated faces touch again, softening is complete. The
 * admissible stresses form a convex set, which a straight line leaves at most once, so each event has
 * a closed form and a step needs no substeps. */

typedef struct {          /* the part of a step in which the faces touch */
  double q[2], dq[2], w;  /* shear stress and softening before; elastic increment of q */
  double start, end;      /* normal stress */
  double q1[2], w1, loss; /* after; dissipated energy */
  double trial[2], size;  /* q + dq and its size */
  double strength;        /* at the end of the step, after softening */
  int slides;
} jl_coulomb_slip;

JL_INLINE double jl_coulomb_friction(const jlaw_law *law, double w)
{
  const double softening = w < 1.0 ? w : 1.0;
  return law->coulomb_friction
         + (law->coulomb_residual_friction - law->coulomb_friction) * softening;
}

/* Shear strength at this w and normal stress */
JL_INLINE double jl_coulomb_strength(const jlaw_law *law, double w, double sigma)
{
  const double c =
      law->coulomb_cohesion + (law->coulomb_residual_cohesion - law->coulomb_cohesion) * w;
  const double strength = (w > 1.0 ? 0.0 : c) + jl_coulomb_friction(law, w) * sigma;
  return strength > 0.0 ? strength : 0.0;
}

/* |q + t dq|^2 */
JL_INLINE double jl_squared_norm(const double q[2], double t, const double dq[2])
{
  const double x = q[0] + t * dq[0], y = q[1] + t * dq[1];
  return x * x + y * y;
}

/* Whether |q + t dq| exceeds limit + t growth at t = 1. at: the t from which on it does, else 1 */
JL_INLINE int jl_exceeds_strength(const double q[2], const double dq[2], double limit,
                                  double growth, double *at)
{
  *at = 1.0;
  if (!(sqrt(jl_squared_norm(q, 1.0, dq)) > (limit + growth) * (1.0 + JLAW_ROUNDING_TOLERANCE)))
    return 0;
  const double A = (dq[0] * dq[0] + dq[1] * dq[1]) - growth * growth;
  const double B = (q[0] * dq[0] + q[1] * dq[1]) - limit * growth;
  const double margin = limit * limit - (q[0] * q[0] + q[1] * q[1]);
  const double C = margin > 0.0 ? margin : 0.0;
  const double discriminant = B * B + A * C;
  const double root = sqrt(discriminant > 0.0 ? discriminant : 0.0);
  const double numerator = B > 0.0 ? C : root - B, denominator = B > 0.0 ? B + root : A;
  const double t = denominator > 0.0 ? numerator / denominator : 0.0;
  *at = t < 1.0 ? t : 1.0;
  return 1;
}

/* Return q + dq to the strength while the normal stress changes from start to end */
JL_INLINE void jl_map_to_coulomb_limit(const jlaw_law *law, jl_coulomb_slip *s)
{
  const double strength0 = jl_coulomb_strength(law, s->w, s->start), change = s->end - s->start;
  const double strength_end = jl_coulomb_strength(law, s->w, s->end);
  const double growth = strength_end - strength0;
  double slip_start, softened_at;
  s->slides = jl_exceeds_strength(s->q, s->dq, strength0, growth, &slip_start);
  s->size = sqrt(jl_squared_norm(s->q, 1.0, s->dq));
  for (int i = 0; i < 2; i++) s->q1[i] = s->trial[i] = s->q[i] + s->dq[i];
  s->w1 = s->w, s->strength = strength_end, s->loss = 0.0;
  if (!s->slides) return;

  /* w grows by slip = (|trial| - strength)/ks over the weakening length, up to 1 */
  const double softening_stress = law->coulomb_shear_stiffness * law->coulomb_weakening_length;
  const double w =
      softening_stress > 0.0 ? s->w + (s->size - strength_end) / softening_stress : 1.0;
  s->w1 = w < 1.0 ? w : s->w > 1.0 ? s->w : 1.0;
  s->strength = jl_coulomb_strength(law, s->w1, s->end);

  /* loss: stored energy where slip begins, plus the work of the strength, minus the stored energy at
   * the end. The work is integrated over |trial|: Simpson's rule while the joint softens, where the
   * strength is quadratic, and the trapezoidal rule after it, where it is linear */
  const double remaining = s->w < 1.0 ? 1.0 - s->w : 0.0;
  const int softens_fully =
      jl_exceeds_strength(s->q, s->dq, strength0 + softening_stress * remaining, growth,
                          &softened_at);
  if (softens_fully && softened_at < slip_start) softened_at = slip_start;
  const double begin = jl_coulomb_strength(law, s->w, s->start + slip_start * change);
  const double middle = jl_coulomb_strength(law, 0.5 * (s->w + s->w1),
                                            s->start + 0.5 * (slip_start + softened_at) * change);
  const double softened = jl_coulomb_strength(law, s->w1, s->start + softened_at * change);
  const double reached =
      softened_at < 1.0 ? sqrt(jl_squared_norm(s->q, softened_at, s->dq)) : s->size;
  double work = (reached - begin) * (begin + 4.0 * middle + softened) / 6.0;
  work = work + (s->size - reached) * (0.5 * (softened + s->strength));
  const double loss = 0.5 * (begin * begin - s->strength * s->strength) + work;
  s->loss = loss > 0.0 ? loss / law->coulomb_shear_stiffness : 0.0;
  for (int i = 0; i < 2; i++) s->q1[i] = s->strength / s->size * s->trial[i];
}

/* Tangent of a joint whose faces touch; w before the step. ks: shear stiffness, reduced in the step in
 * which the faces touch first */
JL_INLINE void jl_coulomb_tangent(const jlaw_law *law, const jl_coulomb_slip *s, double ks,
                                  double C[9])
{
  const double kn = law->coulomb_normal_stiffness, L = law->coulomb_weakening_length;
  double n[2] = {0.0, 0.0};                     /* direction of the trial stress */
  double across = s->strength > 0.0 ? ks : 0.0; /* stiffness at a right angle to n */
  double along = across, normal = 0.0; /* along n; derivative of q with respect to closure */
  if (s->size > 0.0) n[0] = s->trial[0] / s->size, n[1] = s->trial[1] / s->size;
  if (s->slides) {
    across = ks * s->strength / s->size, along = 0.0;
    normal = kn * jl_coulomb_friction(law, s->w1);
    if (s->w1 < 1.0) {
      const double softening =
          (jl_coulomb_strength(law, 0.0, s->end) - jl_coulomb_strength(law, 1.0, s->end)) / L;
      along = along - softening;
      normal =
          normal + softening * (kn * jl_coulomb_friction(law, s->w) / law->coulomb_shear_stiffness);
    }
  }
  C[0] = kn;
  for (int i = 1; i < law->dim; i++) {
    C[3 * i] = normal * n[i - 1];
    for (int j = 1; j < law->dim; j++)
      C[3 * i + j] = (i == j ? across : 0.0) + (along - across) * n[i - 1] * n[j - 1];
  }
}

/* One step of Coulomb's law; returns the stored energy at its end */
JL_INLINE double jl_coulomb_step(const jlaw_law *law, jl_element_step *p, int tangent)
{
  const double kn = law->coulomb_normal_stiffness, ks = law->coulomb_shear_stiffness;
  const double tension = law->coulomb_tension;
  const int last = law->dim - 1, intact = p->row[last] == 0.0;
  const double u = p->from[0] + p->d[0], before = kn * p->from[0], after = kn * u;
  const double change = after - before, size = change == 0.0 ? 1.0 : fabs(change);
  jl_coulomb_slip s = {{0.0}, {0.0}, p->row[last], before, after, {0.0},
                       0.0,   0.0,   {0.0},        0.0,    0.0,   0};
  for (int i = 0; i < 3; i++) p->F[i] = 0.0;
  for (int i = 0; i < 9; i++) p->C[i] = 0.0;
  for (int i = 0; i < last; i++) s.q[i] = p->row[i];

  /* an intact joint leaves its strength at most once; under tension it fails */
  const int exceeds_tension = after < -tension * (1.0 + JLAW_ROUNDING_TOLERANCE);
  double tensile_loss = 0.0, at, fraction = 1.0, end = after;
  int exceeds_shear = 0, tears = 0;
  if (intact) {
    if (exceeds_tension) { /* the fraction of the step up to the tensile strength */
      const double met = (before + tension) / size;
      fraction = met < 0.0 ? 0.0 : met < 1.0 ? met : 1.0, end = -tension;
    }
    for (int i = 0; i < last; i++) s.dq[i] = ks * p->d[i + 1] * fraction;
    const double strength = jl_coulomb_strength(law, 0.0, before);
    const double growth = jl_coulomb_strength(law, 0.0, end) - strength;
    exceeds_shear = jl_exceeds_strength(s.q, s.dq, strength, growth, &at);
    const double sigma = before + at * (end - before);
    tears = exceeds_shear ? sigma < 0.0 : exceeds_tension;
    if (tears) tensile_loss = 0.5 * sigma * sigma / kn + 0.5 * jl_squared_norm(s.q, at, s.dq) / ks;
  }

  /* the part of the step in which the faces touch */
  const int stays_intact = intact && !exceeds_shear && !exceeds_tension;
  const int touches = stays_intact || after >= 0.0;
  const int separated = tears || (!intact && p->from[0] < 0.0), separates = !touches && !separated;
  double touching = separates ? before / size : 1.0; /* fraction of the step */
  if (separated) {
    touching = (after > 0.0 ? after : 0.0) / size;
    s.start = 0.0, s.w = JLAW_SEPARATED_STATE, s.q[0] = s.q[1] = 0.0;
  }
  s.end = touches ? after : 0.0;
  for (int i = 0; i < last; i++) s.dq[i] = ks * p->d[i + 1] * touching;
  jl_map_to_coulomb_limit(law, &s);
  const double shear_energy = 0.5 * (s.q1[0] * s.q1[0] + s.q1[1] * s.q1[1]) / ks;
  p->loss = tensile_loss + s.loss + (separates ? shear_energy : 0.0);
  for (int i = 0; i < last; i++) p->F[i + 1] = p->row[i] = touches ? s.q1[i] + 0.0 : 0.0;
  p->F[0] = s.end;
  p->row[last] = touches ? s.w1 : JLAW_SEPARATED_STATE;
  if (tangent && touches) jl_coulomb_tangent(law, &s, ks * touching, p->C);
  return touches ? 0.5 * kn * u * u + shear_energy : 0.0;
}

JL_INLINE double jl_coulomb_stiffness(const jlaw_law *law, const double *row, double closure)
{
  const double w = row[law->dim - 1];
  if (w > 0.0 && closure < 0.0) return 0.0; /* separated */
  const double mu = jl_coulomb_friction(law, law->coulomb_weakening_length > 0.0 ? w : 1.0);
  const double sliding =
      law->coulomb_normal_stiffness * (mu < JLAW_INFINITE_FRICTION ? sqrt(1.0 + mu * mu) : 1.0);
  return sliding > law->coulomb_shear_stiffness ? sliding : law->coulomb_shear_stiffness;
}

/* Fractions sliding, slipping and separated (Measures of kernels/element.py) in the state s: 0 or 1 */
JL_INLINE void jl_coulomb_fractions(const jlaw_law *law, const double *s, size_t stride,
                                    double fractions[3])
{
  const int dim = law->dim;
  const double u = s[0], *row = s + (size_t) (dim + 1) * stride;
  const double w = row[(size_t) (dim - 1) * stride], q[2] = {row[0], dim > 2 ? row[stride] : 0.0};
  const double zero[2] = {0.0, 0.0},
               strength = jl_coulomb_strength(law, w, law->coulomb_normal_stiffness * u);
  const int separated = w > 0.0 && u < 0.0;
  fractions[0] = fractions[1] =
      !separated
      && sqrt(jl_squared_norm(q, 0.0, zero)) >= strength * (1.0 - JLAW_FRICTION_TOLERANCE);
  fractions[2] = separated;
}
