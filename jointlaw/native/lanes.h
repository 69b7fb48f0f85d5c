/* lanes.h: W = JL_W numbers side by side. The law (law.h) is written once, for lanes of three kinds:
 *
 *   W joints, W = 8, 4 or 2   a batch; vectors of the compilers gcc, g++, clang, clang++ and zig
 *   one joint, W = 1          plain C99: any compiler, CUDA (a thread is a joint), WebAssembly
 *   four facets of one joint  JLAW_ABREAST, W = 4: one joint at a time
 *
 * A jl_real is a number per lane, a jl_yes a truth per lane. A jl_of_facet is a number of a facet's
 * tables, a jl_of_joint one of a joint: a double where all lanes share it, else a jl_real. All kinds
 * give the same bits, for facets are added up in the same order: jl_total.
 */
#ifndef JL_W
#define JL_W 1
#endif
#ifndef JLAW_FUNCTION
#define JLAW_FUNCTION /* for CUDA: __device__ */
#endif
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define JL_IN static JLAW_FUNCTION __forceinline__
#elif defined(__GNUC__) && defined(__OPTIMIZE__)
#define JL_IN static inline __attribute__((always_inline))
#else
#define JL_IN static inline
#endif

/* ------------------------------------------------------------------- numbers and truths */

#if JL_W == 1
typedef double jl_real;
typedef int jl_yes, jl_whole;
#define JL_LANE(x, l) (x)
#define jl_each(x) (x) /* the number x in all lanes */
#define jl_pick(m, a, b) ((m) ? (a) : (b))
#define jl_only(m, a) ((m) ? (a) : 0.0)
#define jl_any(m) (m)
#define jl_root(x) sqrt(x)
#define jl_size_of(x) fabs(x)
#define jl_to_whole(x) ((int) (x))
#define jl_to_real(i) ((double) (i))
#else
typedef double jl_real __attribute__((vector_size(8 * JL_W)));
typedef double jl_loose
    __attribute__((vector_size(8 * JL_W), aligned(8), may_alias)); /* anywhere */
typedef long long jl_yes __attribute__((vector_size(8 * JL_W)));
typedef int jl_whole __attribute__((vector_size(4 * JL_W)));
#define JL_LANE(x, l) ((x)[l])
#define jl_to_whole(x) __builtin_convertvector(x, jl_whole)
#define jl_to_real(i) __builtin_convertvector(i, jl_real)
#ifdef __cplusplus /* "less zero" costs nothing: the compiler leaves it out */
#define jl_each(x) ((x) - jl_real())
#define jl_pick(m, a, b) ((m) ? jl_each(a) : jl_each(b))
#define jl_only(m, a) ((m) ? jl_each(a) : jl_real())
#else
#define jl_each(x) ((x) - (jl_real) {0})
#define jl_pick(m, a, b) jl_pick_lanes(m, jl_each(a), jl_each(b))
#define jl_only(m, a) jl_only_lanes(m, jl_each(a))
JL_IN jl_real jl_pick_lanes(jl_yes m, jl_real a, jl_real b)
{
  return (jl_real) ((m & (jl_yes) a) | (~m & (jl_yes) b));
}
JL_IN jl_real jl_only_lanes(jl_yes m, jl_real a) { return (jl_real) (m & (jl_yes) a); }
#endif
JL_IN jl_real jl_size_of(jl_real x) { return (jl_real) ((jl_yes) x & 0x7FFFFFFFFFFFFFFFLL); }

#if defined(__AVX512DQ__) && JL_W == 8
#include <immintrin.h>
JL_IN jl_real jl_root(jl_real x) { return (jl_real) _mm512_sqrt_pd((__m512d) x); }
JL_IN int jl_any(jl_yes m) { return _mm512_movepi64_mask((__m512i) m) != 0; }
#else
JL_IN jl_real jl_root(jl_real x)
{
  for (int l = 0; l < JL_W; l++) x[l] = sqrt(x[l]);
  return x;
}
JL_IN int jl_any(jl_yes m)
{
#if JL_W > 2 /* halves first */
  typedef long long half __attribute__((vector_size(4 * JL_W)));
  const union {
    jl_yes m;
    half h[2];
  } two = {m};
  const half all = two.h[0] | two.h[1];
  long long some = 0;
  for (int l = 0; l < JL_W / 2; l++) some |= all[l];
  return some != 0;
#else
  return (m[0] | m[1]) != 0;
#endif
}
#endif
#endif

JL_IN jl_real jl_larger(jl_real a, jl_real b) { return jl_pick(a > b, a, b); }
JL_IN jl_real jl_smaller(jl_real a, jl_real b) { return jl_pick(a < b, a, b); }

/* ------------------------------------------------------------------------------ tables */

/* Of a table of pieces, four coefficients each: those of piece i, per lane */
JL_IN void jl_fetch(const double *table, jl_whole i, jl_real c[4])
{
#if defined(__AVX512DQ__) && JL_W == 8 /* eight wide loads, turned by four times four */
  const double *p[8];
  for (int l = 0; l < 8; l++) p[l] = table + 4 * (size_t) (unsigned) i[l];
#define JL_TWO(a, b) \
  _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(p[a])), _mm256_loadu_pd(p[b]), 1)
  const __m512d r0 = JL_TWO(0, 4), r1 = JL_TWO(1, 5), r2 = JL_TWO(2, 6), r3 = JL_TWO(3, 7);
#undef JL_TWO
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
    jl_real of_lanes = jl_each(0.0);
    for (int l = 0; l < JL_W; l++) JL_LANE(of_lanes, l) = table[4 * JL_LANE(i, l) + j];
    c[j] = of_lanes;
  }
#endif
}

/* ------------------------------------------------------------------- facets and joints */

/* The numbers of a joint, or of the first of W joints side by side: row r is s[r stride]. Those of
 * the next joints lie `ahead`, and are fetched into the cache; 0 where there are none. JL_APART:
 * joints lie one after the other, `ahead` numbers apart. */
typedef struct {
  double *s;
  size_t stride, ahead;
} jl_numbers;
#ifdef JL_APART
#define JL_OF_LANE(n, l) ((n).s + (size_t) (l) * (n).ahead)
#else
#define JL_OF_LANE(n, l) ((n).s + (l))
#endif

#ifdef JLAW_ABREAST
typedef jl_real jl_of_facet;
typedef double jl_of_joint;
#define jl_somewhere(m) 1 /* whether a lane needs what follows; not asked here: asking costs more */
#define JL_TOGETHER JL_W  /* facets that are worked out together */
#define JL_JOINTS 1
#define JL_JOINT(x, l) (x)
#define jl_each_joint(x) (x)
#define jl_root_joint(x) sqrt(x)
/* A column of the tables of a block of facets, which lie side by side in it */
JL_IN jl_of_facet jl_column(const double *block, int c)
{
  return (jl_real) * (const jl_loose *) (block + c * JLAW_LANES);
}
/* A row of the state for each of these facets, `apart` from one another. There are `some` facets:
 * lanes beyond them, which have zeros in all tables, read the last one and write nothing. */
JL_IN jl_real jl_take(jl_numbers n, int row, int apart, int some)
{
  const int last = (some - 1) * apart;
#define JL_OF(l) n.s[(size_t) (row + ((l) < some ? (l) * apart : last)) * n.stride]
  const jl_real x = {JL_OF(0), JL_OF(1), JL_OF(2), JL_OF(3)};
#undef JL_OF
  return x;
}
JL_IN void jl_put(jl_numbers n, int row, int apart, int some, jl_real x)
{
  for (int l = 0; l < some; l++) n.s[(size_t) (row + l * apart) * n.stride] = x[l];
}
JL_IN double jl_take_joint(jl_numbers n, int row) { return n.s[(size_t) row * n.stride]; }
JL_IN void jl_put_joint(jl_numbers n, int row, double x) { n.s[(size_t) row * n.stride] = x; }
#else
typedef double jl_of_facet;
typedef jl_real jl_of_joint;
#define jl_somewhere(m) jl_any(m)
#define JL_TOGETHER 1
#define JL_JOINTS JL_W
#define JL_JOINT(x, l) JL_LANE(x, l)
#define jl_each_joint(x) jl_each(x)
#define jl_root_joint(x) jl_root(x)
JL_IN jl_of_facet jl_column(const double *block, int c) { return block[c * JLAW_LANES]; }
JL_IN jl_real jl_take_joint(jl_numbers n, int row)
{
#if JL_W == 1 || defined(JL_APART)
  jl_real x = jl_each(0.0);
  for (int l = 0; l < JL_W; l++) JL_LANE(x, l) = JL_OF_LANE(n, l)[(size_t) row * n.stride];
  return x;
#else
  const double *from = n.s + (size_t) row * n.stride;
  __builtin_prefetch(from + n.ahead, 1);
  return (jl_real) * (const jl_loose *) from;
#endif
}
JL_IN void jl_put_joint(jl_numbers n, int row, jl_real x)
{
#if JL_W == 1 || defined(JL_APART)
  for (int l = 0; l < JL_W; l++) JL_OF_LANE(n, l)[(size_t) row * n.stride] = JL_LANE(x, l);
#else
  *(jl_loose *) (n.s + (size_t) row * n.stride) = (jl_loose) x;
#endif
}
#define jl_take(n, row, apart, some) ((void) (apart), (void) (some), jl_take_joint(n, row))
#define jl_put(n, row, apart, some, x) ((void) (apart), (void) (some), jl_put_joint(n, row, x))
#endif

/* Facet i is added to sum i % 4, and the four sums in this order: the same bits for all lanes */
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define JL_SUMS 1 /* on a device one: an array would lie in its slow memory */
#define jl_total(sum, of) ((sum)[0].of)
#elif defined(JLAW_ABREAST)
#define JL_SUMS 1
#define jl_total(sum, of) (((sum)[0].of[0] + (sum)[0].of[2]) + ((sum)[0].of[1] + (sum)[0].of[3]))
#else
#define JL_SUMS 4
#define jl_total(sum, of) (((sum)[0].of + (sum)[2].of) + ((sum)[1].of + (sum)[3].of))
#endif
