/* elements.h: the elements beside the asperities of a joint, one joint at a time; symbols and order
 * of kernels/bond.py and kernels/coulomb.py. Its rows in a state are a vector in the plane of the
 * joint (Pa), or none, and last its damage, 0 to 1, or JLAW_SEPARATED_STATE. An element NAME of layout.h has
 * here
 *
 *   jl_NAME_rows       number of its rows
 *   jl_NAME_step       a step, which returns the stored energy after it
 *   jl_NAME_stiffness  bound of |C| at this damage and closure; at 0 that of all states
 */

typedef struct {           /* an element of one joint in a step */
  double from[3], d[3];    /* displacement before the step, and its increment */
  double row[4];           /* its rows of the state, before and after the step */
  double F[3], C[9], lost; /* what it adds: traction, tangent (3, 3), loss */
} jl_element_step;

/* ------------------------------------------------------------------------- the bond */

/* 1 where opening and slip, squared, are the strength at this damage; p2: 1/half-axis, squared */
JL_INLINE double jl_bond_criterion(const jlaw_law *law, double opening2, double slip2,
                                   double damage, double p2[2])
{
  const double p = law->inverse_onset_opening
                   - damage * (law->inverse_onset_opening - law->inverse_failure_opening);
  const double q =
      law->inverse_onset_slip - damage * (law->inverse_onset_slip - law->inverse_failure_slip);
  p2[0] = p * p, p2[1] = q * q;
  return opening2 * p2[0] + slip2 * p2[1];
}

/* Damage that opening and slip ask for: the smaller root of the quadratic; half the slope there */
JL_INLINE double jl_bond_damage(const jlaw_law *law, double opening2, double slip2, double *slope)
{
  const double begin0 = law->inverse_onset_opening, soft0 = begin0 - law->inverse_failure_opening;
  const double begin1 = law->inverse_onset_slip, soft1 = begin1 - law->inverse_failure_slip;
  const double turn = begin1 * law->inverse_failure_opening - begin0 * law->inverse_failure_slip;
  const double inside =
      opening2 * (soft0 * soft0) + slip2 * (soft1 * soft1) - opening2 * slip2 * (turn * turn);
  double p2[2];
  const double over = jl_bond_criterion(law, opening2, slip2, 0.0, p2) - 1.0;
  *slope = sqrt(inside > 0.0 ? inside : 0.0);
  if (!(over > 0.0)) return 0.0;
  if (!(jl_bond_criterion(law, opening2, slip2, 1.0, p2) < 1.0)) return 1.0;
  const double found = over / (opening2 * (begin0 * soft0) + slip2 * (begin1 * soft1) + *slope);
  return found < 1.0 ? found : 1.0;
}

JL_INLINE int jl_bonded_rows(const jlaw_law *law) { return law->bonded; }

JL_INLINE double jl_bonded_stiffness(const jlaw_law *law, double damage, double closure)
{
  (void) closure;
  const double K[2] = {law->bond_normal_stiffness, law->bond_shear_stiffness};
  return (1.0 - damage) * (K[0] > K[1] ? K[0] : K[1]);
}

JL_INLINE double jl_bonded_step(const jlaw_law *law, jl_element_step *b, int tangent)
{
  const double K[2] = {law->bond_normal_stiffness, law->bond_shear_stiffness}, old = b->row[0];
  const double opened = b->from[0] + b->d[0];
  const double u[3] = {opened < 0.0 ? opened : 0.0, b->from[1] + b->d[1], b->from[2] + b->d[2]};
  const double opening2 = u[0] * u[0], slip2 = u[1] * u[1] + u[2] * u[2];
  const double psi = 0.5 * (K[0] * opening2 + K[1] * slip2);
  double p2[2], slope;
  const double found = jl_bond_damage(law, opening2, slip2, &slope);
  const double now = b->row[0] = found > old ? found : old;
  const int softens = found > old && now < 1.0;
  const double first = jl_bond_criterion(law, opening2, slip2, old, p2);
  const double there = jl_bond_criterion(law, opening2, slip2, now, p2),
               last = softens ? 1.0 : there;
  b->lost = found > old ? (now - old) * psi / sqrt(first * last) : 0.0;
  for (int i = 0; i < 3; i++) {
    b->F[i] = (1.0 - now) * K[i > 0] * u[i];
    for (int j = 0; tangent && j < 3; j++)
      b->C[3 * i + j] = softens ? -(K[i > 0] * u[i]) * (u[j] * p2[j > 0] / slope) : 0.0;
    if (tangent && (i || u[0] < 0.0)) b->C[4 * i] += (1.0 - now) * K[i > 0];
  }
  return (1.0 - now) * psi;
}

#include "coulomb.h"

/* --------------------------------------------------------------------- all of a joint */

/* Rows of all elements; 0 where there are none beside the asperities, or in place of them */
JL_INLINE int jl_element_rows(const jlaw_law *law)
{
#define JL_ROWS(name) +(law->name ? jl_##name##_rows(law) : 0)
  return 0 JLAW_ELEMENTS(JL_ROWS);
#undef JL_ROWS
}

/* Elements of a step from `from` by d, whose rows of the state begin at `row`. Adds what they bear
 * to F and C, where F is given; without it a state is only looked at. Returns their stored energy. */
JL_INLINE jl_joint_real jl_step_elements(const jlaw_law *law, jl_states n, int row,
                                         const jl_joint_real from[3], const jl_joint_real d[3],
                                         jl_joint_real F[3], jl_joint_real C[9], int tangent,
                                         int ledger)
{
  const int dim = law->dim;
  jl_joint_real stored = jl_broadcast_joint(0.0);
  for (int l = 0; l < JL_JOINTS_PER_PASS; l++) {
    double *own = JL_STATE_OF_LANE(n, l) + (size_t) row * n.stride,
           *lost = JL_STATE_OF_LANE(n, l) + (size_t) dim * n.stride;
#define JL_STEP_ELEMENT(name)                                                  \
  if (law->name) {                                                             \
    const int rows = jl_##name##_rows(law);                                    \
    jl_element_step p; /* what a step does not write is not read */            \
    for (int i = 0; i < 3; i++) {                                              \
      p.from[i] = i < dim ? JL_JOINT(from[i], l) : 0.0;                        \
      p.d[i] = i < dim ? JL_JOINT(d[i], l) : 0.0;                              \
    }                                                                          \
    for (int i = 0; i < rows; i++) p.row[i] = own[(size_t) i * n.stride];      \
    JL_JOINT(stored, l) += jl_##name##_step(law, &p, tangent);                 \
    for (int i = 0; F && i < rows; i++) own[(size_t) i * n.stride] = p.row[i]; \
    for (int i = 0; F && i < dim; i++) JL_JOINT(F[i], l) += p.F[i];            \
    for (int i = 0; F && tangent && i < dim * dim; i++)                        \
      JL_JOINT(C[i], l) += p.C[i / dim * 3 + i % dim];                         \
    if (F && ledger) *lost += p.lost;                                          \
    own += (size_t) rows * n.stride;                                           \
  }
    JLAW_ELEMENTS(JL_STEP_ELEMENT)
#undef JL_STEP_ELEMENT
  }
  return stored;
}

/* Bound of the |C| (Pa/m) that elements add in a state of these numbers; in all states if NULL */
JL_INLINE double jl_elements_stiffness_bound(const jlaw_law *law, const double *s, int row,
                                             size_t stride)
{
  double bound = 0.0;
#define JL_STIFFNESS(name)                                          \
  if (law->name) {                                                  \
    row += jl_##name##_rows(law);                                   \
    const double damage = s ? s[(size_t) (row - 1) * stride] : 0.0; \
    bound += jl_##name##_stiffness(law, damage, s ? s[0] : 0.0);    \
  }
  JLAW_ELEMENTS(JL_STIFFNESS)
#undef JL_STIFFNESS
  return bound;
}
