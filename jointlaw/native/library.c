/* library.c: calls the compiled texts of batch.c, one for each width of vectors. JLAW_LEVELS is the
 * sum of the lanes that this library was built for: 8 of 8 alone, 14 of 8, 4 and 2.
 */
#include "batch.h"
#include "export.h"

OUT int jlaw_levels(void) { return JLAW_LEVELS; }

/* Advance, measure, refresh or stiffness (`what` = 0 to 3), by vectors of so many lanes */
static jlaw_call *find(int lanes, int alone, int what)
{
#define LEVEL(W)                                                                 \
  if (lanes == W) {                                                              \
    extern jlaw_call *const jlaw_calls_##W[4], *const jlaw_calls_##W##_alone[4]; \
    return (alone ? jlaw_calls_##W##_alone : jlaw_calls_##W)[what];              \
  }
#if JLAW_LEVELS & 8
  LEVEL(8)
#endif
#if JLAW_LEVELS & 4
  LEVEL(4)
#endif
#if JLAW_LEVELS & 2
  LEVEL(2)
#endif
  return NULL;
}

/* Call it for the joints of a batch that no other thread takes: every thread that calls takes the
 * next b->grain of them, whole blocks, until none are left */
OUT int jlaw_run(jlaw_batch *b, int what)
{
  jlaw_call *const call = find(b->lanes, b->alone, what);
  const long long n = b->n, grain = b->grain;
  int failed = 0;
  for (long long at; !failed && (at = __atomic_fetch_add(&b->taken, grain, __ATOMIC_RELAXED)) < n;)
    failed = call(b, (long) at, (long) (n - at < grain ? n : at + grain));
  return failed;
}

/* Hash of the sources that this library was built from */
OUT const char *jlaw_sources(void) { return JLAW_SOURCES; }
