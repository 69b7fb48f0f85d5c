/* granite for finite elements, for mgis.c and umat.c: the state that a host keeps, and one step.
 *
 * Axes and signs are the host's: 1 is the normal, opening and tension are positive; 2 and 3 span
 * the joint. SI. A state is STATE numbers. Zeros are the joint of START, unsheared under the seating
 * stress. The last number tells whether the joint has begun to move; the others are the numbers of
 * jointlaw.h and of a snapshot in Python. */
#include "granite.h"
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define JOINT granite
#define DIM @DIM@ /* 3; 2 for a law of one plane */
enum { STATE = @STATE@, BEGUN = STATE - 1 };
#define NAMES \
@NAMES@

/* Closed to @SEATING@ Pa */
static const double START[STATE] = {
@START@};

/* One step by du (opening, shear, shear; m) from state s0: the new state s1 (not s0), the traction T
 * (DIM, Pa) and its tangent C (DIM, DIM), row by row, if not NULL. -1 and a message where a number
 * is not finite or forces would overflow: nothing is written then. */
static int jlf_move(const double *s0, double *s1, const double du[3], double *T, double *C,
                   char message[JLAW_MESSAGE])
{
  const double d[3] = {-du[0], du[1], du[2]};
  if (jlaw_state_size(&JOINT) != BEGUN) {
    snprintf(message, JLAW_MESSAGE, "jointlaw_fem.h is not of these tables: export all anew");
    return -1;
  }
  if (jlaw_update(&JOINT, s0[BEGUN] != 0.0 ? s0 : START, s1, d, T, C, message, JLAW_MESSAGE))
    return -1;
  s1[BEGUN] = 1.0;
  T[0] = -T[0];
  for (int i = 1; C && i < DIM; i++) {
    C[i] = -C[i];
    C[DIM * i] = -C[DIM * i];
  }
  return 0;
}
