/* batch.c: operations on many joints, called through library.c.
 *
 * States of a batch are stored in blocks of eight joints (JLAW_JOINTS_PER_BLOCK), (blocks, rows,
 * 8): row r of eight neighbouring joints is one cache line, and one AVX-512 register. A step takes
 * the joints of a block together, one joint per lane of a vector. All lanes then execute the same
 * instructions on the same tables, whose numbers are broadcast, so the law vectorises without
 * gather instructions except for the look-up in the first-loading curve. Branches that some lanes
 * need are taken by all lanes and masked.
 *
 * Three things follow from this layout. A list of joints is sorted by block. A block with
 * many listed joints is advanced as a whole, and the states of its other joints are restored.
 * Where few joints of a block are listed, joints of several blocks are gathered into a copy,
 * advanced, and copied back (copy_lanes: one shuffle per row). A trial step (b->commit = 0) advances
 * a copy of the block, so the states do not change. While a block is advanced the next one is
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
 * This file is compiled several times: with -DJL_W=8, 4 and 2 for blocks of joints, with
 * -DJLAW_FLOAT_SLIDERS too for blocks whose slider forces are floats (sliders.h), and with
 * -DJL_W=4 -DJLAW_FACET_VECTORS for contiguous states. -DKIND=_8 and the like is the suffix of the
 * table of functions.
 */
#include "batch.h"
#include "lanes.h"
#include "elements.h"
#define JL_BATCH 1
#include "law.h"
#include <stdint.h>
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

enum {
  MAX_GATHERED_OF_BLOCK = 6, /* listed joints of a block up to which gathering them is faster */
  NOT_LISTED = -1
};

/* Write measures after a step of the joints at n whose rows are listed, into these rows of
 * b->measures */
static void write_measures(const jlaw_batch *b, jl_states n, const jl_measures *measures,
                           const long *row)
{
  const int dim = b->law->dim, row_size = JLAW_MEASURES + dim;
  const int element_row = jl_element_row(b->law);
  for (int l = 0; l < JL_JOINTS_PER_PASS; l++) {
    if (row[l] == NOT_LISTED) continue;
    const double *s = n.s + l;
    double *out = b->measures + row[l] * row_size;
    out[JLAW_SLIDING] = JL_JOINT(measures->sliding, l);
    out[JLAW_SLIPPING] = JL_JOINT(measures->slipping, l);
    out[JLAW_SEPARATED] = JL_JOINT(measures->separated, l);
    out[JLAW_STORED] = JL_JOINT(measures->stored, l);
    out[JLAW_DISSIPATED] = s[(size_t) dim * n.stride];
    out[JLAW_DAMAGE] = jl_damage(b->law, s, element_row, n.stride);
    for (int i = 0; i < dim; i++) out[JLAW_MEASURES + i] = s[(size_t) i * n.stride];
  }
}

/* Advance the joints of a block. row: row of each joint in d, F, C and measures; a joint without
 * one takes a zero increment. next_offset: distance to the block that is advanced next, 0 if there
 * is none */
static void advance_block(const jlaw_batch *b, double *block, size_t next_offset, const long *row)
{
  const int dim = b->law->dim, curve_stored = b->rows > jl_state_rows(b->law);
  for (int at = 0; at < BLOCK; at += JL_JOINTS_PER_PASS, row += JL_JOINTS_PER_PASS) {
    const jl_states n = {block + at, BLOCK, next_offset};
    jl_joint_real p[3], f[3], c[9];
    for (int i = 0; i < dim; i++) p[i] = jl_broadcast_joint(0.0);
    int is_empty = 1;
    for (int l = 0; l < JL_JOINTS_PER_PASS; l++) {
      if (row[l] == NOT_LISTED) continue;
      is_empty = 0;
      for (int i = 0; i < dim; i++) JL_JOINT(p[i], l) = b->d[row[l] * dim + i];
    }
    if (is_empty) continue;
    jl_measures measures;
    jl_step_of_kind(b->law, n, p, f, c, b->track_dissipation, b->C != NULL, curve_stored,
                    b->measures && !b->C ? &measures : NULL);
    if (b->measures && b->C) measures = jl_measure(b->law, n);
    if (b->measures) write_measures(b, n, &measures, row);
    for (int l = 0; l < JL_JOINTS_PER_PASS; l++) {
      if (row[l] == NOT_LISTED) continue;
      double *F = b->F + row[l] * dim, *C = b->C + row[l] * dim * dim;
      for (int i = 0; i < dim; i++) F[i] = JL_JOINT(f[i], l);
      for (int i = 0; b->C && i < dim * dim; i++) C[i] = JL_JOINT(c[i], l);
    }
  }
}

/* First number of a joint's state; its rows are BLOCK numbers apart */
static double *state_of(const jlaw_batch *b, long long joint)
{
  return b->state + joint / BLOCK * BLOCK * b->rows + joint % BLOCK;
}

/* Zeros for `blocks` blocks of states, aligned to a cache line: a row that lies in two lines costs two
 * accesses. Returns their address in the allocated memory, or NULL if no memory is left. */
static double *allocate_blocks(const jlaw_batch *b, int blocks, void **memory)
{
  *memory = calloc((size_t) blocks * (size_t) b->rows * BLOCK * sizeof(double) + JLAW_CACHE_LINE, 1);
  if (!*memory) return NULL;
  const uintptr_t first = (uintptr_t) *memory + JLAW_CACHE_LINE - 1;
  return (double *) (first / JLAW_CACHE_LINE * JLAW_CACHE_LINE);
}

/* Advance joints first to last - 1; `first` is a multiple of BLOCK. Without b->commit no state changes.
 * Returns 0, or -1 if no memory is left. */
static int advance_all(const jlaw_batch *b, long first, long last)
{
  const size_t rows = (size_t) b->rows, size = rows * BLOCK;
  void *memory = NULL;
  double *copy = NULL;
  if (!b->commit) {
    copy = allocate_blocks(b, 1, &memory);
    if (!copy) return -1;
  }
  for (long start = first; start < last; start += BLOCK) {
    const int count = last - start < BLOCK ? (int) (last - start) : BLOCK;
    double *block = state_of(b, start);
    if (copy) block = (double *) memcpy(copy, block, size * sizeof *copy);
    long row[BLOCK];
    for (int l = 0; l < BLOCK; l++) row[l] = l < count ? start + l : NOT_LISTED;
    advance_block(b, block, copy ? 0 : size, row);
  }
  free(memory);
  return 0;
}

/* Sets of lanes of a block: bit l is set if lane l belongs to it */
enum { ALL_LANES = (1 << BLOCK) - 1 };

static int count_lanes(int lanes)
{
  int count = 0;
  for (; lanes; lanes &= lanes - 1) count++;
  return count;
}

/* Copy the states of these joints of a block to other lanes of another block, in the same order:
 * as many lanes in `to_lanes` as in `from_lanes` */
static void copy_lanes(const double *from, int from_lanes, double *to, int to_lanes, size_t rows)
{
  int source[BLOCK] = {0}; /* lane of `from` for each lane of `to` */
  for (int l = 0, k = 0; l < BLOCK; l++) {
    if (!(to_lanes >> l & 1)) continue;
    while (!(from_lanes >> k & 1)) k++;
    source[l] = k++;
  }
#if defined(__AVX512F__) && JL_W == 8 && !defined(JLAW_FACET_VECTORS) /* a row by one shuffle */
  const __m512i order = _mm512_cvtepi32_epi64(_mm256_loadu_si256((const __m256i *) source));
  for (size_t r = 0; r < rows; r++, from += BLOCK, to += BLOCK)
    _mm512_mask_storeu_pd(to, (__mmask8) to_lanes,
                          _mm512_permutexvar_pd(order, _mm512_loadu_pd(from)));
#else
  for (int l = 0; l < BLOCK; l++)
    for (size_t r = 0; to_lanes >> l & 1 && r < rows; r++)
      to[r * BLOCK + (size_t) l] = from[r * BLOCK + (size_t) source[l]];
#endif
}

typedef struct { /* listed joints in the lanes of a block of states */
  int lanes;       /* set of lanes that hold a listed joint */
  long row[BLOCK]; /* of d, F, C and measures, or NOT_LISTED */
} joint_group;

typedef struct { /* a group whose joints were gathered from several blocks */
  joint_group group;
  int count, sources;
  struct {
    double *block;
    int lanes, copy_lanes; /* sets of lanes in the block and in the copy */
  } source[BLOCK];
} gathered_group;

static joint_group empty_group(void)
{
  joint_group g = {0};
  for (int l = 0; l < BLOCK; l++) g.row[l] = NOT_LISTED;
  return g;
}

/* Entry k of a list: its joint, and the row of the joint in d, F, C and measures */
static long long joint_of_entry(const jlaw_batch *b, long k)
{
  return b->entries ? (long long) b->entries[k].joint : b->index[k];
}

static long long block_of_entry(const jlaw_batch *b, long k)
{
  return joint_of_entry(b, k) / BLOCK;
}

static long row_of_entry(const jlaw_batch *b, long k)
{
  return b->entries ? (long) b->entries[k].row : k;
}

/* Add entry k of the list to a group, in the lane of its joint */
static void add_entry(const jlaw_batch *b, joint_group *g, long k)
{
  const int l = (int) (joint_of_entry(b, k) % BLOCK);
  g->row[l] = row_of_entry(b, k);
  g->lanes |= 1 << l;
}

/* Advance a group in its own block. next_offset: distance to the block that is advanced next. copy:
 * memory for a block. */
static void advance_in_place(const jlaw_batch *b, const joint_group *g, double *block,
                             size_t next_offset, double *copy)
{
  const size_t rows = (size_t) b->rows;
  const int others = ALL_LANES & ~g->lanes;
  if (!b->commit) {
    advance_block(b, (double *) memcpy(copy, block, rows * BLOCK * sizeof *copy), 0, g->row);
    return;
  }
  if (others) copy_lanes(block, others, copy, others, rows);
  advance_block(b, block, next_offset, g->row);
  if (others) copy_lanes(copy, others, block, others, rows);
}

/* Advance gathered joints in `copy`, return them to their blocks, and empty the group. next: block to
 * prefetch meanwhile, or NULL */
static void advance_gathered(const jlaw_batch *b, gathered_group *g, double *copy,
                             const double *next)
{
  const uintptr_t offset = next ? (uintptr_t) next - (uintptr_t) copy : 0;
  advance_block(b, copy, (size_t) ((intptr_t) offset / (intptr_t) sizeof *copy), g->group.row);
  for (int i = 0; b->commit && i < g->sources; i++)
    copy_lanes(copy, g->source[i].copy_lanes, g->source[i].block, g->source[i].lanes,
               (size_t) b->rows);
  g->group = empty_group();
  g->count = g->sources = 0;
}

static void prefetch_block(const jlaw_batch *b, const double *block)
{
  for (int r = 0; r < b->rows; r++) __builtin_prefetch(block + (size_t) r * BLOCK, 1);
}

/* Add the joints of a group in `block` to the joints that were gathered into `copy`. next: the block
 * that is gathered next, or NULL */
static void gather(const jlaw_batch *b, const joint_group *group, double *block,
                   const double *next, gathered_group *g, double *copy)
{
  if (next && g->count + count_lanes(group->lanes) <= BLOCK) { /* else in advance_gathered */
    prefetch_block(b, next);
    next = NULL;
  }
  for (int remaining = group->lanes; remaining;) {
    if (g->count == BLOCK) advance_gathered(b, g, copy, next);
    int taken = 0, copy_set = 0;
    for (int l = 0; l < BLOCK && g->count < BLOCK; l++) {
      if (!(remaining >> l & 1)) continue;
      g->group.row[g->count] = group->row[l];
      taken |= 1 << l;
      copy_set |= 1 << g->count++;
    }
    copy_lanes(block, taken, copy, copy_set, (size_t) b->rows);
    g->source[g->sources].block = block;
    g->source[g->sources].lanes = taken;
    g->source[g->sources++].copy_lanes = copy_set;
    remaining &= ~taken;
  }
}

/* Prefetch `count` numbers, which may begin anywhere in a cache line */
static void prefetch_numbers(const double *at, int count)
{
  for (int i = 0; i < count; i += JLAW_CACHE_LINE / (int) sizeof *at)
    __builtin_prefetch(at + i, 1);
  __builtin_prefetch(at + count - 1, 1);
}

/* Prefetch the rows of the entries first to last - 1 in an array with `size` numbers a row: a list in
 * any order scatters them */
static void prefetch_rows(const jlaw_batch *b, const double *array, int size, long first, long last)
{
  if (!array || !b->entries) return;
  for (long k = first; k < last && k < b->n; k++)
    prefetch_numbers(array + (size_t) b->entries[k].row * size, size);
}

/* Advance entries first to last - 1 of a list. A block of joints belongs to the thread that takes
 * its first entry. Returns 0, or -1 if no memory is left. */
static int advance_listed(const jlaw_batch *b, long first, long last)
{
  const size_t rows = (size_t) b->rows, size = rows * BLOCK;
  const int dim = b->law->dim;
  void *memory;
  double *copy = allocate_blocks(b, 2, &memory);
  if (!copy) return -1;
  gathered_group gathered = {empty_group(), 0, 0, {{NULL, 0, 0}}};
  while (first > 0 && first < last && block_of_entry(b, first) == block_of_entry(b, first - 1)) first++;
  for (long start = first; start < last;) {
    const long long block = block_of_entry(b, start);
    const long begin = start;
    joint_group group = empty_group();
    for (; start < b->n && block_of_entry(b, start) == block; start++) add_entry(b, &group, start);
    /* the fill buffers of a processor hold about 16 cache lines: F and C now, d after the step */
    prefetch_rows(b, b->F, dim, begin, start);
    prefetch_rows(b, b->C, dim * dim, begin, start);
    double *state = state_of(b, block * BLOCK);
    if (group.lanes == ALL_LANES || count_lanes(group.lanes) > MAX_GATHERED_OF_BLOCK) {
      const long long next = start < last ? block_of_entry(b, start) - block : 0;
      advance_in_place(b, &group, state, (size_t) next * size, copy);
    } else {
      const double *next = start < last ? state_of(b, block_of_entry(b, start) * BLOCK) : NULL;
      gather(b, &group, state, next, &gathered, copy + size);
    }
    prefetch_rows(b, b->d, dim, start + BLOCK, start + 2 * BLOCK);
  }
  advance_gathered(b, &gathered, copy + size, NULL);
  free(memory);
  return 0;
}

/* Advance joints, or entries of a list, first to last - 1 */
static int advance(const jlaw_batch *b, long first, long last)
{
  return b->index || b->entries ? advance_listed(b, first, last) : advance_all(b, first, last);
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
