/* elements.h: the elements of a joint other than its asperities: bond and Coulomb's law.
 *
 * They advance one joint at a time; symbols and order are those of kernels/bond.py and
 * kernels/coulomb.py. layout.py declares the elements and the rows of their states; an element may
 * have none. For each element NAME this file defines
 *
 *   jl_NAME_step       a step, which returns the stored energy at its end
 *   jl_NAME_stiffness  upper bound of |C| at its rows and a closure; with zeros: of all states
 */

typedef struct { /* rows of one name in the state of a joint */
  const char *name;
  int first, count, is_vector, is_damage;
  double lower, upper; /* bounds */
} jl_rows;

/* Number of rows of each element: jl_NAME_rows */
#define JL_COUNT_ROWS(name, is_vector, is_damage, lower, upper) \
  +((is_vector) ? law->dim - 1 : 1)
#define JL_DEFINE_ROWS(name)                              \
  JL_INLINE int jl_##name##_rows(const jlaw_law *law)     \
  {                                                       \
    return law->name ? 0 JLAW_ROWS_OF_##name(JL_COUNT_ROWS) : 0; \
  }
JLAW_ELEMENTS(JL_DEFINE_ROWS)
#undef JL_DEFINE_ROWS
#undef JL_COUNT_ROWS

/* List the rows of all elements of a law, which begin at `row` of a state; returns their number */
JL_INLINE int jl_list_rows(const jlaw_law *law, int row, jl_rows list[JLAW_ELEMENT_ROW_NAMES])
{
  int n = 0;
#define JL_LIST_ROWS(row_name, vector, damage, low, high)              \
  list[n].name = row_name;                                             \
  list[n].first = row, list[n].count = (vector) ? law->dim - 1 : 1;    \
  list[n].is_vector = (vector), list[n].is_damage = (damage);          \
  list[n].lower = (low), list[n].upper = (high), row += list[n++].count;
#define JL_LIST_ELEMENT(name) \
  if (law->name) { JLAW_ROWS_OF_##name(JL_LIST_ROWS) }
  JLAW_ELEMENTS(JL_LIST_ELEMENT)
#undef JL_LIST_ELEMENT
#undef JL_LIST_ROWS
  return n;
}

/* Damage of a state, whose rows of elements begin at `row`: of the least damaged element; 0 to 1, and 1
 * for a law without damage */
JL_INLINE double jl_damage(const jlaw_law *law, const double *s, int row, size_t stride)
{
  double damage = 1.0; /* a row may be larger after separation */
  jl_rows list[JLAW_ELEMENT_ROW_NAMES];
  const int n = jl_list_rows(law, row, list);
  for (int i = 0; i < n; i++)
    if (list[i].is_damage && s[(size_t) list[i].first * stride] < damage)
      damage = s[(size_t) list[i].first * stride];
  return damage;
}

typedef struct {           /* an element of one joint in a step */
  double from[3], d[3];    /* displacement before the step, and its increment */
  double row[JLAW_MAX_ELEMENT_ROWS]; /* its rows of the state, before and after the step */
  double F[3], C[9], loss; /* traction, tangent (3, 3), dissipated energy */
} jl_element_step;

/* ------------------------------------------------------------------------- the bond */

/* Left side of the strength criterion, which equals 1 at the strength of this damage. opening2,
 * slip2: squares; p2: squares of the reciprocal half-axes of the criterion */
JL_INLINE double jl_bond_criterion(const jlaw_law *law, double opening2, double slip2,
                                   double damage, double p2[2])
{
  const double onset[2] = {law->inverse_onset_opening, law->inverse_onset_slip};
  const double failure[2] = {law->inverse_failure_opening, law->inverse_failure_slip};
  const double p = onset[0] - damage * (onset[0] - failure[0]);
  const double q = onset[1] - damage * (onset[1] - failure[1]);
  p2[0] = p * p, p2[1] = q * q;
  return opening2 * p2[0] + slip2 * p2[1];
}

/* Damage at which the criterion equals 1, the smaller root of a quadratic equation. slope: half the
 * derivative of the criterion with respect to -damage at the root */
JL_INLINE double jl_bond_damage(const jlaw_law *law, double opening2, double slip2, double *slope)
{
  const double onset[2] = {law->inverse_onset_opening, law->inverse_onset_slip};
  const double failure[2] = {law->inverse_failure_opening, law->inverse_failure_slip};
  const double soft0 = onset[0] - failure[0], soft1 = onset[1] - failure[1];
  const double determinant = onset[1] * failure[0] - onset[0] * failure[1];
  const double discriminant = opening2 * (soft0 * soft0) + slip2 * (soft1 * soft1)
                              - opening2 * slip2 * (determinant * determinant);
  double p2[2];
  const double excess = jl_bond_criterion(law, opening2, slip2, 0.0, p2) - 1.0;
  *slope = sqrt(discriminant > 0.0 ? discriminant : 0.0);
  if (!(excess > 0.0)) return 0.0;
  if (!(jl_bond_criterion(law, opening2, slip2, 1.0, p2) < 1.0)) return 1.0;
  const double root =
      excess / (opening2 * (onset[0] * soft0) + slip2 * (onset[1] * soft1) + *slope);
  return root < 1.0 ? root : 1.0;
}

JL_INLINE double jl_bonded_stiffness(const jlaw_law *law, const double *row, double closure)
{
  (void) closure;
  const double K[2] = {law->bond_normal_stiffness, law->bond_shear_stiffness};
  return (1.0 - row[0]) * (K[0] > K[1] ? K[0] : K[1]);
}

JL_INLINE double jl_bonded_step(const jlaw_law *law, jl_element_step *b, int tangent)
{
  const double K[2] = {law->bond_normal_stiffness, law->bond_shear_stiffness};
  const double damage0 = b->row[0], closure = b->from[0] + b->d[0];
  const double u[3] = {closure < 0.0 ? closure : 0.0, b->from[1] + b->d[1], b->from[2] + b->d[2]};
  const double opening2 = u[0] * u[0], slip2 = u[1] * u[1] + u[2] * u[2];
  const double psi = 0.5 * (K[0] * opening2 + K[1] * slip2);
  double p2[2], slope;
  const double root = jl_bond_damage(law, opening2, slip2, &slope);
  const int grows = root > damage0;
  const double damage1 = grows ? root : damage0;
  const int softens = grows && damage1 < 1.0;
  /* dissipation: the damage times the geometric mean of psi at the start and end of its growth */
  const double start = jl_bond_criterion(law, opening2, slip2, damage0, p2);
  const double criterion = jl_bond_criterion(law, opening2, slip2, damage1, p2);
  const double end = softens ? 1.0 : criterion;
  b->row[0] = damage1;
  b->loss = grows ? (damage1 - damage0) * psi / sqrt(start * end) : 0.0;
  for (int i = 0; i < 3; i++) {
    b->F[i] = (1.0 - damage1) * K[i > 0] * u[i];
    for (int j = 0; tangent && j < 3; j++)
      b->C[3 * i + j] = softens ? -(K[i > 0] * u[i]) * (u[j] * p2[j > 0] / slope) : 0.0;
    if (tangent && (i || u[0] < 0.0)) b->C[4 * i] += (1.0 - damage1) * K[i > 0];
  }
  return (1.0 - damage1) * psi;
}

#include "coulomb.h"

/* --------------------------------------------------------- all elements of a joint */

/* Whether a law has elements of this file, with or without rows; 0 for asperities alone */
JL_INLINE int jl_has_elements(const jlaw_law *law)
{
#define JL_HAS_ELEMENT(name) || law->name
  return 0 JLAW_ELEMENTS(JL_HAS_ELEMENT);
#undef JL_HAS_ELEMENT
}

/* Rows of all elements of this file in a state */
JL_INLINE int jl_element_rows(const jlaw_law *law)
{
#define JL_ADD_ROWS(name) +jl_##name##_rows(law)
  return 0 JLAW_ELEMENTS(JL_ADD_ROWS);
#undef JL_ADD_ROWS
}

/* Advance the elements, whose rows of the state begin at `row`, from the displacement `from` by d.
 * Adds their traction and tangent to F and C and their dissipated energy to the state; if F is NULL,
 * nothing is written. Returns their stored energy. */
JL_INLINE jl_joint_real jl_step_elements(const jlaw_law *law, jl_states n, int row,
                                         const jl_joint_real from[3], const jl_joint_real d[3],
                                         jl_joint_real F[3], jl_joint_real C[9], int tangent,
                                         int track_dissipation)
{
  const int dim = law->dim;
  jl_joint_real stored = jl_broadcast_joint(0.0);
  for (int l = 0; l < JL_JOINTS_PER_PASS; l++) {
    double *rows = JL_STATE_OF_LANE(n, l) + (size_t) row * n.stride,
           *dissipated = JL_STATE_OF_LANE(n, l) + (size_t) dim * n.stride;
#define JL_STEP_ELEMENT(name)                                                    \
  if (law->name) {                                                               \
    const int count = jl_##name##_rows(law);                                     \
    jl_element_step p; /* entries that a step does not write are not read */     \
    for (int i = 0; i < 3; i++) {                                                \
      p.from[i] = i < dim ? JL_JOINT(from[i], l) : 0.0;                          \
      p.d[i] = i < dim ? JL_JOINT(d[i], l) : 0.0;                                \
    }                                                                            \
    for (int i = 0; i < count; i++) p.row[i] = rows[(size_t) i * n.stride];      \
    JL_JOINT(stored, l) += jl_##name##_step(law, &p, tangent);                   \
    for (int i = 0; F && i < count; i++) rows[(size_t) i * n.stride] = p.row[i]; \
    for (int i = 0; F && i < dim; i++) JL_JOINT(F[i], l) += p.F[i];              \
    for (int i = 0; F && tangent && i < dim * dim; i++)                          \
      JL_JOINT(C[i], l) += p.C[i / dim * 3 + i % dim];                           \
    if (F && track_dissipation) *dissipated += p.loss;                           \
    rows += (size_t) count * n.stride;                                           \
  }
    JLAW_ELEMENTS(JL_STEP_ELEMENT)
#undef JL_STEP_ELEMENT
  }
  return stored;
}

/* Add the traction of the elements in their present states, at the displacement delta, to F */
JL_INLINE void jl_add_element_traction(const jlaw_law *law, jl_states n, int row,
                                       const jl_joint_real delta[3], jl_joint_real F[3])
{
  const int dim = law->dim;
  for (int l = 0; l < JL_JOINTS_PER_PASS; l++) {
    const double *rows = JL_STATE_OF_LANE(n, l) + (size_t) row * n.stride;
#define JL_ADD_TRACTION(name)                                                                 \
  if (law->name) {                                                                            \
    const int count = jl_##name##_rows(law);                                                  \
    jl_element_step p; /* entries that a step does not write are not read */                  \
    for (int i = 0; i < 3; i++) p.from[i] = i < dim ? JL_JOINT(delta[i], l) : 0.0, p.d[i] = 0.0; \
    for (int i = 0; i < count; i++) p.row[i] = rows[(size_t) i * n.stride];                   \
    jl_##name##_step(law, &p, 0);                                                             \
    for (int i = 0; i < dim; i++) JL_JOINT(F[i], l) += p.F[i];                                \
    rows += (size_t) count * n.stride;                                                        \
  }
    JLAW_ELEMENTS(JL_ADD_TRACTION)
#undef JL_ADD_TRACTION
  }
}

/* Upper bound of |C| (Pa/m) of the elements in the state s, or in all states if s is NULL */
JL_INLINE double jl_elements_stiffness_bound(const jlaw_law *law, const double *s, int row,
                                             size_t stride)
{
  double bound = 0.0;
#define JL_STIFFNESS(name)                                                     \
  if (law->name) {                                                             \
    double rows[JLAW_MAX_ELEMENT_ROWS] = {0.0};                                \
    const int count = jl_##name##_rows(law);                                   \
    for (int i = 0; s && i < count; i++) rows[i] = s[(size_t) (row + i) * stride]; \
    bound += jl_##name##_stiffness(law, rows, s ? s[0] : 0.0);                 \
    row += count;                                                              \
  }
  JLAW_ELEMENTS(JL_STIFFNESS)
#undef JL_STIFFNESS
  return bound;
}
