/* lanes.h: W numbers side by side. The law (law.h) is written once, for lanes of three kinds:
 *
 *   W joints, W = 8, 4 or 2   a batch; vectors of the compilers gcc, g++, clang, clang++ and zig
 *   one joint, W = 1          plain C99: any compiler, CUDA (a thread is a joint), WebAssembly
 *   four facets of one joint  JLAW_ABREAST, W = 4: one joint at a time
 *
 * A real is a number per lane, a yes is a truth per lane. An of_facet is a number of a facet's
 * tables, an of_joint one of a joint: a double where all lanes share it, else a real. All kinds
 * give the same bits, for facets are added up in the same order: total().
 */
#ifndef W
#define W 1
#endif
#ifndef JLAW_FUNCTION
#define JLAW_FUNCTION /* for CUDA: __device__ */
#endif
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define IN static JLAW_FUNCTION __forceinline__
#elif defined(__GNUC__)
#define IN static inline __attribute__((always_inline))
#else
#define IN static inline
#endif

/* ------------------------------------------------------------------- numbers and truths */

#if W == 1
typedef double real;
typedef int yes, whole;
#define LANE(x, l) (x)
#define each(x) (x) /* the number x in all lanes */
#define pick(m, a, b) ((m) ? (a) : (b))
#define only(m, a) ((m) ? (a) : 0.0)
#define any(m) (m)
#define root(x) sqrt(x)
#define size_of(x) fabs(x)
#define to_whole(x) ((int) (x))
#define to_real(i) ((double) (i))
#else
typedef double real __attribute__((vector_size(8 * W)));
typedef double loose __attribute__((vector_size(8 * W), aligned(8), may_alias)); /* anywhere */
typedef long long yes __attribute__((vector_size(8 * W)));
typedef int whole __attribute__((vector_size(4 * W)));
#define LANE(x, l) ((x)[l])
#define to_whole(x) __builtin_convertvector(x, whole)
#define to_real(i) __builtin_convertvector(i, real)
#ifdef __cplusplus /* "less zero" costs nothing: the compiler leaves it out */
#define each(x) ((x) - real())
#define pick(m, a, b) ((m) ? each(a) : each(b))
#define only(m, a) ((m) ? each(a) : real())
#else
#define each(x) ((x) - (real){0})
#define pick(m, a, b) pick_lanes(m, each(a), each(b))
#define only(m, a) only_lanes(m, each(a))
IN real pick_lanes(yes m, real a, real b) { return (real) ((m & (yes) a) | (~m & (yes) b)); }
IN real only_lanes(yes m, real a) { return (real) (m & (yes) a); }
#endif
IN real size_of(real x) { return (real) ((yes) x & 0x7FFFFFFFFFFFFFFFLL); }

#if defined(__AVX512DQ__) && W == 8
#include <immintrin.h>
IN real root(real x) { return (real) _mm512_sqrt_pd((__m512d) x); }
IN int any(yes m) { return _mm512_movepi64_mask((__m512i) m) != 0; }
#elif defined(__AVX2__) && W == 4
#include <immintrin.h>
IN real root(real x) { return (real) _mm256_sqrt_pd((__m256d) x); }
IN int any(yes m) { return _mm256_movemask_pd((__m256d) m) != 0; }
#else
IN real root(real x)
{
  for (int l = 0; l < W; l++) x[l] = sqrt(x[l]);
  return x;
}
IN int any(yes m)
{
#if W > 2 /* halves first */
  typedef long long half __attribute__((vector_size(4 * W)));
  const union {
    yes m;
    half h[2];
  } two = {m};
  const half all = two.h[0] | two.h[1];
  long long some = 0;
  for (int l = 0; l < W / 2; l++) some |= all[l];
  return some != 0;
#else
  return (m[0] | m[1]) != 0;
#endif
}
#endif
#endif

IN real larger(real a, real b) { return pick(a > b, a, b); }
IN real smaller(real a, real b) { return pick(a < b, a, b); }

/* ------------------------------------------------------------------------------ tables */

/* Of a table of pieces, four coefficients each: those of piece i, per lane */
IN void fetch(const double *table, whole i, real c[4])
{
#if defined(__AVX512DQ__) && W == 8 /* eight wide loads, turned by four times four */
  const double *p[8];
  for (int l = 0; l < 8; l++) p[l] = table + 4 * (size_t) (unsigned) i[l];
#define TWO(a, b) \
  _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(p[a])), _mm256_loadu_pd(p[b]), 1)
  const __m512d r0 = TWO(0, 4), r1 = TWO(1, 5), r2 = TWO(2, 6), r3 = TWO(3, 7);
#undef TWO
  const __m512d even = _mm512_unpacklo_pd(r0, r1), odd = _mm512_unpackhi_pd(r0, r1);
  const __m512d even2 = _mm512_unpacklo_pd(r2, r3), odd2 = _mm512_unpackhi_pd(r2, r3);
  const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
  const __m512i high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
  c[0] = (real) _mm512_permutex2var_pd(even, low, even2);
  c[1] = (real) _mm512_permutex2var_pd(odd, low, odd2);
  c[2] = (real) _mm512_permutex2var_pd(even, high, even2);
  c[3] = (real) _mm512_permutex2var_pd(odd, high, odd2);
#elif defined(__AVX2__) && W == 4
  __m256d r[4];
  for (int l = 0; l < 4; l++) r[l] = _mm256_loadu_pd(table + 4 * (size_t) (unsigned) i[l]);
  const __m256d even = _mm256_unpacklo_pd(r[0], r[1]), odd = _mm256_unpackhi_pd(r[0], r[1]);
  const __m256d even2 = _mm256_unpacklo_pd(r[2], r[3]), odd2 = _mm256_unpackhi_pd(r[2], r[3]);
  c[0] = (real) _mm256_permute2f128_pd(even, even2, 0x20);
  c[1] = (real) _mm256_permute2f128_pd(odd, odd2, 0x20);
  c[2] = (real) _mm256_permute2f128_pd(even, even2, 0x31);
  c[3] = (real) _mm256_permute2f128_pd(odd, odd2, 0x31);
#else
  for (int j = 0; j < 4; j++) {
    real of_lanes = each(0.0);
    for (int l = 0; l < W; l++) LANE(of_lanes, l) = table[4 * LANE(i, l) + j];
    c[j] = of_lanes;
  }
#endif
}

/* ------------------------------------------------------------------- facets and joints */

/* The numbers of a joint, or of the first of W joints side by side: row r is s[r stride]. Those of
 * the next joints lie `ahead`, and are fetched into the cache; 0 where there are none. */
typedef struct {
  double *s;
  size_t stride, ahead;
} numbers;

#ifdef JLAW_ABREAST
typedef real of_facet;
typedef double of_joint;
#define somewhere(m) 1 /* whether a lane needs what follows; not asked here: asking costs more */
#define TOGETHER W     /* facets that are worked out together */
#define JOINTS 1
#define JOINT(x, l) (x)
#define each_joint(x) (x)
#define root_joint(x) sqrt(x)
/* A column of the tables of a block of facets, which lie side by side in it */
IN of_facet column(const double *block, int c)
{
  return (real) * (const loose *) (block + c * JLAW_LANES);
}
/* A row of the state for each of these facets, `apart` from one another. There are `some` facets:
 * lanes beyond them, which have zeros in all tables, read the last one and write nothing. */
IN real take(numbers n, int row, int apart, int some)
{
  const int last = (some - 1) * apart;
#define OF(l) n.s[(size_t) (row + ((l) < some ? (l) * apart : last)) * n.stride]
  const real x = {OF(0), OF(1), OF(2), OF(3)};
#undef OF
  return x;
}
IN void put(numbers n, int row, int apart, int some, real x)
{
  for (int l = 0; l < some; l++) n.s[(size_t) (row + l * apart) * n.stride] = x[l];
}
IN double take_joint(numbers n, int row) { return n.s[(size_t) row * n.stride]; }
IN void put_joint(numbers n, int row, double x) { n.s[(size_t) row * n.stride] = x; }
#else
typedef double of_facet;
typedef real of_joint;
#define somewhere(m) any(m)
#define TOGETHER 1
#define JOINTS W
#define JOINT(x, l) LANE(x, l)
#define each_joint(x) each(x)
#define root_joint(x) root(x)
IN of_facet column(const double *block, int c) { return block[c * JLAW_LANES]; }
IN real take_joint(numbers n, int row)
{
#if W == 1
  return n.s[(size_t) row * n.stride];
#else
  const double *from = n.s + (size_t) row * n.stride;
  __builtin_prefetch(from + n.ahead, 1);
  return (real) * (const loose *) from;
#endif
}
IN void put_joint(numbers n, int row, real x)
{
#if W == 1
  n.s[(size_t) row * n.stride] = x;
#else
  *(loose *) (n.s + (size_t) row * n.stride) = (loose) x;
#endif
}
#define take(n, row, apart, some) ((void) (apart), (void) (some), take_joint(n, row))
#define put(n, row, apart, some, x) ((void) (apart), (void) (some), put_joint(n, row, x))
#endif

/* Facet i is added to sum i % 4, and the four sums in this order: the same bits for all lanes */
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define SUMS 1 /* on a device one: an array would lie in its slow memory */
#define total(sum, of) ((sum)[0].of)
#elif defined(JLAW_ABREAST)
#define SUMS 1
#define total(sum, of) (((sum)[0].of[0] + (sum)[0].of[2]) + ((sum)[0].of[1] + (sum)[0].of[3]))
#else
#define SUMS 4
#define total(sum, of) (((sum)[0].of + (sum)[2].of) + ((sum)[1].of + (sum)[3].of))
#endif
