/* library.c: selects the version of batch.c for the vectors of this processor. JLAW_LEVELS is the
 * sum of the vector widths that this library was built for: 8 for 8 alone, 14 for 8, 4 and 2.
 */
#include "batch.h"
#include "lanes.h"
#include "elements.h"
#include "law.h"
#include "export.h"

OUT int jlaw_levels(void) { return JLAW_LEVELS; }

/* The function for `operation` (0 to 4: advance, measure, refresh, stiffness, traction) on a batch */
static jlaw_call *find_call(const jlaw_batch *b, int operation)
{
#define LEVEL(W)                                                                    \
  if (b->lanes == W) {                                                              \
    extern jlaw_call *const jlaw_calls_##W[], *const jlaw_calls_##W##_contiguous[], \
        *const jlaw_calls_##W##_float[];                                            \
    if (b->contiguous) return jlaw_calls_##W##_contiguous[operation];               \
    return (b->float_sliders ? jlaw_calls_##W##_float : jlaw_calls_##W)[operation]; \
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

/* Run an operation on a batch. Several threads may call this for the same batch: each takes the
 * next b->chunk joints (a multiple of JLAW_JOINTS_PER_BLOCK) until all are done. Returns 0, or -1
 * if no memory is left. */
OUT int jlaw_run(jlaw_batch *b, int operation)
{
  jlaw_call *const call = find_call(b, operation);
  const long long n = b->n, chunk = b->chunk;
  int failed = 0;
  for (long long at; !failed && (at = __atomic_fetch_add(&b->next, chunk, __ATOMIC_RELAXED)) < n;)
    failed = call(b, (long) at, (long) (n - at < chunk ? n : at + chunk));
  return failed;
}

/* Rows of a state, which Python compares with its own number */
OUT int jlaw_state_rows(const jlaw_law *law) { return jl_state_rows(law); }

/* Sort joints (n,) by their blocks. Each block starts at the number of joints in the blocks before
 * it, which counts (blocks + 1,), zeros before the call, accumulates. Writes the sorted joints into
 * index (n,) and their places in the list into order (n,). */
OUT void jlaw_sort_by_block(const long long *joints, long long n, long long *counts,
                            long long blocks, long long *index, long long *order)
{
  for (long long k = 0; k < n; k++) counts[joints[k] / JLAW_JOINTS_PER_BLOCK + 1]++;
  for (long long i = 0; i < blocks; i++) counts[i + 1] += counts[i];
  for (long long k = 0; k < n; k++) {
    const long long place = counts[joints[k] / JLAW_JOINTS_PER_BLOCK]++;
    index[place] = joints[k];
    order[place] = k;
  }
}

/* Hash of the sources that this library was built from */
OUT const char *jlaw_sources(void) { return JLAW_SOURCES; }
