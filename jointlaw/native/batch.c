/* batch.c: many joints. Compiled several times: with -DJL_W=8, 4 and 2 for states in blocks of
 * JLAW_BLOCK joints side by side, (blocks, rows, JLAW_BLOCK); with -DJL_W=4 -DJLAW_ABREAST for
 * joints one after the other, (joints, rows). -DKIND=_8 and so on ends the name of the table of
 * functions.
 */
#include "batch.h"
#include "lanes.h"
#include "elements.h"
#define JL_BATCH 1
#include "law.h"
#include <stdlib.h>
#include <string.h>

#define GLUE2(a, b) a##b
#define GLUE(a, b) GLUE2(a, b)
#define NAME(x) GLUE(x, KIND)
#ifdef JLAW_ABREAST
#define BLOCK 1
#else
#define BLOCK JLAW_BLOCK /* joints of a block */
#endif

/* What joints at n amount to after a step, into rows of b->shown */
static void show(const jlaw_batch *b, jl_numbers n, const jl_amounts *all, double *to, int some)
{
  const int dim = b->law->dim, size = JLAW_SHOWN + dim, last = jl_state_rows(b->law) - 1;
  for (int l = 0; l < some; l++, to += size) {
    const double *s = n.s + l;
    to[JLAW_SLIDING] = JL_JOINT(all->sliding, l);
    to[JLAW_SLIPPING] = JL_JOINT(all->slipping, l);
    to[JLAW_SEPARATED] = JL_JOINT(all->separated, l);
    to[JLAW_STORED] = JL_JOINT(all->stored, l);
    to[JLAW_LOST] = s[(size_t) dim * n.stride];
    const double damage = jl_element_rows(b->law) ? s[(size_t) last * n.stride] : 1.0;
    to[JLAW_DAMAGE] = damage < 1.0 ? damage : 1.0; /* more where Coulomb's faces have parted */
    for (int i = 0; i < dim; i++) to[JLAW_SHOWN + i] = s[(size_t) i * n.stride];
  }
}

/* Advance the joints of a block: d, F, C and what is shown of the first of them */
static void advance_block(const jlaw_batch *b, double *block, size_t ahead, long first, int count)
{
  const int dim = b->law->dim, kept = b->rows > jl_state_rows(b->law);
  const double *d = b->d ? b->d + first * dim : NULL;
  double *F = b->F + first * dim, *C = b->C ? b->C + first * dim * dim : NULL;
  for (int at = 0; at < count; at += JL_JOINTS) {
    const jl_numbers n = {block + at, BLOCK, ahead};
    jl_of_joint p[3], f[3], c[9];
    const int some = count - at < JL_JOINTS ? count - at : JL_JOINTS;
    for (int i = 0; i < dim; i++) {
      p[i] = jl_each_joint(0.0);
      for (int l = 0; d && l < some; l++) JL_JOINT(p[i], l) = d[(at + l) * dim + i];
    }
    jl_amounts all;
    jl_step_of_kind(b->law, n, p, f, c, b->ledger, C != NULL, kept, b->shown && !C ? &all : NULL);
    if (b->shown && C) all = jl_measure(b->law, n);
    if (b->shown) show(b, n, &all, b->shown + (first + at) * (JLAW_SHOWN + dim), some);
    for (int l = 0; l < some; l++) {
      for (int i = 0; i < dim; i++) F[(at + l) * dim + i] = JL_JOINT(f[i], l);
      for (int i = 0; C && i < dim * dim; i++) C[(at + l) * dim * dim + i] = JL_JOINT(c[i], l);
    }
  }
}

/* Where the numbers of a joint begin; they are BLOCK apart */
static double *joint_of(const jlaw_batch *b, long long joint)
{
  return b->state + joint / BLOCK * BLOCK * b->rows + joint % BLOCK;
}

/* Advance numbers first to last - 1 of the list b->index, or of all joints where it is NULL; first
 * begins a block. Without b->keep, as always without b->d, the states stay as they were. 0, or -1
 * where memory is short. */
static int advance(const jlaw_batch *b, long first, long last)
{
  const size_t rows = (size_t) b->rows, size = rows * BLOCK;
  double *copy = NULL;
  if (b->index || !b->keep) {
    copy = (double *) calloc(size, sizeof *copy);
    if (!copy) return -1;
  }
  for (long start = first; start < last; start += BLOCK) {
    const int count = last - start < BLOCK ? (int) (last - start) : BLOCK;
    double *block = copy;
    if (b->index)
      for (int l = 0; l < count; l++) {
        const double *from = joint_of(b, b->index[start + l]);
        for (size_t r = 0; r < rows; r++) copy[r * BLOCK + (size_t) l] = from[r * BLOCK];
      }
    else if (!b->keep) memcpy(copy, joint_of(b, start), size * sizeof *copy);
    else block = joint_of(b, start);
    for (int l = 0; !b->d && b->law->wears && l < BLOCK; l++)
      copy[(size_t) (jl_worn_row(b->law) + 1) * BLOCK + (size_t) l] = 0.0; /* work that wears */
    advance_block(b, block, copy ? 0 : size, start, count);
    if (b->index && b->keep)
      for (int l = 0; l < count; l++) {
        double *to = joint_of(b, b->index[start + l]);
        for (size_t r = 0; r < rows; r++) to[r * BLOCK] = copy[r * BLOCK + (size_t) l];
      }
  }
  free(copy);
  return 0;
}

/* Measures (n, 5) of joints first to last - 1, as reference.measures, into b->F */
static int measure(const jlaw_batch *b, long first, long last)
{
  for (long at = first; at < last; at += JL_JOINTS) {
    const jl_numbers n = {joint_of(b, at), BLOCK, 0};
    const jl_amounts all = jl_measure(b->law, n);
    const jl_of_joint out[5] = {all.sliding, all.slipping, all.separated, all.stored, all.reach};
    for (int i = 0; i < 5; i++)
      for (int l = 0; l < JL_JOINTS && at + l < last; l++)
        b->F[5 * (at + l) + i] = JL_JOINT(out[i], l);
  }
  return 0;
}

/* Bounds (n,) of |C| of joints first to last - 1 as they are, into b->F */
static int stiffness(const jlaw_batch *b, long first, long last)
{
  for (long at = first; at < last; at += JL_JOINTS) {
    const jl_numbers n = {joint_of(b, at), BLOCK, 0};
    const jl_of_joint bound = jl_stiffness(b->law, n);
    for (int l = 0; l < JL_JOINTS && at + l < last; l++) b->F[at + l] = JL_JOINT(bound, l);
  }
  return 0;
}

/* Phi and Phi' that joints first to last - 1 keep, after their states were written */
static int refresh(const jlaw_batch *b, long first, long last)
{
  const jlaw_law *law = b->law;
  const int M = law->facets, kept = jl_state_rows(law);
  for (long joint = first; joint < last; joint += JL_JOINTS) {
    const jl_numbers n = {joint_of(b, joint), BLOCK, 0};
    for (int at = 0; at < M && b->rows > kept; at += JL_TOGETHER) {
      const int some = M - at < JL_TOGETHER ? M - at : JL_TOGETHER;
      jl_facets o;
      jl_facets_now(law, n, at, &o);
      jl_put(n, kept + at, 1, some, o.f1);
      jl_put(n, kept + M + at, 1, some, o.k1);
      if (!law->yields) continue;
      jl_put(n, kept + 2 * M + at, 1, some, o.fz1);
      jl_put(n, kept + 3 * M + at, 1, some, o.kz1);
    }
  }
  return 0;
}

extern jlaw_call *const NAME(jlaw_calls)[4];
jlaw_call *const NAME(jlaw_calls)[4] = {advance, measure, refresh, stiffness};
