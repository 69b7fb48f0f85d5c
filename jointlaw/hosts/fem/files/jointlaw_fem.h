/* granite for finite elements, for mgis.c and umat.c: the state that a host keeps, and one step.
 *
 * Axes and signs follow the host: axis 1 is the normal, opening and tension are positive; axes
 * 2 and 3 span the joint. SI units. A state has STATE numbers. The last one is 0 before the first
 * step and 1 after it; the others are the numbers of jointlaw.h and of a snapshot in Python. Hosts
 * start with zeros: they represent START, the joint under the seating stress, without shear. */
#ifdef JOINTLAW_FLOAT_SLIDERS /* hosts show, interpolate and print each number of a state */
#error "finite elements keep states of doubles: compile without JOINTLAW_FLOAT_SLIDERS"
#endif
#include "granite.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define JOINT granite
#define DIM @DIM@ /* 3, or 2 for a law with a plane */
enum { STATE = @STATE@, INITIALISED = STATE - 1 };
#define NAMES \
@NAMES@

/* Closed under @SEATING@ Pa */
static const double START[STATE] = {
@START@};

/* Advance a joint by du (opening, shear, shear; m) from state s0 to s1, another array. Writes the
 * traction T (DIM, Pa), and its tangent C (DIM, DIM) in row-major order unless it is NULL. If a number
 * is not finite or forces would overflow, it returns -1 and writes a message and nothing else. */
static int jlf_advance(const double *s0, double *s1, const double du[3], double *T, double *C,
                       char message[JLAW_MESSAGE])
{
  const double d[3] = {-du[0], du[1], du[2]};
  if (jlaw_state_size(&JOINT) != INITIALISED) {
    snprintf(message, JLAW_MESSAGE, "jointlaw_fem.h does not fit the tables: export the law again");
    return -1;
  }
  if (jlaw_update(&JOINT, s0[INITIALISED] != 0.0 ? s0 : START, s1, d, T, C, message, JLAW_MESSAGE))
    return -1;
  s1[INITIALISED] = 1.0;
  T[0] = -T[0];
  for (int i = 1; C && i < DIM; i++) {
    C[i] = -C[i];
    C[DIM * i] = -C[DIM * i];
  }
  return 0;
}
