/* batch.c: operations on many joints, called through library.c.
 *
 * States of a batch are stored in blocks of eight joints (JLAW_JOINTS_PER_BLOCK), (blocks, rows,
 * 8): row r of eight neighbouring joints is one cache line, and one AVX-512 register. A step takes
 * the joints of a block together, one joint per lane of a vector. All lanes then execute the same
 * instructions on the same tables, whose numbers are broadcast, so the law vectorises without
 * gather instructions except for the look-up in the first-loading curve. Branches that some lanes
 * need are taken by all lanes and masked.
 *
 * Three things follow from this layout. An index list (b->index) scatters joints over blocks: they
 * are copied into one block, advanced, and copied back. A trial step (b->commit = 0) advances a
 * copy of the block, so the states do not change. While a block is advanced the next one is
 * prefetched, which hides the latency of memory for batches larger than the cache.
 *
 * A batch also keeps, in the rows after the state, Phi and Phi' of the first-loading curve of every
 * facet (and, if asperities yield, the same at the plastic indentation). The values at the end of a
 * step are those at the start of the next one, which saves half of the look-ups. `refresh`
 * recomputes them after states were written from outside.
 *
 * Few joints do not fill vectors. They are stored contiguously, (n, rows), and vectorised over four
 * facets instead (JLAW_FACET_VECTORS). Both forms sum the facets in the same order and give the
 * same bits.
 *
 * This file is compiled several times: with -DJL_W=8, 4 and 2 for blocks of joints, and with
 * -DJL_W=4 -DJLAW_FACET_VECTORS for contiguous states. -DKIND=_8 and the like is the suffix of the
 * table of functions.
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
#ifdef JLAW_FACET_VECTORS
#define BLOCK 1
#else
#define BLOCK JLAW_JOINTS_PER_BLOCK
#endif

/* Write measures of the first `count` joints at n after a step, one row of b->measures each */
static void write_measures(const jlaw_batch *b, jl_states n, const jl_measures *measures,
                           double *out, int count)
{
  const int dim = b->law->dim, row_size = JLAW_MEASURES + dim;
  const int element_row = jl_element_row(b->law);
  for (int l = 0; l < count; l++, out += row_size) {
    const double *s = n.s + l;
    out[JLAW_SLIDING] = JL_JOINT(measures->sliding, l);
    out[JLAW_SLIPPING] = JL_JOINT(measures->slipping, l);
    out[JLAW_SEPARATED] = JL_JOINT(measures->separated, l);
    out[JLAW_STORED] = JL_JOINT(measures->stored, l);
    out[JLAW_DISSIPATED] = s[(size_t) dim * n.stride];
    out[JLAW_DAMAGE] = jl_damage(b->law, s, element_row, n.stride);
    for (int i = 0; i < dim; i++) out[JLAW_MEASURES + i] = s[(size_t) i * n.stride];
  }
}

/* Advance `count` joints of a block. `first`: index of the first one in d, F, C and measures;
 * next_offset: distance to the block that is advanced next, 0 if there is none */
static void advance_block(const jlaw_batch *b, double *block, size_t next_offset, long first,
                          int count)
{
  const int dim = b->law->dim, curve_stored = b->rows > jl_state_rows(b->law);
  const double *d = b->d + first * dim;
  double *F = b->F + first * dim, *C = b->C ? b->C + first * dim * dim : NULL;
  for (int at = 0; at < count; at += JL_JOINTS_PER_PASS) {
    const jl_states n = {block + at, BLOCK, next_offset};
    jl_joint_real p[3], f[3], c[9];
    const int lanes = count - at < JL_JOINTS_PER_PASS ? count - at : JL_JOINTS_PER_PASS;
    for (int i = 0; i < dim; i++) {
      p[i] = jl_broadcast_joint(0.0);
      for (int l = 0; l < lanes; l++) JL_JOINT(p[i], l) = d[(at + l) * dim + i];
    }
    jl_measures measures;
    jl_step_of_kind(b->law, n, p, f, c, b->track_dissipation, C != NULL, curve_stored,
                    b->measures && !C ? &measures : NULL);
    if (b->measures && C) measures = jl_measure(b->law, n);
    if (b->measures)
      write_measures(b, n, &measures, b->measures + (first + at) * (JLAW_MEASURES + dim), lanes);
    for (int l = 0; l < lanes; l++) {
      for (int i = 0; i < dim; i++) F[(at + l) * dim + i] = JL_JOINT(f[i], l);
      for (int i = 0; C && i < dim * dim; i++) C[(at + l) * dim * dim + i] = JL_JOINT(c[i], l);
    }
  }
}

/* First number of a joint's state; its rows are BLOCK numbers apart */
static double *state_of(const jlaw_batch *b, long long joint)
{
  return b->state + joint / BLOCK * BLOCK * b->rows + joint % BLOCK;
}

/* Advance entries first to last - 1 of b->index, or of all joints if it is NULL; `first` is a
 * multiple of BLOCK. Without b->commit no state changes. Returns 0, or -1
 * if no memory is left. */
static int advance(const jlaw_batch *b, long first, long last)
{
  const size_t rows = (size_t) b->rows, size = rows * BLOCK;
  double *copy = NULL;
  if (b->index || !b->commit) {
    copy = (double *) calloc(size, sizeof *copy);
    if (!copy) return -1;
  }
  for (long start = first; start < last; start += BLOCK) {
    const int count = last - start < BLOCK ? (int) (last - start) : BLOCK;
    double *block = copy;
    if (b->index)
      for (int l = 0; l < count; l++) {
        const double *from = state_of(b, b->index[start + l]);
        for (size_t r = 0; r < rows; r++) copy[r * BLOCK + (size_t) l] = from[r * BLOCK];
      }
    else if (!b->commit) memcpy(copy, state_of(b, start), size * sizeof *copy);
    else block = state_of(b, start);
    advance_block(b, block, copy ? 0 : size, start, count);
    if (b->index && b->commit)
      for (int l = 0; l < count; l++) {
        double *to = state_of(b, b->index[start + l]);
        for (size_t r = 0; r < rows; r++) to[r * BLOCK] = copy[r * BLOCK + (size_t) l];
      }
  }
  free(copy);
  return 0;
}

/* Measures (n, 5) of joints first to last - 1, in the order of kernels/element.py, into b->F */
static int measure(const jlaw_batch *b, long first, long last)
{
  for (long at = first; at < last; at += JL_JOINTS_PER_PASS) {
    const jl_states n = {state_of(b, at), BLOCK, 0};
    const jl_measures all = jl_measure(b->law, n);
    const jl_joint_real out[5] = {all.sliding, all.slipping, all.separated, all.stored,
                                  all.max_effective_closure};
    for (int i = 0; i < 5; i++)
      for (int l = 0; l < JL_JOINTS_PER_PASS && at + l < last; l++)
        b->F[5 * (at + l) + i] = JL_JOINT(out[i], l);
  }
  return 0;
}

/* Tractions (n, dim) of joints first to last - 1 in their present states, into b->F */
static int traction(const jlaw_batch *b, long first, long last)
{
  const int dim = b->law->dim;
  for (long at = first; at < last; at += JL_JOINTS_PER_PASS) {
    const jl_states n = {state_of(b, at), BLOCK, 0};
    jl_joint_real F[3];
    jl_traction(b->law, n, F);
    for (int i = 0; i < dim; i++)
      for (int l = 0; l < JL_JOINTS_PER_PASS && at + l < last; l++)
        b->F[dim * (at + l) + i] = JL_JOINT(F[i], l);
  }
  return 0;
}

/* Bounds (n,) of |C| of joints first to last - 1 in their present states, into b->F */
static int stiffness(const jlaw_batch *b, long first, long last)
{
  for (long at = first; at < last; at += JL_JOINTS_PER_PASS) {
    const jl_states n = {state_of(b, at), BLOCK, 0};
    const jl_joint_real bound = jl_stiffness_bound(b->law, n);
    for (int l = 0; l < JL_JOINTS_PER_PASS && at + l < last; l++) b->F[at + l] = JL_JOINT(bound, l);
  }
  return 0;
}

/* Recompute the rows after the states, Phi and Phi' of joints first to last - 1 */
static int refresh(const jlaw_batch *b, long first, long last)
{
  const jlaw_law *law = b->law;
  const int M = law->facets, curve_row = jl_state_rows(law);
  for (long joint = first; joint < last; joint += JL_JOINTS_PER_PASS) {
    const jl_states n = {state_of(b, joint), BLOCK, 0};
    for (int at = 0; at < M && b->rows > curve_row; at += JL_FACETS_PER_PASS) {
      const int count = M - at < JL_FACETS_PER_PASS ? M - at : JL_FACETS_PER_PASS;
      jl_facet_step o;
      jl_evaluate_facets(law, n, at, &o);
      jl_store(n, curve_row + at, 1, count, o.f1);
      jl_store(n, curve_row + M + at, 1, count, o.k1);
      if (!law->yields) continue;
      jl_store(n, curve_row + 2 * M + at, 1, count, o.fz1);
      jl_store(n, curve_row + 3 * M + at, 1, count, o.kz1);
    }
  }
  return 0;
}

extern jlaw_call *const NAME(jlaw_calls)[JLAW_OPERATIONS];
jlaw_call *const NAME(jlaw_calls)[JLAW_OPERATIONS] = {advance, measure, refresh, stiffness, traction};
