/* A direct shear test on one joint, printed as CSV: closed to a normal stress, then sheared along
 * axis 2 at constant normal stress (CNL), with a reversal.
 *
 *     ./example [granite.jlaw [normal stress in Pa [shear in m]]]
 */
#include "jointlaw.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char message[JLAW_MESSAGE];

static int fail(const char *reason)
{
  fprintf(stderr, "example: %s\n", reason);
  return 1;
}

/* One step with this shear increment at constant normal stress. The closure increment is found by
 * Newton's method: trial steps from the old state, corrected by the tangent. */
static int step_at_stress(const jlaw_law *law, double *state, double *next, double stress,
                          double shear, double *F)
{
  double d[3] = {0.0, shear, 0.0}, C[9];
  for (int trial = 0; trial < 50; trial++) {
    if (jlaw_update(law, state, next, d, F, C, message, sizeof message)) return fail(message);
    if (fabs(F[0] - stress) <= 1e-9 * stress) {
      memcpy(state, next, (size_t) jlaw_state_size(law) * sizeof *state);
      return 0;
    }
    d[0] += (stress - F[0]) / (C[0] > 0.0 ? C[0] : jlaw_max_stiffness(law, state[0] + d[0]));
  }
  return fail("the normal stress was not reached in 50 iterations; use smaller steps");
}

int main(int argc, char **argv)
{
  jlaw_law *law = jlaw_read(argc > 1 ? argv[1] : "granite.jlaw", message, sizeof message);
  if (!law) return fail(message);
  const double stress = argc > 2 ? atof(argv[2]) : 2e6, end = argc > 3 ? atof(argv[3]) : 2e-6;
  const int dim = jlaw_dim(law), steps = 20;
  double *state = (double *) calloc((size_t) jlaw_state_size(law), sizeof *state);
  double *next = (double *) calloc((size_t) jlaw_state_size(law), sizeof *next);
  double F[3], fractions[3];
  strcpy(message, state && next ? "the law does not reach this normal stress: use a smaller one" : "no memory is left");
  int failed = !state || !next || jlaw_preload(law, state, stress, F);
  if (failed) fail(message);
  if (!failed) printf("shear_um,closure_um,normal_MPa,shear_MPa,sliding,dissipated_J_m2\n");
  for (int i = 1; !failed && i <= (dim > 1 ? 2 * steps : 1); i++) {
    const double shear = i <= steps ? end / steps : -end / steps;
    if (dim > 1) failed = step_at_stress(law, state, next, stress, shear, F);
    jlaw_contact_fractions(law, state, fractions);
    if (!failed)
      printf("%.3f,%.4f,%.4f,%.4f,%.4f,%.4f\n", dim > 1 ? 1e6 * state[1] : 0.0, 1e6 * state[0],
             1e-6 * F[0], dim > 1 ? 1e-6 * F[1] : 0.0, fractions[0], jlaw_dissipated_energy(law, state));
  }
  free(next);
  free(state);
  jlaw_free(law);
  return failed;
}
