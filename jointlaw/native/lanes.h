/* lanes.h: W = JL_W numbers side by side, the data types of law.h.
 *
 * The law is written once, for vectors of W lanes, and compiled in three forms:
 *
 *   W joints, W = 8, 4 or 2   a batch: vector extensions of gcc, g++, clang, clang++ and zig
 *   one joint, W = 1          plain C99: any compiler, CUDA (one thread per joint), WebAssembly
 *   four facets of one joint  JLAW_FACET_VECTORS, W = 4: one joint at a time
 *
 * In the first form the lanes are joints: numbers of a facet's tables are the same in all lanes, and
 * numbers of a joint differ. In the last form the lanes are facets, and it is the other way round.
 * Hence four types:
 *
 *   jl_real         a number per lane
 *   jl_mask         a truth value per lane: all bits set, or none (W = 1: 1 or 0)
 *   jl_facet_real   a number of a facet's tables: double, or jl_real if the lanes are facets
 *   jl_joint_real   a number of a joint: jl_real, or double if the lanes are facets
 *
 * Conditions become masks: jl_select(mask, a, b) chooses per lane, jl_any(mask) skips work that no
 * lane needs. A pass of the loop over facets handles JL_FACETS_PER_PASS facets of
 * JL_JOINTS_PER_PASS joints.
 *
 * All forms give the same bits, because they sum the facets in the same order: facet i is added to
 * partial sum i % 4, and jl_total adds the four partial sums. Only CUDA uses a single sum, since an
 * array would be stored in slow local memory.
 */
#ifndef JL_W
#define JL_W 1
#endif
#ifndef JLAW_FUNCTION
#define JLAW_FUNCTION /* for CUDA: __device__ */
#endif
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define JL_INLINE static JLAW_FUNCTION __forceinline__
#elif defined(__GNUC__) && defined(__OPTIMIZE__)
#define JL_INLINE static inline __attribute__((always_inline))
#else
#define JL_INLINE static inline
#endif

/* -------------------------------------------------------------------- numbers and masks */

#if JL_W == 1
typedef double jl_real;
typedef int jl_mask, jl_int;
#define JL_LANE(x, l) (x)
#define jl_broadcast(x) (x) /* the number x in all lanes */
#define jl_select(m, a, b) ((m) ? (a) : (b))
#define jl_select_or_zero(m, a) ((m) ? (a) : 0.0)
#define jl_any(m) (m)
#define jl_sqrt(x) sqrt(x)
#define jl_abs(x) fabs(x)
#define jl_to_int(x) ((int) (x))
#define jl_to_real(i) ((double) (i))
#else
typedef double jl_real __attribute__((vector_size(8 * JL_W)));
typedef double jl_unaligned
    __attribute__((vector_size(8 * JL_W), aligned(8), may_alias)); /* at any address of a double */
typedef long long jl_mask __attribute__((vector_size(8 * JL_W)));
typedef int jl_int __attribute__((vector_size(4 * JL_W)));
#define JL_LANE(x, l) ((x)[l])
#define jl_to_int(x) __builtin_convertvector(x, jl_int)
#define jl_to_real(i) __builtin_convertvector(i, jl_real)
#ifdef __cplusplus /* compilers remove the subtraction of zero */
#define jl_broadcast(x) ((x) - jl_real())
#define jl_select(m, a, b) ((m) ? jl_broadcast(a) : jl_broadcast(b))
#define jl_select_or_zero(m, a) ((m) ? jl_broadcast(a) : jl_real())
#else
#define jl_broadcast(x) ((x) - (jl_real) {0})
#define jl_select(m, a, b) jl_select_lanes(m, jl_broadcast(a), jl_broadcast(b))
#define jl_select_or_zero(m, a) jl_select_lanes_or_zero(m, jl_broadcast(a))
JL_INLINE jl_real jl_select_lanes(jl_mask m, jl_real a, jl_real b)
{
  return (jl_real) ((m & (jl_mask) a) | (~m & (jl_mask) b));
}
JL_INLINE jl_real jl_select_lanes_or_zero(jl_mask m, jl_real a)
{
  return (jl_real) (m & (jl_mask) a);
}
#endif
JL_INLINE jl_real jl_abs(jl_real x) { return (jl_real) ((jl_mask) x & 0x7FFFFFFFFFFFFFFFLL); }

#if defined(__AVX512DQ__) && JL_W == 8
#include <immintrin.h>
JL_INLINE jl_real jl_sqrt(jl_real x) { return (jl_real) _mm512_sqrt_pd((__m512d) x); }
JL_INLINE int jl_any(jl_mask m) { return _mm512_movepi64_mask((__m512i) m) != 0; }
#else
JL_INLINE jl_real jl_sqrt(jl_real x)
{
  for (int l = 0; l < JL_W; l++) x[l] = sqrt(x[l]);
  return x;
}
JL_INLINE int jl_any(jl_mask m)
{
#if JL_W > 2 /* combine the halves first */
  typedef long long half __attribute__((vector_size(4 * JL_W)));
  const union {
    jl_mask m;
    half h[2];
  } two = {m};
  const half all = two.h[0] | two.h[1];
  long long bits = 0;
  for (int l = 0; l < JL_W / 2; l++) bits |= all[l];
  return bits != 0;
#else
  return (m[0] | m[1]) != 0;
#endif
}
#endif
#endif

JL_INLINE jl_real jl_max(jl_real a, jl_real b) { return jl_select(a > b, a, b); }
JL_INLINE jl_real jl_min(jl_real a, jl_real b) { return jl_select(a < b, a, b); }

/* ------------------------------------------------------------------------------ tables */

/* Gather the four coefficients of piece i, per lane, from a table (pieces, 4) */
JL_INLINE void jl_gather(const double *table, jl_int i, jl_real c[4])
{
#if defined(__AVX512DQ__) && JL_W == 8 /* eight loads of four, then a transpose */
  const double *p[8];
  for (int l = 0; l < 8; l++) p[l] = table + 4 * (size_t) (unsigned) i[l];
#define JL_LOAD_PAIR(a, b) \
  _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(p[a])), _mm256_loadu_pd(p[b]), 1)
  const __m512d r0 = JL_LOAD_PAIR(0, 4), r1 = JL_LOAD_PAIR(1, 5), r2 = JL_LOAD_PAIR(2, 6),
                r3 = JL_LOAD_PAIR(3, 7);
#undef JL_LOAD_PAIR
  const __m512d even = _mm512_unpacklo_pd(r0, r1), odd = _mm512_unpackhi_pd(r0, r1);
  const __m512d even2 = _mm512_unpacklo_pd(r2, r3), odd2 = _mm512_unpackhi_pd(r2, r3);
  const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
  const __m512i high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
  c[0] = (jl_real) _mm512_permutex2var_pd(even, low, even2);
  c[1] = (jl_real) _mm512_permutex2var_pd(odd, low, odd2);
  c[2] = (jl_real) _mm512_permutex2var_pd(even, high, even2);
  c[3] = (jl_real) _mm512_permutex2var_pd(odd, high, odd2);
#else
  for (int j = 0; j < 4; j++) {
    jl_real coefficient = jl_broadcast(0.0);
    for (int l = 0; l < JL_W; l++) JL_LANE(coefficient, l) = table[4 * JL_LANE(i, l) + j];
    c[j] = coefficient;
  }
#endif
}

/* ------------------------------------------------------------------- facets and joints */

/* States of JL_JOINTS_PER_PASS joints: row r of the first one is s[r stride].
 *
 * By default the joints lie side by side, row r of lane l is s[r stride + l], and next_offset is the
 * distance to the joints that follow, which are prefetched into the cache; 0 if there are none.
 * With JL_STATES_CONTIGUOUS each state is contiguous, and next_offset is the distance from one joint
 * to the next: row r of lane l is s[r stride + l next_offset]. */
typedef struct {
  double *s;
  size_t stride, next_offset;
} jl_states;
#ifdef JL_STATES_CONTIGUOUS
#define JL_STATE_OF_LANE(n, l) ((n).s + (size_t) (l) * (n).next_offset)
#else
#define JL_STATE_OF_LANE(n, l) ((n).s + (l))
#endif

#ifdef JLAW_FACET_VECTORS
typedef jl_real jl_facet_real;
typedef double jl_joint_real;
#define jl_any_to_compute(m) 1 /* the test costs more than the work that it could skip */
#define JL_FACETS_PER_PASS JL_W
#define JL_JOINTS_PER_PASS 1
#define JL_JOINT(x, l) (x)
#define jl_broadcast_joint(x) (x)
#define jl_sqrt_joint(x) sqrt(x)
/* A column of the tables of the four facets of a block */
JL_INLINE jl_facet_real jl_column(const double *block, int c)
{
  return (jl_real) * (const jl_unaligned *) (block + c * JLAW_FACET_LANES);
}
/* Load or store a row of the state of each of `count` facets, `spacing` rows from facet to facet.
 * Lanes beyond them, whose tables hold zeros, load the row of the last facet and store nothing. */
JL_INLINE jl_real jl_load(jl_states n, int row, int spacing, int count)
{
  const int last = (count - 1) * spacing;
#define JL_ROW_OF_LANE(l) n.s[(size_t) (row + ((l) < count ? (l) * spacing : last)) * n.stride]
  const jl_real x = {JL_ROW_OF_LANE(0), JL_ROW_OF_LANE(1), JL_ROW_OF_LANE(2), JL_ROW_OF_LANE(3)};
#undef JL_ROW_OF_LANE
  return x;
}
JL_INLINE void jl_store(jl_states n, int row, int spacing, int count, jl_real x)
{
  for (int l = 0; l < count; l++) n.s[(size_t) (row + l * spacing) * n.stride] = x[l];
}
JL_INLINE double jl_load_joint(jl_states n, int row) { return n.s[(size_t) row * n.stride]; }
JL_INLINE void jl_store_joint(jl_states n, int row, double x) { n.s[(size_t) row * n.stride] = x; }
#else
typedef double jl_facet_real;
typedef jl_real jl_joint_real;
#define jl_any_to_compute(m) jl_any(m)
#define JL_FACETS_PER_PASS 1
#define JL_JOINTS_PER_PASS JL_W
#define JL_JOINT(x, l) JL_LANE(x, l)
#define jl_broadcast_joint(x) jl_broadcast(x)
#define jl_sqrt_joint(x) jl_sqrt(x)
JL_INLINE jl_facet_real jl_column(const double *block, int c)
{
  return block[c * JLAW_FACET_LANES];
}
JL_INLINE jl_real jl_load_joint(jl_states n, int row)
{
#if JL_W == 1 || defined(JL_STATES_CONTIGUOUS)
  jl_real x = jl_broadcast(0.0);
  for (int l = 0; l < JL_W; l++) JL_LANE(x, l) = JL_STATE_OF_LANE(n, l)[(size_t) row * n.stride];
  return x;
#else
  const double *from = n.s + (size_t) row * n.stride;
  __builtin_prefetch(from + n.next_offset, 1);
  return (jl_real) * (const jl_unaligned *) from;
#endif
}
JL_INLINE void jl_store_joint(jl_states n, int row, jl_real x)
{
#if JL_W == 1 || defined(JL_STATES_CONTIGUOUS)
  for (int l = 0; l < JL_W; l++) JL_STATE_OF_LANE(n, l)[(size_t) row * n.stride] = JL_LANE(x, l);
#else
  *(jl_unaligned *) (n.s + (size_t) row * n.stride) = (jl_unaligned) x;
#endif
}
#define jl_load(n, row, spacing, count) ((void) (spacing), (void) (count), jl_load_joint(n, row))
#define jl_store(n, row, spacing, count, x) \
  ((void) (spacing), (void) (count), jl_store_joint(n, row, x))
#endif

/* Partial sums over facets, and their total: jl_total(sum, member) */
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define JL_PARTIAL_SUMS 1
#define jl_total(sum, member) ((sum)[0].member)
#elif defined(JLAW_FACET_VECTORS)
#define JL_PARTIAL_SUMS 1
#define jl_total(sum, member) \
  (((sum)[0].member[0] + (sum)[0].member[2]) + ((sum)[0].member[1] + (sum)[0].member[3]))
#else
#define JL_PARTIAL_SUMS 4
#define jl_total(sum, member) \
  (((sum)[0].member + (sum)[2].member) + ((sum)[1].member + (sum)[3].member))
#endif
