/* batch.h: what a batch hands to the library; library.py has the same structure */
#ifndef JLAW_BATCH_H
#define JLAW_BATCH_H
#include <float.h>
#include <math.h>
#include <stddef.h>
typedef struct jlaw_law jlaw_law;
#include "layout.h"

enum { JLAW_BLOCK = 8 /* joints side by side in a block of states */ };

enum { /* what a step shows of a joint: shares, J/m2, damage of its bond; then its displacement */
       JLAW_SLIDING,
       JLAW_SLIPPING,
       JLAW_SEPARATED,
       JLAW_STORED,
       JLAW_LOST,
       JLAW_DAMAGE,
       JLAW_SHOWN
};

typedef struct {
  const jlaw_law *law;
  double *state;          /* (blocks, rows, JLAW_BLOCK), or (n, rows) */
  const double *d;        /* (n, dim), or NULL: what the states bear, before slopes wear */
  double *F, *C;          /* (n, dim), (n, dim, dim); C may be NULL */
  double *shown;          /* (n, JLAW_SHOWN + dim): what joints then amount to, or NULL */
  const long long *index; /* the joints that move (n,), or NULL for all */
  long long n;
  long long taken, grain; /* joints that threads have taken: 0 before a run; how many at once */
  int rows;
  int alone; /* whether the states lie (n, rows) */
  int lanes; /* of vectors: at most jlaw_lanes(), and one of jlaw_levels() */
  int ledger, keep;
} jlaw_batch;

typedef int jlaw_call(const jlaw_batch *b, long first, long last);
#endif
