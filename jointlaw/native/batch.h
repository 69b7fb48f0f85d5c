/* batch.h: the arguments of a call of the library for many joints; library.py declares the same
 * structure for ctypes. */
#ifndef JLAW_BATCH_H
#define JLAW_BATCH_H
#include <float.h>
#include <math.h>
#include <stddef.h>
typedef struct jlaw_law jlaw_law;
#include "layout.h"

enum { JLAW_JOINTS_PER_BLOCK = 8 /* side by side in a block of states */ };

enum { JLAW_OPERATIONS = 5 /* of jlaw_run: advance, measure, refresh, stiffness, traction */ };

enum { /* measures of a joint after a step: fractions, J/m2, damage; its displacement follows them */
       JLAW_SLIDING,
       JLAW_SLIPPING,
       JLAW_SEPARATED,
       JLAW_STORED,
       JLAW_DISSIPATED,
       JLAW_DAMAGE,
       JLAW_MEASURES
};

enum { /* verdicts of jlaw_check_list; library.py has the same numbers */
       JLAW_INCREASING = 1,
       JLAW_ANY_ORDER = 0,
       JLAW_OUTSIDE = -1,
       JLAW_REPEATED = -2,
       JLAW_NO_MEMORY = -3
};

enum { JLAW_CACHE_LINE = 64 /* bytes */ };

typedef struct { /* a listed joint */
  unsigned joint, row; /* row in d, F, C and measures */
} jlaw_entry;

typedef struct {
  const jlaw_law *law;
  double *state;          /* (blocks, rows, JLAW_JOINTS_PER_BLOCK), or (n, rows) if contiguous */
  const double *d;        /* (n, dim) */
  double *F, *C;          /* (n, dim), (n, dim, dim); C may be NULL */
  double *measures;       /* (n, JLAW_MEASURES + dim) after the step, or NULL */
  const long long *index;    /* (n,): the joints to advance, of which joint k has row k in d, F, C
                              * and measures; sorted by block, or in any order if contiguous */
  const jlaw_entry *entries; /* (n,): as index, in any order of rows, sorted by block. Both NULL: all */
  long long n;
  long long next,
      chunk; /* first joint that no thread has taken, 0 before a call; joints per grab */
  int rows;
  int contiguous; /* whether the state of a joint is contiguous, (n, rows) */
  int float_sliders; /* whether forces of sliders are floats (sliders.h); not if contiguous */
  int lanes;      /* of a vector: at most jlaw_lanes(), and one of jlaw_levels() */
  int track_dissipation, commit;
} jlaw_batch;

typedef int jlaw_call(const jlaw_batch *b, long first, long last);
#endif
