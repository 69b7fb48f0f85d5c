/* library.c: selects the version of batch.c for the vectors of this processor. JLAW_LEVELS is the
 * sum of the vector widths that this library was built for: 8 for 8 alone, 14 for 8, 4 and 2.
 */
#include "batch.h"
#include "lanes.h"
#include "elements.h"
#include "law.h"
#include "export.h"
#include "contacts.h"
#include <stdlib.h>

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

/* Geometry (forces = 0) or forces (1) of contacts, for vectors of `lanes` doubles; see contacts.c */
OUT void jlaw_contact_step(const jlaw_contacts *c, int lanes, int forces)
{
#define CONTACTS(W)                                                                  \
  if (lanes == W) {                                                                  \
    extern void jlaw_contact_motion_##W(const jlaw_contacts *),                      \
        jlaw_contact_forces_##W(const jlaw_contacts *);                              \
    (forces ? jlaw_contact_forces_##W : jlaw_contact_motion_##W)(c);                 \
  }
#if JLAW_LEVELS & 8
  CONTACTS(8)
#endif
#if JLAW_LEVELS & 4
  CONTACTS(4)
#endif
#if JLAW_LEVELS & 2
  CONTACTS(2)
#endif
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

/* Check a list of joints (n,) of a batch of `count`. Returns JLAW_INCREASING or JLAW_ANY_ORDER for a
 * valid list, JLAW_OUTSIDE if a joint is not in the batch, JLAW_REPEATED if one is named twice, and
 * JLAW_NO_MEMORY. */
OUT int jlaw_check_list(const long long *joints, long long n, long long count)
{
  long long sorted = 0; /* joints that increase, from the first one on */
  while (sorted < n && joints[sorted] >= 0 && joints[sorted] < count
         && (sorted == 0 || joints[sorted] > joints[sorted - 1]))
    sorted++;
  if (sorted == n) return JLAW_INCREASING;
  for (long long k = sorted; k < n; k++)
    if (joints[k] < 0 || joints[k] >= count) return JLAW_OUTSIDE;
  unsigned char *named = (unsigned char *) calloc((size_t) (count / 8 + 1), 1); /* a bit a joint */
  if (!named) return JLAW_NO_MEMORY;
  int verdict = JLAW_ANY_ORDER;
  for (long long k = 0; k < n; k++) {
    const int bit = 1 << (joints[k] & 7);
    if (named[joints[k] >> 3] & bit) verdict = JLAW_REPEATED;
    named[joints[k] >> 3] = (unsigned char) (named[joints[k] >> 3] | bit);
  }
  free(named);
  return verdict;
}

/* Sort joints (n,) of a list by their blocks into entries (n,). blocks: number of blocks of the batch,
 * whose joints an unsigned numbers. Returns 0, or JLAW_NO_MEMORY. */
OUT int jlaw_sort_by_block(const long long *joints, long long n, long long blocks,
                           jlaw_entry *entries)
{
  enum { ENTRIES_AHEAD = 16 };
  unsigned *place = (unsigned *) calloc((size_t) blocks + 1, sizeof *place); /* of each block */
  if (!place) return JLAW_NO_MEMORY;
  for (long long k = 0; k < n; k++) place[joints[k] / JLAW_JOINTS_PER_BLOCK + 1]++;
  for (long long i = 0; i < blocks; i++) place[i + 1] += place[i];
  for (long long k = 0; k < n; k++) {
    if (k + ENTRIES_AHEAD < n)
      __builtin_prefetch(entries + place[joints[k + ENTRIES_AHEAD] / JLAW_JOINTS_PER_BLOCK], 1);
    jlaw_entry *entry = entries + place[joints[k] / JLAW_JOINTS_PER_BLOCK]++;
    entry->joint = (unsigned) joints[k];
    entry->row = (unsigned) k;
  }
  free(place);
  return 0;
}

/* Hash of the sources that this library was built from */
OUT const char *jlaw_sources(void) { return JLAW_SOURCES; }
