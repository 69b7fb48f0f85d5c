/* jointlaw.h: the law of a rough rock joint, complete, in C99 (also C++11 and later). MIT licence.
 *
 *     #define JOINTLAW_IMPLEMENTATION                  in one source file, before this line:
 *     #include "jointlaw.h"
 *
 *     char message[JLAW_MESSAGE];
 *     jlaw_law *law = jlaw_read("granite.jlaw", message, sizeof message);   `jointlaw export c`
 *     double state[162] = {0};                 jlaw_state_size(law) numbers; zeros: virgin, mated
 *     if (jlaw_update(law, state, state, d, F, NULL, message, sizeof message)) ... message tells
 *
 * Axes: 1 is the normal of the joint, 2 and 3 span it. d is the displacement in this step (m) of
 * one body into and along the other: closure first, then the jlaw_dim - 1 components of shear.
 * F is the traction (Pa), compression first: the force on the body that moves by +d is -area F.
 * C = dF/dd (Pa/m), row by row. Energies are per area (J/m2).
 *
 * A law does not change after reading: any number of threads may share it. States belong to the
 * caller; two threads must not advance one state at a time. No function but jlaw_read and jlaw_free
 * uses memory, files or the locale; none uses a global variable.
 *
 * Build with -ffp-contract=off: the same bits with every compiler and on every x86-64. For speed
 * -O3 -fno-math-errno -fno-trapping-math, which change no result; never -ffast-math.
 *
 * Symbols and order of the step are those of the page "theory-incremental" of the documentation
 * and of jointlaw/kernels/reference.py.
 */
#ifndef JOINTLAW_H
#define JOINTLAW_H
#ifndef __CUDACC_RTC__
#include <stddef.h>
#endif
#ifndef JLAW_FUNCTION
#define JLAW_FUNCTION /* before every function and table: __device__ for CUDA */
#endif
#ifdef __cplusplus
extern "C" {
#endif

#define JLAW_MESSAGE 300 /* bytes that hold every message */

typedef struct jlaw_law jlaw_law;

#ifndef JOINTLAW_NO_FILES
/* Read a table file. NULL and a message if it cannot be read, is damaged or of another version. */
jlaw_law *jlaw_read(const char *file, char *message, size_t size);
void jlaw_free(jlaw_law *law);
#endif

/* Components of d: 3, 2 in a plane, 1 for closure only; numbers of state, as in a snapshot */
JLAW_FUNCTION int jlaw_dim(const jlaw_law *law);
JLAW_FUNCTION int jlaw_state_size(const jlaw_law *law);

/* One step from state s0 to s1 (may be the same) by d (dim): F (dim), and C (dim, dim) if not NULL.
 * Returns 0; or -1 and a message where d or the state is not finite or forces would overflow:
 * nothing is written then. */
JLAW_FUNCTION int jlaw_update(const jlaw_law *law, const double *s0, double *s1, const double *d,
                              double *F, double *C, char *message, size_t size);

/* The start of a joint whose faces have never met, as blocks that meet anew after a fall: at first
 * touch, 100 mating lengths from the mated position along axis 2. Closure is counted from the mated
 * position: s[0] is then negative, and a host closes the joint from there on. Returns 0; or -1 for a
 * law with an infinite mating length, always mated: the state is then the virgin one. A bond of the
 * law is broken in either. */
JLAW_FUNCTION int jlaw_unmated(const jlaw_law *law, double *s);

/* The step of jlaw_update without a check, for hosts that know their steps and for devices: row i of
 * the state is s[i stride], so that joints may lie side by side, (rows, n). C may be NULL. */
JLAW_FUNCTION void jlaw_step(const jlaw_law *law, double *s, size_t stride, const double *d,
                             double *F, double *C);

/* Elastic energy, and energy lost since the virgin state, in J/m2 */
JLAW_FUNCTION double jlaw_stored(const jlaw_law *law, const double *s);
JLAW_FUNCTION double jlaw_dissipated(const jlaw_law *law, const double *s);
/* Shares from 0 to 1. sliding: of all facets, those at their friction limit; slipping: of the
 * friction capacity, what is at its limit; separated: of all facets, those out of touch. */
JLAW_FUNCTION void jlaw_shares(const jlaw_law *law, const double *s, double shares[3]);

/* Unsheared joint: normal stress (Pa) at a closure (m), and the inverse. NaN where there is none. */
JLAW_FUNCTION double jlaw_normal_stress(const jlaw_law *law, double closure);
JLAW_FUNCTION double jlaw_closure(const jlaw_law *law, double normal_stress);
/* Bound of |C| (Pa/m) while no facet is closed further: dt < 2 sqrt(mass/(area * this)). */
JLAW_FUNCTION double jlaw_max_stiffness(const jlaw_law *law, double closure);

/* The state in axes 2 and 3 that are turned by this angle (rad, from 2 to 3) about the normal. For a
 * host that cannot carry its axes with a body, and laws without a preferred direction (c = 0).
 * Shear turns exactly. Sliders and flattened depths are read between the azimuths of
 * their ring of facets: exact where the angle is a whole number of azimuths of every ring, else
 * the better the more there are. Sliders gain no energy; what they lose counts as dissipated. In a
 * plane the axis keeps or changes its sense. */
JLAW_FUNCTION void jlaw_rotate(const jlaw_law *law, double *s, double angle);
/* The state after the bodies changed their roles: axis 1 turned round, axis 2 kept, axis 3 turned
 * round with it. Shear along 2 changes its sign, along 3 not. Exact. */
JLAW_FUNCTION void jlaw_swap_bodies(const jlaw_law *law, double *s);

/* Of the law that the tables were made for: a Python state of another fingerprint does not fit. */
JLAW_FUNCTION const char *jlaw_fingerprint(const jlaw_law *law);

/* The tables, for files NAME.h; not for the host */
/* Made from layout.py by `python -m jointlaw.native`; change it there. */
#define JLAW_FORMAT 4 /* of table files */
enum {
  JLAW_LANES = 4, /* facets side by side in a block of the tables */
  JLAW_AZIMUTHS = 512, /* most */
  JLAW_M = 0, /* m = n/c1: y = m . (closure, offset) */
  JLAW_S = 3, /* in-facet direction s */
  JLAW_T = 6, /* in-facet direction t */
  JLAW_N = 9, /* normal n */
  JLAW_E = 12, /* unit vector of the azimuth */
  JLAW_STEEP = 14, /* tan(theta) */
  JLAW_COSINE = 15, /* c1 */
  JLAW_A = 16, /* A */
  JLAW_STIFF = 17, /* A/c1 */
  JLAW_STRENGTH = 18, /* mu lam A */
  JLAW_COMPLIANCE = 19, /* c1/(2 A lam): from |q|^2/kappa to energy */
  JLAW_POTENTIAL = 20, /* A c1 */
  JLAW_SHARE = 21, /* of all orientations */
  JLAW_YIELD = 22, /* y_p = d_y/c1 */
  JLAW_MIRROR = 23, /* the facet mirrored along axis 2 */
  JLAW_RING = 24, /* facets of this inclination, one after the other */
  JLAW_LATE = 25, /* unsheared joint: share, depth, share, depth of what yielding takes off */
  JLAW_COLUMNS = 29, /* of a facet */
  JLAW_LOW = 0, /* zeta at its begin */
  JLAW_FORCE = 1, /* Phi there */
  JLAW_SLOPE = 2, /* Phi' there */
  JLAW_HIGH = 3, /* zeta at its end */
  JLAW_G = 4, /* G there */
  JLAW_KAPPA = 5, /* kappa there */
  JLAW_ROWS = 6 /* of a depth cell */
};
#define JLAW_UNDERFLOW 1e-140
#define JLAW_TINY 1e-290
#define JLAW_FAINT 1e-150
#define JLAW_NEAR 1e-05
#define JLAW_LIMIT 1e-09
#define JLAW_ROUNDED 1e-12
#define JLAW_FAR 100.0
struct jlaw_law {
  int dim; /* components of a displacement */
  int facets; /* M */
  int cells; /* D, depth cells of a facet */
  int pieces; /* of the virgin curve */
  int yields; /* whether asperities yield */
  int fades; /* whether slopes fade with the distance from mate */
  int wears; /* whether slopes wear */
  int bonded; /* whether there is a bond */
  double soft; /* 1/lam */
  double mu; /* friction of asperities */
  double mating_length; /* m; infinite: the largest float */
  double slope_wear; /* J/m2; infinite: the largest float */
  double slope_residual; /* share of the slopes that never wears */
  double first_touch; /* m: closure at which an unmated joint touches */
  double eta; /* exponent of the virgin curve */
  double scale; /* V of the virgin curve, m^(1/2) */
  double rise; /* p: the curve is tabulated over w^p */
  double bond_normal; /* Pa/m: stiffness of the bond */
  double bond_shear; /* Pa/m */
  double opening_begin; /* 1/m: one over the opening where it begins to break */
  double slip_begin; /* 1/m: the same of slip */
  double opening_end; /* 1/m: where nothing of it is left */
  double slip_end; /* 1/m */
  double closure_factor; /* normal stress over Phi */
  double stiffness_factor; /* bound of |C| over Phi' */
  double bending_factor; /* what slopes that fade add to it, over Phi */
  double largest_reach; /* m: bound of |y| */
  double stretch; /* bound of |y| over that of the displacement */
  double farthest; /* m: largest closure that a stress is looked for in */
  const double *facet; /* (blocks, JLAW_COLUMNS, JLAW_LANES), zeros beyond the last facet */
  const double *depth; /* (blocks, cells, JLAW_ROWS, JLAW_LANES) */
  const double *curve; /* (pieces, 4): S of the virgin curve */
  const double *energy; /* (pieces, 4): T */
  double *own; /* what jlaw_free frees */
  char fingerprint[80];
};
/* Each number of a table file: its name, 1 if it is whole, its bounds */
#define JLAW_NUMBERS(X) \
  X(dim, 1, 1, 3) \
  X(facets, 1, 1, 1e6) \
  X(cells, 1, 1, 1e6) \
  X(pieces, 1, 1, 1e6) \
  X(yields, 1, 0, 1) \
  X(fades, 1, 0, 1) \
  X(wears, 1, 0, 1) \
  X(bonded, 1, 0, 1) \
  X(soft, 0, 0, DBL_MAX) \
  X(mu, 0, 0, DBL_MAX) \
  X(mating_length, 0, DBL_MIN, DBL_MAX) \
  X(slope_wear, 0, DBL_MIN, DBL_MAX) \
  X(slope_residual, 0, 0, 1) \
  X(first_touch, 0, -DBL_MAX, 0) \
  X(eta, 0, 0, DBL_MAX) \
  X(scale, 0, DBL_MIN, DBL_MAX) \
  X(rise, 0, 0, DBL_MAX) \
  X(bond_normal, 0, 0, DBL_MAX) \
  X(bond_shear, 0, 0, DBL_MAX) \
  X(opening_begin, 0, 0, DBL_MAX) \
  X(slip_begin, 0, 0, DBL_MAX) \
  X(opening_end, 0, 0, DBL_MAX) \
  X(slip_end, 0, 0, DBL_MAX) \
  X(closure_factor, 0, 0, DBL_MAX) \
  X(stiffness_factor, 0, 0, DBL_MAX) \
  X(bending_factor, 0, 0, DBL_MAX) \
  X(largest_reach, 0, 0, DBL_MAX) \
  X(stretch, 0, 1, DBL_MAX) \
  X(farthest, 0, 0, DBL_MAX)

#ifdef __cplusplus
}
#endif
#endif

#if defined(JOINTLAW_IMPLEMENTATION) && !defined(JOINTLAW_IMPLEMENTED)
#define JOINTLAW_IMPLEMENTED
#ifdef __FAST_MATH__
#error "jointlaw.h: -ffast-math breaks the tests for NaN; take -fno-math-errno -fno-trapping-math"
#endif
#ifdef __CUDACC_RTC__
#define DBL_MAX 1.7976931348623157e308
#ifndef NULL
#define NULL 0
#endif
#else
#include <float.h>
#include <math.h>
#include <string.h>
#ifndef JOINTLAW_NO_FILES
#include <stdio.h>
#include <stdlib.h>
#endif
#endif
#ifdef __cplusplus
extern "C" {
#endif
/* No fused operations here, whatever the flags */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__) && !defined(__CUDACC__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
#endif
#ifdef __GNUC__ /* all functions of vectors are inline; g++ would warn at the end of the file */
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

/* Four facets side by side in one vector, or (JOINTLAW_PLAIN, other compilers, CUDA) one after the
 * other with the same bits. AVX2 or AVX-512 where the machine has it, found out at run time. */
#if defined(__GNUC__) && !defined(JOINTLAW_PLAIN) && !defined(__CUDACC__) \
    && !defined(__CUDACC_RTC__)
#define JL_W_ 4
#define JLAW_ABREAST
#endif
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__OPTIMIZE__) && !defined(__AVX2__) \
    && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && defined(JLAW_ABREAST)
#define JLAW_CLONES __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define JLAW_CLONES
#endif

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
#ifndef JL_W_
#define JL_W_ 1
#endif
#ifndef JLAW_FUNCTION
#define JLAW_FUNCTION /* for CUDA: __device__ */
#endif
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define JL_IN_ static JLAW_FUNCTION __forceinline__
#elif defined(__GNUC__)
#define JL_IN_ static inline __attribute__((always_inline))
#else
#define JL_IN_ static inline
#endif

/* ------------------------------------------------------------------- numbers and truths */

#if JL_W_ == 1
typedef double jl_real_;
typedef int jl_yes_, jl_whole_;
#define JL_LANE_(x, l) (x)
#define jl_each_(x) (x) /* the number x in all lanes */
#define jl_pick_(m, a, b) ((m) ? (a) : (b))
#define jl_only_(m, a) ((m) ? (a) : 0.0)
#define jl_any_(m) (m)
#define jl_root_(x) sqrt(x)
#define jl_size_of_(x) fabs(x)
#define jl_to_whole_(x) ((int) (x))
#define jl_to_real_(i) ((double) (i))
#else
typedef double jl_real_ __attribute__((vector_size(8 * JL_W_)));
typedef double jl_loose_ __attribute__((vector_size(8 * JL_W_), aligned(8), may_alias)); /* anywhere */
typedef long long jl_yes_ __attribute__((vector_size(8 * JL_W_)));
typedef int jl_whole_ __attribute__((vector_size(4 * JL_W_)));
#define JL_LANE_(x, l) ((x)[l])
#define jl_to_whole_(x) __builtin_convertvector(x, jl_whole_)
#define jl_to_real_(i) __builtin_convertvector(i, jl_real_)
#ifdef __cplusplus /* "less zero" costs nothing: the compiler leaves it out */
#define jl_each_(x) ((x) - jl_real_())
#define jl_pick_(m, a, b) ((m) ? jl_each_(a) : jl_each_(b))
#define jl_only_(m, a) ((m) ? jl_each_(a) : jl_real_())
#else
#define jl_each_(x) ((x) - (jl_real_){0})
#define jl_pick_(m, a, b) jl_pick_lanes_(m, jl_each_(a), jl_each_(b))
#define jl_only_(m, a) jl_only_lanes_(m, jl_each_(a))
JL_IN_ jl_real_ jl_pick_lanes_(jl_yes_ m, jl_real_ a, jl_real_ b) { return (jl_real_) ((m & (jl_yes_) a) | (~m & (jl_yes_) b)); }
JL_IN_ jl_real_ jl_only_lanes_(jl_yes_ m, jl_real_ a) { return (jl_real_) (m & (jl_yes_) a); }
#endif
JL_IN_ jl_real_ jl_size_of_(jl_real_ x) { return (jl_real_) ((jl_yes_) x & 0x7FFFFFFFFFFFFFFFLL); }

#if defined(__AVX512DQ__) && JL_W_ == 8
#include <immintrin.h>
JL_IN_ jl_real_ jl_root_(jl_real_ x) { return (jl_real_) _mm512_sqrt_pd((__m512d) x); }
JL_IN_ int jl_any_(jl_yes_ m) { return _mm512_movepi64_mask((__m512i) m) != 0; }
#elif defined(__AVX2__) && JL_W_ == 4
#include <immintrin.h>
JL_IN_ jl_real_ jl_root_(jl_real_ x) { return (jl_real_) _mm256_sqrt_pd((__m256d) x); }
JL_IN_ int jl_any_(jl_yes_ m) { return _mm256_movemask_pd((__m256d) m) != 0; }
#else
JL_IN_ jl_real_ jl_root_(jl_real_ x)
{
  for (int l = 0; l < JL_W_; l++) x[l] = sqrt(x[l]);
  return x;
}
JL_IN_ int jl_any_(jl_yes_ m)
{
#if JL_W_ > 2 /* halves first */
  typedef long long half __attribute__((vector_size(4 * JL_W_)));
  const union {
    jl_yes_ m;
    half h[2];
  } two = {m};
  const half all = two.h[0] | two.h[1];
  long long some = 0;
  for (int l = 0; l < JL_W_ / 2; l++) some |= all[l];
  return some != 0;
#else
  return (m[0] | m[1]) != 0;
#endif
}
#endif
#endif

JL_IN_ jl_real_ jl_larger_(jl_real_ a, jl_real_ b) { return jl_pick_(a > b, a, b); }
JL_IN_ jl_real_ jl_smaller_(jl_real_ a, jl_real_ b) { return jl_pick_(a < b, a, b); }

/* ------------------------------------------------------------------------------ tables */

/* Of a table of pieces, four coefficients each: those of piece i, per lane */
JL_IN_ void jl_fetch_(const double *table, jl_whole_ i, jl_real_ c[4])
{
#if defined(__AVX512DQ__) && JL_W_ == 8 /* eight wide loads, turned by four times four */
  const double *p[8];
  for (int l = 0; l < 8; l++) p[l] = table + 4 * (size_t) (unsigned) i[l];
#define JL_TWO_(a, b) \
  _mm512_insertf64x4(_mm512_castpd256_pd512(_mm256_loadu_pd(p[a])), _mm256_loadu_pd(p[b]), 1)
  const __m512d r0 = JL_TWO_(0, 4), r1 = JL_TWO_(1, 5), r2 = JL_TWO_(2, 6), r3 = JL_TWO_(3, 7);
#undef JL_TWO_
  const __m512d even = _mm512_unpacklo_pd(r0, r1), odd = _mm512_unpackhi_pd(r0, r1);
  const __m512d even2 = _mm512_unpacklo_pd(r2, r3), odd2 = _mm512_unpackhi_pd(r2, r3);
  const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
  const __m512i high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
  c[0] = (jl_real_) _mm512_permutex2var_pd(even, low, even2);
  c[1] = (jl_real_) _mm512_permutex2var_pd(odd, low, odd2);
  c[2] = (jl_real_) _mm512_permutex2var_pd(even, high, even2);
  c[3] = (jl_real_) _mm512_permutex2var_pd(odd, high, odd2);
#elif defined(__AVX2__) && JL_W_ == 4
  __m256d r[4];
  for (int l = 0; l < 4; l++) r[l] = _mm256_loadu_pd(table + 4 * (size_t) (unsigned) i[l]);
  const __m256d even = _mm256_unpacklo_pd(r[0], r[1]), odd = _mm256_unpackhi_pd(r[0], r[1]);
  const __m256d even2 = _mm256_unpacklo_pd(r[2], r[3]), odd2 = _mm256_unpackhi_pd(r[2], r[3]);
  c[0] = (jl_real_) _mm256_permute2f128_pd(even, even2, 0x20);
  c[1] = (jl_real_) _mm256_permute2f128_pd(odd, odd2, 0x20);
  c[2] = (jl_real_) _mm256_permute2f128_pd(even, even2, 0x31);
  c[3] = (jl_real_) _mm256_permute2f128_pd(odd, odd2, 0x31);
#else
  for (int j = 0; j < 4; j++) {
    jl_real_ of_lanes = jl_each_(0.0);
    for (int l = 0; l < JL_W_; l++) JL_LANE_(of_lanes, l) = table[4 * JL_LANE_(i, l) + j];
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
} jl_numbers_;

#ifdef JLAW_ABREAST
typedef jl_real_ jl_of_facet_;
typedef double jl_of_joint_;
#define jl_somewhere_(m) 1 /* whether a lane needs what follows; not asked here: asking costs more */
#define JL_TOGETHER_ JL_W_     /* facets that are worked out together */
#define JL_JOINTS_ 1
#define JL_JOINT_(x, l) (x)
#define jl_each_joint_(x) (x)
#define jl_root_joint_(x) sqrt(x)
/* A column of the tables of a block of facets, which lie side by side in it */
JL_IN_ jl_of_facet_ jl_column_(const double *block, int c)
{
  return (jl_real_) * (const jl_loose_ *) (block + c * JLAW_LANES);
}
/* A row of the state for each of these facets, `apart` from one another. There are `some` facets:
 * lanes beyond them, which have zeros in all tables, read the last one and write nothing. */
JL_IN_ jl_real_ jl_take_(jl_numbers_ n, int row, int apart, int some)
{
  const int last = (some - 1) * apart;
#define JL_OF_(l) n.s[(size_t) (row + ((l) < some ? (l) * apart : last)) * n.stride]
  const jl_real_ x = {JL_OF_(0), JL_OF_(1), JL_OF_(2), JL_OF_(3)};
#undef JL_OF_
  return x;
}
JL_IN_ void jl_put_(jl_numbers_ n, int row, int apart, int some, jl_real_ x)
{
  for (int l = 0; l < some; l++) n.s[(size_t) (row + l * apart) * n.stride] = x[l];
}
JL_IN_ double jl_take_joint_(jl_numbers_ n, int row) { return n.s[(size_t) row * n.stride]; }
JL_IN_ void jl_put_joint_(jl_numbers_ n, int row, double x) { n.s[(size_t) row * n.stride] = x; }
#else
typedef double jl_of_facet_;
typedef jl_real_ jl_of_joint_;
#define jl_somewhere_(m) jl_any_(m)
#define JL_TOGETHER_ 1
#define JL_JOINTS_ JL_W_
#define JL_JOINT_(x, l) JL_LANE_(x, l)
#define jl_each_joint_(x) jl_each_(x)
#define jl_root_joint_(x) jl_root_(x)
JL_IN_ jl_of_facet_ jl_column_(const double *block, int c) { return block[c * JLAW_LANES]; }
JL_IN_ jl_real_ jl_take_joint_(jl_numbers_ n, int row)
{
#if JL_W_ == 1
  return n.s[(size_t) row * n.stride];
#else
  const double *from = n.s + (size_t) row * n.stride;
  __builtin_prefetch(from + n.ahead, 1);
  return (jl_real_) * (const jl_loose_ *) from;
#endif
}
JL_IN_ void jl_put_joint_(jl_numbers_ n, int row, jl_real_ x)
{
#if JL_W_ == 1
  n.s[(size_t) row * n.stride] = x;
#else
  *(jl_loose_ *) (n.s + (size_t) row * n.stride) = (jl_loose_) x;
#endif
}
#define jl_take_(n, row, apart, some) ((void) (apart), (void) (some), jl_take_joint_(n, row))
#define jl_put_(n, row, apart, some, x) ((void) (apart), (void) (some), jl_put_joint_(n, row, x))
#endif

/* Facet i is added to sum i % 4, and the four sums in this order: the same bits for all lanes */
#if defined(__CUDACC__) || defined(__CUDACC_RTC__)
#define JL_SUMS_ 1 /* on a device one: an array would lie in its slow memory */
#define jl_total_(sum, of) ((sum)[0].of)
#elif defined(JLAW_ABREAST)
#define JL_SUMS_ 1
#define jl_total_(sum, of) (((sum)[0].of[0] + (sum)[0].of[2]) + ((sum)[0].of[1] + (sum)[0].of[3]))
#else
#define JL_SUMS_ 4
#define jl_total_(sum, of) (((sum)[0].of + (sum)[2].of) + ((sum)[1].of + (sum)[3].of))
#endif
/* bond.h: the bond beside the asperities of one joint; symbols of kernels/bond.py */

typedef struct { /* displacement, damage; what the bond adds to traction, tangent and loss */
  double delta[3], damage, F[3], C[9], lost;
} jl_bonded_;

/* 1 where opening and slip, squared, are the strength at this damage; p2: 1/half-axis, squared */
JL_IN_ double jl_beyond_(const jlaw_law *law, double opening2, double slip2, double damage, double p2[2])
{
  const double p = law->opening_begin - damage * (law->opening_begin - law->opening_end);
  const double q = law->slip_begin - damage * (law->slip_begin - law->slip_end);
  p2[0] = p * p, p2[1] = q * q;
  return opening2 * p2[0] + slip2 * p2[1];
}

/* Damage that opening and slip ask for: the smaller root of the quadratic; half the slope there */
JL_IN_ double jl_damage_at_(const jlaw_law *law, double opening2, double slip2, double *slope)
{
  const double begin0 = law->opening_begin, soft0 = begin0 - law->opening_end;
  const double begin1 = law->slip_begin, soft1 = begin1 - law->slip_end;
  const double turn = begin1 * law->opening_end - begin0 * law->slip_end;
  const double inside =
      opening2 * (soft0 * soft0) + slip2 * (soft1 * soft1) - opening2 * slip2 * (turn * turn);
  double p2[2];
  const double over = jl_beyond_(law, opening2, slip2, 0.0, p2) - 1.0;
  *slope = sqrt(inside > 0.0 ? inside : 0.0);
  if (!(over > 0.0)) return 0.0;
  if (!(jl_beyond_(law, opening2, slip2, 1.0, p2) < 1.0)) return 1.0;
  const double found = over / (opening2 * (begin0 * soft0) + slip2 * (begin1 * soft1) + *slope);
  return found < 1.0 ? found : 1.0;
}

/* A bond that has moved to b->delta, with its damage before; returns its stored energy */
JL_IN_ double jl_hold_(const jlaw_law *law, jl_bonded_ *b)
{
  const double K[2] = {law->bond_normal, law->bond_shear}, old = b->damage;
  const double u[3] = {b->delta[0] < 0.0 ? b->delta[0] : 0.0, b->delta[1], b->delta[2]};
  const double opening2 = u[0] * u[0], slip2 = u[1] * u[1] + u[2] * u[2];
  const double jl_psi_ = 0.5 * (K[0] * opening2 + K[1] * slip2);
  double p2[2], slope;
  const double found = jl_damage_at_(law, opening2, slip2, &slope);
  const double now = b->damage = found > old ? found : old;
  const int softens = found > old && now < 1.0;
  const double first = jl_beyond_(law, opening2, slip2, old, p2);
  const double there = jl_beyond_(law, opening2, slip2, now, p2), last = softens ? 1.0 : there;
  b->lost = found > old ? (now - old) * jl_psi_ / sqrt(first * last) : 0.0;
  for (int i = 0; i < 3; i++) {
    b->F[i] = (1.0 - now) * K[i > 0] * u[i];
    for (int j = 0; j < 3; j++)
      b->C[3 * i + j] = softens ? -(K[i > 0] * u[i]) * (u[j] * p2[j > 0] / slope) : 0.0;
    if (i || u[0] < 0.0) b->C[4 * i] += (1.0 - now) * K[i > 0];
  }
  return (1.0 - now) * jl_psi_;
}

/* The bond in a state after a step: adds what it bears, where F is given; returns its stored energy.
 * Its damage is in this row of the state. */
JL_IN_ jl_of_joint_ jl_step_bond_(const jlaw_law *law, jl_numbers_ n, int row, jl_of_joint_ F[3], jl_of_joint_ C[9],
                      int tangent, int ledger)
{
  const int dim = law->dim;
  jl_of_joint_ stored = jl_each_joint_(0.0);
  for (int l = 0; l < JL_JOINTS_; l++) {
    double *s = n.s + l;
    jl_bonded_ b = {{0.0}, s[(size_t) row * n.stride], {0.0}, {0.0}, 0.0};
    for (int i = 0; i < dim; i++) b.delta[i] = s[(size_t) i * n.stride];
    JL_JOINT_(stored, l) = jl_hold_(law, &b);
    if (!F) continue;
    s[(size_t) row * n.stride] = b.damage;
    if (ledger) s[(size_t) dim * n.stride] += b.lost;
    for (int i = 0; i < dim; i++) JL_JOINT_(F[i], l) += b.F[i];
    for (int i = 0; tangent && i < dim * dim; i++) JL_JOINT_(C[i], l) += b.C[i / dim * 3 + i % dim];
  }
  return stored;
}
/* law.h: one step of a rock joint, and what a state amounts to, in lanes (lanes.h).
 *
 * Symbols and order are those of docs/theory-incremental.md and of kernels/reference.py. Rows of
 * a state: delta (dim) from the mated position | dissipated energy | q_s (M D) | q_t (M D), q times
 * lam; where asperities yield flattened depth (M) | plastic work; with wear the share of the slopes
 * that is gone | work of friction; with a bond its damage. A batch keeps beside them Phi and Phi' of
 * every facet (M each), which saves half the look-ups, and with yielding the same at that depth.
 *
 * The last digit of expm1 and pow depends on the C library, that of all else here does not. exp and
 * log are avoided: zig links its own, which differ from those of the system. */

typedef struct { /* constants of a step: the compiler leaves out what they exclude */
  int dim, yields, fades, wears, ledger, tangent;
  int kept; /* whether Phi and Phi' lie beside the state */
} jl_kind_;

typedef struct { /* in the plane of a joint: o, offset over the mating length; w^2 = 1 - |o|^2 */
  jl_of_joint_ o[2], w;
} jl_site_;

typedef struct {                 /* a joint in a step */
  jl_of_joint_ p[3], from[3], to[3]; /* increment; closure and in-plane displacement before and after */
  jl_site_ start, middle, end;
  jl_of_joint_ had, has; /* share of the slopes that was left before the step, and is in it */
} jl_motion_;

typedef struct { /* the plane of facets: slope along the azimuth e and across it, in axes (1, e) */
  jl_real_ x, z;     /* offset over the mating length along e and across */
  jl_real_ along, across;
  jl_real_ m2, N2, rm, rmn; /* 1 + along^2, that + across^2; 1/m, 1/(m N) */
  jl_real_ gamma;           /* c1 N */
} jl_plane_;

typedef struct { /* facets in a step: y, Phi, Phi', Phi'' before and after; de */
  jl_real_ y0, y1, f0, f1, k0, k1, bend, es, et;
  jl_plane_ middle, end;
  jl_real_ yw, fw, kw, limit2, worn;   /* before wear: y, Phi, Phi'; after it: (q/G)^2 at most; loss */
  jl_real_ d0, de, dz;                 /* increment: closure, along the azimuth and across it */
  jl_real_ dy, rdy;                    /* y1 - y0, and 1 over it */
  jl_yes_ near;                        /* y has hardly changed */
  jl_real_ z0, z1, fz0, fz1, kz0, kz1; /* flattened depth; Phi and Phi' there */
  jl_real_ qs, qt, lost, vs, vt, bss, bst, btt; /* sums over the cells: q, loss, v and B of C */
  jl_real_ ws, wt, open;                        /* v of the softening by z1; sum of kappa */
  jl_real_ gs, gt, strength;                    /* derivative of q by log(gamma); mu lam A gamma */
} jl_facets_;

typedef struct {             /* the sliders of one depth cell of facets */
  jl_real_ G0, G1, k0, k1, kz1;  /* G and kappa before and after; kappa at z1 */
  jl_real_ gained;               /* what G grows by, before springs yield at the new y */
  jl_real_ strength, cap, chord; /* mu lam A; friction limit; of G over the step */
  jl_real_ ts, tt, unit, share;  /* trial force, 1 over its size, cap over its size or 1 */
  jl_real_ old2, new2;           /* squares of q before and of the trial force */
  jl_yes_ slips;
} jl_sliders_;

typedef struct { /* what facets add up to */
  jl_real_ F[3], C[9], lost;
  jl_real_ crushed, lowered, worn; /* plastic work; what the wear of slopes takes: normal, sliders */
} jl_sums_;

/* Rows of a state: first of the sliders, first after them, worn slopes, damage; number of rows */
JL_IN_ int jl_slider_row_(const jlaw_law *law) { return law->dim + 1; }
JL_IN_ int jl_rest_row_(const jlaw_law *law) { return law->dim + 1 + 2 * law->facets * law->cells; }
JL_IN_ int jl_worn_row_(const jlaw_law *law) { return jl_rest_row_(law) + (law->yields ? law->facets + 1 : 0); }
JL_IN_ int jl_damage_row_(const jlaw_law *law) { return jl_worn_row_(law) + 2 * law->wears; }
JL_IN_ int jl_state_rows_(const jlaw_law *law) { return jl_damage_row_(law) + law->bonded; }

/* Tables of facets from number `at` on, and of their first depth cell */
JL_IN_ const double *jl_facet_of_(const jlaw_law *law, int at)
{
  const int lane = at % JLAW_LANES;
  return law->facet + (size_t) (at - lane) * JLAW_COLUMNS + lane;
}
JL_IN_ const double *jl_cell_of_(const jlaw_law *law, int at)
{
  const int lane = at % JLAW_LANES;
  return law->depth + (size_t) (at - lane) * (size_t) law->cells * JLAW_ROWS + lane;
}

/* ------------------------------------------------------------------- the virgin curve */

/* Effective closures below it count as zero: powers and squares of them underflow */
JL_IN_ jl_real_ jl_resolved_(jl_real_ y) { return jl_only_(jl_size_of_(y) >= JLAW_UNDERFLOW, y); }

typedef struct { /* in the tables of the virgin curve: sqrt(y), and the place x in piece i */
  jl_real_ y, v, r, x;
  jl_whole_ i;
} jl_spot_;

JL_IN_ jl_spot_ jl_spot_of_(const jlaw_law *law, jl_real_ y)
{
  const double pieces = law->pieces;
  jl_spot_ at;
  at.y = jl_only_(y > 0.0, y);
  at.v = jl_root_(at.y);
  at.r = 1.0 / (at.v + law->scale);
  at.x = at.v * at.r * pieces;
  at.i = jl_to_whole_(jl_smaller_(at.x, jl_each_(pieces - 1.0)));
  at.x = at.x - jl_to_real_(at.i);
  return at;
}

/* x^p, zero at x = 0 */
JL_IN_ jl_real_ jl_raised_(jl_real_ x, double p)
{
  for (int l = 0; l < JL_W_; l++) JL_LANE_(x, l) = JL_LANE_(x, l) > 0.0 ? pow(JL_LANE_(x, l), p) : 0.0;
  return x;
}

/* y^eta, zero at y = 0 */
JL_IN_ jl_real_ jl_power_of_(const jlaw_law *law, const jl_spot_ *at)
{
  if (law->eta == 0.0) return jl_only_(at->y > 0.0, jl_each_(1.0));
  return law->eta == 0.5 ? at->v : jl_raised_(at->y, law->eta);
}

/* Phi and Phi' at y, and Phi'' if asked for; zero where y <= 0 */
JL_IN_ void jl_virgin_curve_(const jlaw_law *law, jl_real_ y, jl_real_ *force, jl_real_ *slope, jl_real_ *bend)
{
  const double n = law->pieces, eta = law->eta;
  const jl_spot_ at = jl_spot_of_(law, y);
  const jl_real_ x = at.x, ts = at.v * at.r * at.r * law->scale; /* t (1 - t) */
  jl_real_ c[4];
  jl_fetch_(law->curve, at.i, c);
  jl_real_ S = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
  jl_real_ DS = 0.5 * n * ts * (c[1] + x * (2.0 * c[2] + x * (3.0 * c[3])));
  jl_real_ DDS = jl_each_(0.0);
  if (bend)
    DDS = 0.25 * n * n * ts * ts * (2.0 * c[2] + x * (6.0 * c[3]))
          + 0.5 * (law->scale - at.v) * at.r * DS;
  if (law->rise > 0.0) {
    const jl_real_ w = at.y / (at.y + law->scale * law->scale), more = law->rise * (1.0 - w);
    const jl_real_ up = jl_raised_(w, law->rise); /* the curve is tabulated over w^rise */
    DDS = up * (DDS + 2.0 * more * DS + more * (more - w) * S);
    DS = up * (DS + more * S);
    S = up * S;
  }
  const jl_real_ power = jl_power_of_(law, &at);
  *force = power * at.y * S;
  *slope = power * ((1.0 + eta) * S + DS);
  if (bend)
    *bend = power / jl_pick_(y > 0.0, y, 1.0) * (eta * (1.0 + eta) * S + (1.0 + 2.0 * eta) * DS + DDS);
}

/* Psi, the integral of Phi, at y */
JL_IN_ jl_real_ jl_psi_(const jlaw_law *law, jl_real_ y)
{
  const jl_spot_ at = jl_spot_of_(law, y);
  jl_real_ c[4];
  jl_fetch_(law->energy, at.i, c);
  jl_real_ T = c[0] + at.x * (c[1] + at.x * (c[2] + at.x * c[3]));
  if (law->rise > 0.0) T = T * jl_raised_(at.y / (at.y + law->scale * law->scale), law->rise);
  return jl_power_of_(law, &at) * at.y * at.y * T;
}

/* Share G of a depth cell in Phi at y, and its slope kappa */
JL_IN_ void jl_share_of_(const double *cell, jl_real_ y, jl_real_ force, jl_real_ slope, jl_real_ *G, jl_real_ *kappa)
{
  const jl_real_ low = y - jl_column_(cell, JLAW_LOW), high = y - jl_column_(cell, JLAW_HIGH);
  const jl_of_facet_ end = jl_column_(cell, JLAW_KAPPA);
  const jl_real_ k = jl_pick_(high > 0.0, end, slope - jl_column_(cell, JLAW_SLOPE));
  const jl_real_ g = jl_pick_(high > 0.0, jl_column_(cell, JLAW_G) + end * high,
                      force - jl_column_(cell, JLAW_FORCE) - jl_column_(cell, JLAW_SLOPE) * low);
  *kappa = jl_only_(low > 0.0, jl_larger_(k, jl_each_(0.0)));
  *G = jl_larger_(jl_smaller_(g, *kappa * low), jl_each_(0.0));
}

/* -------------------------------------------------------------- asperities that yield */

/* G and kappa of a cell, less H, its G at the flattened depth z: "Yielding" */
JL_IN_ void jl_flatten_(jl_real_ y, jl_real_ z, jl_real_ H, jl_real_ *G, jl_real_ *kappa)
{
  const jl_real_ over = y - z;
  *kappa = jl_only_(over > 0.0, *kappa);
  *G = jl_larger_(jl_smaller_(*G - H, *kappa * over), jl_each_(0.0));
}

/* G and kappa of a cell at y, of facets with the flattened depth z */
JL_IN_ void jl_hold_cell_(const double *cell, jl_real_ y, jl_real_ f, jl_real_ k, jl_real_ z, jl_real_ fz, jl_real_ kz, int yields,
                  jl_real_ *G, jl_real_ *kappa)
{
  jl_real_ H, less;
  jl_share_of_(cell, y, f, k, G, kappa);
  if (!yields) return;
  jl_share_of_(cell, z, fz, kz, &H, &less);
  jl_flatten_(y, z, H, G, kappa);
}

/* Phi less its value at the flattened depth */
JL_IN_ void jl_flatten_facets_(jl_real_ y, jl_real_ z, jl_real_ less, jl_real_ *force, jl_real_ *slope)
{
  *force = jl_only_(y > z, jl_larger_(*force - less, jl_each_(0.0)));
  *slope = jl_only_(y > z, *slope);
}

/* Flattened depths of facets, before and after the step, and the virgin curve there */
JL_IN_ void jl_press_(const jlaw_law *law, const double *f, jl_numbers_ n, int kept, int at, int some,
              const jl_motion_ *m, jl_facets_ *o)
{
  const int M = law->facets, depth = jl_rest_row_(law);
  jl_real_ y = o->y1;
  if (law->fades) /* one depth for a facet and its opposite */
    y = jl_larger_(y, 2.0 * jl_column_(f, JLAW_M) * m->to[0] - y);
  o->z0 = jl_take_(n, depth + at, 1, some);
  o->z1 = jl_larger_(y - jl_column_(f, JLAW_YIELD), o->z0);
  if (kept) {
    o->fz0 = jl_take_(n, kept + 2 * M + at, 1, some);
    o->kz0 = jl_take_(n, kept + 3 * M + at, 1, some);
  } else jl_virgin_curve_(law, o->z0, &o->fz0, &o->kz0, (jl_real_ *) 0);
  o->fz1 = o->fz0, o->kz1 = o->kz0;
  if (!jl_any_(o->z1 > o->z0)) return;
  jl_virgin_curve_(law, o->z1, &o->fz1, &o->kz1, (jl_real_ *) 0);
  jl_put_(n, depth + at, 1, some, o->z1);
  if (kept) {
    jl_put_(n, kept + 2 * M + at, 1, some, o->fz1);
    jl_put_(n, kept + 3 * M + at, 1, some, o->kz1);
  }
}

/* Whether facets flatten themselves; else the opposite one does. Both do, but for rounding, where
 * the shear does not move them, as at a right angle to it. */
JL_IN_ jl_yes_ jl_flattens_itself_(const double *f, const jl_facets_ *o)
{
  return o->y1 - jl_column_(f, JLAW_YIELD) >= o->z1 - JLAW_ROUNDED * jl_size_of_(o->y1);
}

/* Plastic work of facets over A c1: exact where they press themselves flat, else by the mean */
JL_IN_ jl_real_ jl_crush_(const double *f, const jl_facets_ *o)
{
  const jl_of_facet_ most = jl_column_(f, JLAW_YIELD);
  const jl_real_ c0 = jl_smaller_(jl_larger_(o->y0 - o->z0, jl_each_(0.0)), jl_each_(most));
  const jl_real_ c1 = jl_smaller_(jl_larger_(o->y1 - o->z1, jl_each_(0.0)), jl_each_(most));
  return jl_pick_(jl_flattens_itself_(f, o), jl_each_(most), 0.5 * (c0 + c1)) * (o->fz1 - o->fz0);
}

/* --------------------------------------------------------------------- slopes that fade */

/* Offset, over the mating length, at the in-plane displacement p0, p1: "Mating" */
JL_IN_ jl_site_ jl_site_of_(const jlaw_law *law, jl_of_joint_ p0, jl_of_joint_ p1)
{
  jl_site_ at;
  p0 = p0 / law->mating_length;
  p1 = p1 / law->mating_length;
  at.w = 1.0 / jl_root_joint_(1.0 + (p0 * p0 + p1 * p1));
  at.o[0] = at.w * p0;
  at.o[1] = at.w * p1;
  return at;
}

/* Effective closure of facets at this closure, where this share of the slopes is left */
JL_IN_ jl_real_ jl_climb_(const jlaw_law *law, const double *f, jl_of_joint_ closure, const jl_site_ *at,
              jl_of_joint_ slopes)
{
  const jl_real_ rise = jl_column_(f, JLAW_M + 1) * at->o[0] + jl_column_(f, JLAW_M + 2) * at->o[1];
  return closure + slopes * law->mating_length * rise;
}

JL_IN_ jl_plane_ jl_plane_at_(const double *f, const jl_site_ *at, jl_of_joint_ slopes)
{
  jl_plane_ s;
  s.x = jl_column_(f, JLAW_E) * at->o[0] + jl_column_(f, JLAW_E + 1) * at->o[1];
  s.z = jl_column_(f, JLAW_E) * at->o[1] - jl_column_(f, JLAW_E + 1) * at->o[0];
  const jl_real_ steep = slopes * at->w * jl_column_(f, JLAW_STEEP);
  s.along = steep * (1.0 - s.x * s.x);
  s.across = -steep * s.x * s.z;
  s.m2 = 1.0 + s.along * s.along;
  s.N2 = s.m2 + s.across * s.across;
  const jl_real_ m = jl_root_(s.m2), N = jl_root_(s.N2);
  s.rmn = 1.0 / (m * N);
  s.rm = N * s.rmn;
  s.gamma = jl_column_(f, JLAW_COSINE) * N;
  return s;
}

/* Components of a vector along e and across it, in the axes of the joint */
JL_IN_ void jl_to_axes_(const double *f, jl_real_ *along, jl_real_ *across)
{
  const jl_real_ v1 = jl_column_(f, JLAW_E) * *along - jl_column_(f, JLAW_E + 1) * *across;
  *across = jl_column_(f, JLAW_E + 1) * *along + jl_column_(f, JLAW_E) * *across;
  *along = v1;
}

/* Derivative of the slopes by the displacement, both along the azimuth and across: ee, ez, zz */
JL_IN_ void jl_curvature_(const jlaw_law *law, const double *f, const jl_plane_ *s, jl_of_joint_ w, jl_of_joint_ slopes,
                  jl_real_ h[3])
{
  const jl_real_ bend = -(slopes * w * w / law->mating_length) * jl_column_(f, JLAW_STEEP);
  h[0] = bend * (3.0 * s->x * (1.0 - s->x * s->x));
  h[1] = bend * (s->z * (1.0 - 3.0 * s->x * s->x));
  h[2] = bend * (s->x * (1.0 - 3.0 * s->z * s->z));
}

/* The increment in the plane of facets at mid-step */
JL_IN_ void jl_move_in_plane_(const double *f, const jl_motion_ *m, jl_facets_ *o)
{
  const jl_plane_ *s = &o->middle;
  const jl_real_ p1 = jl_each_(0.0) + m->p[1], p2 = jl_each_(0.0) + m->p[2];
  o->d0 = jl_each_(0.0) + m->p[0];
  o->de = jl_column_(f, JLAW_E) * p1 + jl_column_(f, JLAW_E + 1) * p2;
  o->dz = jl_column_(f, JLAW_E) * p2 - jl_column_(f, JLAW_E + 1) * p1;
  o->es = (o->de - s->along * o->d0) * s->rm;
  o->et = (s->m2 * o->dz - s->across * (o->d0 + s->along * o->de)) * s->rmn;
}

/* F of facets that fade: A Phi n and the sliders, in axes (1, e), then in those of the joint */
JL_IN_ void jl_add_traction_(const jlaw_law *law, const double *f, const jl_facets_ *o, jl_sums_ *sum, int dim)
{
  const jl_plane_ *s = &o->end;
  const jl_real_ n = jl_column_(f, JLAW_POTENTIAL) * o->f1;
  const jl_real_ qs = law->soft * s->rm * o->qs, qt = law->soft * s->rmn * o->qt;
  jl_real_ along = n * s->along + (qs - s->along * s->across * qt);
  jl_real_ across = n * s->across + s->m2 * qt;
  jl_to_axes_(f, &along, &across);
  sum->F[0] += n - (s->along * qs + s->across * qt);
  if (dim > 1) sum->F[1] += along;
  if (dim > 2) sum->F[2] += across;
}

/* ------------------------------------------------------------------------------- wear */

/* Shares of the slopes that were left before the step, and are after the work of friction so far */
JL_IN_ void jl_wear_slopes_(const jlaw_law *law, jl_numbers_ n, jl_motion_ *m)
{
  const int row = jl_worn_row_(law);
  jl_of_joint_ worn = jl_take_joint_(n, row);
  const jl_of_joint_ work = jl_take_joint_(n, row + 1);
  m->had = 1.0 - worn;
  for (int l = 0; l < JL_JOINTS_; l++) {
    const double now = (law->slope_residual - 1.0) * expm1(-JL_JOINT_(work, l) / law->slope_wear);
    JL_JOINT_(worn, l) = now > JL_JOINT_(worn, l) ? now : JL_JOINT_(worn, l);
  }
  m->has = 1.0 - worn;
  jl_put_joint_(n, row, worn);
}

/* Slopes have worn: springs that part take their force along, and friction limits the rest. One
 * division for all: stiffnesses and forces below 1e-75 count as none. */
JL_IN_ void jl_wear_sliders_(const double *cell, jl_facets_ *o, const jl_sliders_ *c, jl_real_ *qs, jl_real_ *qt, jl_kind_ k)
{
  jl_real_ G, kappa;
  jl_hold_cell_(cell, o->yw, o->fw, o->kw, o->z0, o->fz0, o->kz0, k.yields, &G, &kappa);
  const jl_real_ q2 = *qs * *qs + *qt * *qt, cap2 = o->limit2 * (c->G0 * c->G0);
  const jl_yes_ had = kappa * kappa > JLAW_FAINT, has = c->k0 * c->k0 > JLAW_FAINT;
  const jl_real_ a = jl_pick_(had, kappa, 1.0), b = jl_pick_(has, c->k0, 1.0);
  const jl_real_ Q = jl_pick_(q2 > JLAW_FAINT, q2, 1.0);
  const jl_real_ r = 1.0 / (a * b * Q), was = jl_only_(had, b * Q * r), is = jl_only_(has, a * Q * r);
  jl_real_ share = jl_pick_(kappa > c->k0, c->k0 * was, 1.0);
  const jl_yes_ jl_beyond_ = share * share * q2 > cap2;
  if (jl_somewhere_(jl_beyond_)) share = jl_pick_(jl_beyond_, jl_root_(cap2 * (a * b * r)), share);
  o->worn += q2 * (was - share * share * is);
  *qs = share * *qs;
  *qt = share * *qt;
}

/* --------------------------------------------------------------------------- one step */

/* G and kappa of a cell before and after the step. What G gains is taken from the virgin curve: the
 * bounds of `flatten` would show in it where that curve is small and hardly convex. */
JL_IN_ void jl_cells_of_(const double *cell, const jl_facets_ *o, jl_sliders_ *c, int yields)
{
  jl_share_of_(cell, o->y0, o->f0, o->k0, &c->G0, &c->k0);
  jl_share_of_(cell, o->y1, o->f1, o->k1, &c->G1, &c->k1);
  c->gained = c->G1 - c->G0;
  c->kz1 = jl_each_(0.0);
  if (!yields) return;
  jl_real_ H0, H1, kz0;
  jl_share_of_(cell, o->z0, o->fz0, o->kz0, &H0, &kz0);
  jl_share_of_(cell, o->z1, o->fz1, o->kz1, &H1, &c->kz1);
  c->gained = c->G1 - jl_larger_(c->G0, H0);
  jl_flatten_(o->y0, o->z0, H0, &c->G0, &c->k0);
  jl_flatten_(o->y1, o->z1, H1, &c->G1, &c->k1);
}

/* Trial force: loaded by the chord of G where kappa grows; where kappa falls, the springs that part
 * take their force along. Then the friction limit, |q| <= mu lam A G. */
JL_IN_ void jl_load_(const double *f, const jl_facets_ *o, jl_sliders_ *c, jl_real_ *qs, jl_real_ *qt, jl_kind_ k)
{
  jl_yes_ near = o->near;
  if (k.yields) near = near & ((c->k0 > 0.0) | (c->k1 <= 0.0)); /* flattened ones touch together */
  const jl_real_ mean = jl_pick_(near, 0.5 * (c->k0 + c->k1), c->gained * o->rdy);
  c->chord = jl_smaller_(jl_larger_(mean, c->k0), c->k1); /* k1 where it falls */
  c->old2 = *qs * *qs + *qt * *qt;
  const jl_yes_ falls = c->k1 < c->k0;
  if (jl_somewhere_(falls)) {
    const jl_real_ kept = jl_pick_(falls, c->k1 / jl_pick_(falls, c->k0, 1.0), 1.0);
    *qs = *qs * kept;
    *qt = *qt * kept;
  }
  const jl_real_ add = jl_column_(f, JLAW_STIFF) * c->chord;
  c->ts = *qs + add * o->es;
  c->tt = *qt + add * o->et;
  c->new2 = c->ts * c->ts + c->tt * c->tt;
  c->cap = c->strength * c->G1;
  c->slips = c->new2 > c->cap * c->cap;
  c->unit = jl_each_(0.0);
  c->share = jl_each_(1.0);
  if (k.tangent || jl_somewhere_(c->slips)) {
    c->unit = jl_only_(c->new2 > JLAW_TINY, 1.0 / jl_root_(c->new2));
    c->share = jl_pick_(c->slips, jl_smaller_(c->cap * c->unit, jl_each_(1.0)), 1.0);
  }
  const jl_real_ part = jl_only_(c->new2 > JLAW_TINY, c->share); /* squares of smaller forces underflow */
  *qs = part * c->ts;
  *qt = part * c->tt;
}

/* What sliders, and springs that part under shear, lose: every term is >= 0 as written */
JL_IN_ jl_real_ jl_friction_loss_(const jl_sliders_ *c)
{
  const jl_real_ high = jl_larger_(c->chord, c->k0), low = jl_smaller_(c->k0, c->k1);
  const jl_real_ a = c->k0 * high, b = c->k1 * c->chord;
  const jl_real_ A = jl_pick_(a > JLAW_FAINT, a, 1.0), B = jl_pick_(b > JLAW_FAINT, b, 1.0);
  const jl_real_ r = 1.0 / (A * B); /* one division for both */
  const jl_real_ rub = c->k1 - c->chord + 2.0 * c->share * (1.0 - c->share) * c->chord;
  return jl_only_(a > JLAW_FAINT, c->old2 * ((high - low) * (B * r)))
         + jl_only_(b > JLAW_FAINT, c->new2 * (rub * (A * r)));
}

/* "The tangent": J_q = beta (I - s s^T) E + v g^T of sliders */
JL_IN_ void jl_slide_tangent_(const double *f, const double *cell, const jl_sliders_ *c, jl_facets_ *o, jl_kind_ k)
{
  const jl_of_facet_ a = jl_column_(f, JLAW_STIFF);
  const jl_of_facet_ begin = jl_column_(cell, JLAW_LOW), end = jl_column_(cell, JLAW_HIGH);
  const jl_yes_ inside = (o->y1 > begin) & (o->y1 < end);
  const jl_real_ bend = jl_only_(inside, o->bend);
  jl_yes_ near = o->near;
  if (k.yields) near = near & ((c->k0 > 0.0) | (c->k1 <= 0.0));
  const jl_real_ chord1 = jl_pick_(near, 0.5 * bend, (c->k1 - c->chord) * o->rdy);
  const jl_yes_ stiff = c->k1 > JLAW_TINY;
  const jl_real_ fade = jl_only_(stiff, bend / jl_pick_(stiff, c->k1, 1.0));
  /* rounding must not decide: what did not close has not grown, what is at its limit slips */
  const jl_yes_ stiffer = (c->k1 > c->k0) & (o->dy > JLAW_ROUNDED * jl_size_of_(o->y1));
  const jl_real_ least = c->strength * (c->G1 * (1.0 - JLAW_LIMIT) - JLAW_ROUNDED * o->f1);
  const jl_yes_ limited = c->new2 >= jl_larger_(least, jl_each_(0.0)) * jl_larger_(least, jl_each_(0.0));
  const jl_real_ vs = jl_pick_(stiffer, a * chord1 * o->es, fade * c->ts);
  const jl_real_ vt = jl_pick_(stiffer, a * chord1 * o->et, fade * c->tt);
  const jl_real_ us = c->ts * c->unit, ut = c->tt * c->unit;
  const jl_real_ dot = us * vs + ut * vt, push = c->strength * c->k1;
  const jl_real_ beta = jl_only_(c->cap > 0.0, c->share * (a * c->chord)), along = jl_only_(limited, beta);
  o->vs += jl_pick_(limited, c->share * (vs - us * dot) + push * us, vs);
  o->vt += jl_pick_(limited, c->share * (vt - ut * dot) + push * ut, vt);
  o->bss += beta - along * us * us;
  o->bst -= along * us * ut;
  o->btt += beta - along * ut * ut;
  if (k.fades) {
    const jl_real_ by_gamma = jl_only_(limited, c->strength * c->G1);
    o->gs += by_gamma * us;
    o->gt += by_gamma * ut;
  }
  if (k.yields) {
    const jl_yes_ pulls = limited & (c->k1 > 0.0);
    const jl_real_ pull = c->strength * jl_only_(pulls, c->kz1);
    o->ws += pull * us;
    o->wt += pull * ut;
    o->open += c->k1;
  }
}

/* One depth cell of facets: from the sliders before the step to those after it */
JL_IN_ void jl_slide_(const double *f, const double *cell, jl_facets_ *o, jl_real_ *qs, jl_real_ *qt, jl_kind_ k)
{
  jl_sliders_ c;
  jl_cells_of_(cell, o, &c, k.yields);
  c.strength = jl_each_(jl_column_(f, JLAW_STRENGTH));
  if (k.fades) c.strength = c.strength * o->end.gamma;
  if (k.wears) jl_wear_sliders_(cell, o, &c, qs, qt, k);
  jl_load_(f, o, &c, qs, qt, k);
  o->qs += *qs;
  o->qt += *qt;
  if (k.ledger) o->lost += jl_friction_loss_(&c);
  if (k.tangent) jl_slide_tangent_(f, cell, &c, o, k);
}

/* C += along g^T + E^T B E of facets; where the flattened depth moves, less softening g_z^T */
JL_IN_ void jl_add_tangent_(const jlaw_law *law, const double *f, const jl_facets_ *o, jl_sums_ *sum, jl_kind_ k)
{
  const jl_yes_ moves = (o->z1 - o->z0 > JLAW_ROUNDED * o->z1) & (o->open > 0.0);
  const jl_yes_ own = jl_flattens_itself_(f, o);
  for (int i = 0; i < k.dim; i++) {
    const jl_of_facet_ n = jl_column_(f, JLAW_N + i) * jl_column_(f, JLAW_A);
    const jl_of_facet_ s = jl_column_(f, JLAW_S + i) * law->soft, t = jl_column_(f, JLAW_T + i) * law->soft;
    const jl_real_ along = n * o->k1 + s * o->vs + t * o->vt;
    const jl_real_ left = s * o->bss + t * o->bst, right = s * o->bst + t * o->btt;
    for (int j = 0; j < k.dim; j++) {
      const jl_real_ g = jl_each_(jl_column_(f, JLAW_M + j)); /* dy/dd */
      jl_real_ to = along * g + left * jl_column_(f, JLAW_S + j) + right * jl_column_(f, JLAW_T + j);
      if (k.yields) {
        const jl_real_ less = jl_only_(moves, n * o->kz1 + s * o->ws + t * o->wt);
        to -= j > 0 ? less * jl_pick_(own, g, -g) : less * g;
      }
      sum->C[3 * i + j] += to;
    }
  }
}

/* The same where slopes fade, and with them planes turn and friction limits fall: worked out in
 * axes (1, e), then turned. E: derivative of the increment in the plane; A, B: of the sliders'
 * force by the slopes along and across; h: of these by the displacement. */
JL_IN_ void jl_add_fading_tangent_(const jlaw_law *law, const double *f, const jl_motion_ *m, const jl_facets_ *o,
                           jl_sums_ *sum, jl_kind_ k)
{
  const jl_yes_ moves = (o->z1 - o->z0 > JLAW_ROUNDED * o->z1) & (o->open > 0.0);
  const jl_yes_ own = jl_flattens_itself_(f, o);
  const jl_plane_ *s = &o->end, *r = &o->middle;
  const jl_real_ soft = jl_each_(law->soft), none = jl_each_(0.0), n = jl_each_(jl_column_(f, JLAW_POTENTIAL));
  jl_real_ h[3], H[3], C[3][3]; /* ee, ez, zz */
  jl_curvature_(law, f, s, m->end.w, m->has, h);
  jl_curvature_(law, f, r, m->middle.w, m->has, H);
  const jl_real_ turn = 0.5 * (o->d0 + r->along * o->de), et = 0.5 * o->et;
  const jl_real_ rm2 = 1.0 / r->m2, rN2 = 1.0 / r->N2;
  const jl_real_ ea = -turn * (rm2 * r->rm), eb = -(turn * r->rmn + et * r->across * rN2);
  const jl_real_ ta =
      (r->along * o->dz - 0.5 * r->across * o->de) * r->rmn - et * r->along * (rm2 + rN2);
  const jl_real_ Es[3] = {-r->along * r->rm, r->rm + ea * H[0], ea * H[1]};
  const jl_real_ Et[3] = {-r->across * r->rmn, -r->along * r->across * r->rmn + ta * H[0] + eb * H[1],
                      r->m2 * r->rmn + ta * H[1] + eb * H[2]};
  const jl_real_ cs[3] = {-s->along * s->rm, s->rm, none};
  const jl_real_ ct[3] = {-s->across * s->rmn, -s->along * s->across * s->rmn, s->m2 * s->rmn};
  const jl_real_ rM2 = 1.0 / s->m2, rn2 = 1.0 / s->N2, rm3 = rM2 * s->rm;
  const jl_real_ qa = o->qs * rm3, qt = o->qt * s->rmn, fall = s->along * (rM2 + rn2);
  const jl_real_ A[3] = {-qa - o->qt * ct[0] * fall,
                     -s->along * qa - s->across * qt - o->qt * ct[1] * fall,
                     2.0 * s->along * qt - o->qt * ct[2] * fall};
  const jl_real_ down = o->qt * s->across * rn2;
  const jl_real_ B[3] = {-qt - down * ct[0], -s->along * qt - down * ct[1], -down * ct[2]};
  const jl_real_ ga = s->along * rn2, gb = s->across * rn2; /* of log(gamma) */
  const jl_real_ g[3] = {jl_each_(1.0), s->along, s->across};
  for (int j = 0; j < 3; j++) {
    const jl_real_ ha = j ? h[j - 1] : none, hb = j ? h[j] : none, gamma = ga * ha + gb * hb;
    const jl_real_ us = o->vs * g[j] + o->bss * Es[j] + o->bst * Et[j] + o->gs * gamma;
    const jl_real_ ut = o->vt * g[j] + o->bst * Es[j] + o->btt * Et[j] + o->gt * gamma;
    const jl_real_ pressing = k.yields ? jl_only_(moves, j ? jl_pick_(own, g[j], -g[j]) : g[j]) : none;
    for (int i = 0; i < 3; i++) {
      const jl_real_ bend = i == 1 ? ha : i == 2 ? hb : none;
      C[i][j] = n * (o->k1 * g[i] * g[j] + o->f1 * bend)
                + soft * (cs[i] * us + ct[i] * ut + (A[i] * ha + B[i] * hb));
      if (k.yields)
        C[i][j] -= pressing * (n * g[i] * o->kz1 + soft * (cs[i] * o->ws + ct[i] * o->wt));
    }
  }
  for (int i = 0; i < 3; i++) jl_to_axes_(f, &C[i][1], &C[i][2]);
  for (int j = 0; j < 3; j++) jl_to_axes_(f, &C[1][j], &C[2][j]);
  for (int i = 0; i < k.dim; i++)
    for (int j = 0; j < k.dim; j++) sum->C[3 * i + j] += C[i][j];
}

/* Facets from number `at` on: closures, virgin curve, sliders, and their part of F and C */
JL_IN_ void jl_step_facets_(const jlaw_law *law, int at, const jl_motion_ *m, jl_numbers_ n, jl_sums_ *sum, jl_kind_ k)
{
  const int M = law->facets, D = law->cells, some = M - at < JL_TOGETHER_ ? M - at : JL_TOGETHER_;
  const int kept = k.kept ? jl_state_rows_(law) : 0;
  const double *f = jl_facet_of_(law, at), *cell = jl_cell_of_(law, at);
  jl_facets_ o;
  o.y0 = o.y1 = o.es = o.et = o.bend = o.limit2 = o.fw = o.kw = jl_each_(0.0);
  for (int i = 0; i < k.dim && !k.fades; i++) {
    o.y0 += jl_column_(f, JLAW_M + i) * m->from[i];
    o.y1 += jl_column_(f, JLAW_M + i) * m->to[i];
    o.es += jl_column_(f, JLAW_S + i) * m->p[i];
    if (i > 0) o.et += jl_column_(f, JLAW_T + i) * m->p[i];
  }
  if (k.fades) {
    o.y0 = jl_climb_(law, f, m->from[0], &m->start, m->has);
    o.y1 = jl_climb_(law, f, m->to[0], &m->end, m->has);
  }
  o.yw = k.wears ? jl_resolved_(jl_climb_(law, f, m->from[0], &m->start, m->had)) : o.y0;
  if (!k.yields && !jl_any_((o.y0 > 0.0) | (o.y1 > 0.0) | (o.yw > 0.0))) return; /* apart: holds zero */
  if (k.fades) {
    o.middle = jl_plane_at_(f, &m->middle, m->has);
    o.end = jl_plane_at_(f, &m->end, m->has);
    jl_move_in_plane_(f, m, &o);
  }
  const jl_of_facet_ limit = jl_column_(f, JLAW_STRENGTH) * jl_column_(f, JLAW_COSINE);
  if (k.wears) o.limit2 = limit * limit * jl_plane_at_(f, &m->start, m->has).N2;
  o.y0 = jl_resolved_(o.y0);
  o.y1 = jl_resolved_(o.y1);
  o.dy = o.y1 - o.y0;
  o.rdy = 1.0 / o.dy;
  o.near = jl_size_of_(o.dy) <= JLAW_NEAR * jl_size_of_(o.y1);
  o.qs = o.qt = o.lost = o.vs = o.vt = o.bss = o.bst = o.btt = o.ws = o.wt = o.open = jl_each_(0.0);
  o.gs = o.gt = o.worn = jl_each_(0.0);
  if (k.kept) {
    o.f0 = jl_take_(n, kept + at, 1, some);
    o.k0 = jl_take_(n, kept + M + at, 1, some);
  } else jl_virgin_curve_(law, o.yw, &o.f0, &o.k0, (jl_real_ *) 0);
  if (k.wears) {
    o.fw = o.f0, o.kw = o.k0;
    if (jl_somewhere_(o.y0 != o.yw)) jl_virgin_curve_(law, o.y0, &o.f0, &o.k0, (jl_real_ *) 0);
  }
  jl_virgin_curve_(law, o.y1, &o.f1, &o.k1, k.tangent ? &o.bend : (jl_real_ *) 0);
  if (k.kept) {
    jl_put_(n, kept + at, 1, some, o.f1);
    jl_put_(n, kept + M + at, 1, some, o.k1);
  }
  o.z0 = o.z1 = o.fz0 = o.fz1 = o.kz0 = o.kz1 = jl_each_(0.0);
  if (k.yields) jl_press_(law, f, n, kept, at, some, m, &o);
  for (int i = 0; i < D; i++, cell += JLAW_ROWS * JLAW_LANES) {
    const jl_of_facet_ low = jl_column_(cell, JLAW_LOW);
    if (!jl_any_((o.y0 > low) | (o.y1 > low) | (o.yw > low))) break; /* nor does what is deeper */
    const int row = k.dim + 1 + at * D + i;
    jl_real_ qs = jl_take_(n, row, D, some), qt = jl_take_(n, row + M * D, D, some);
    jl_slide_(f, cell, &o, &qs, &qt, k);
    jl_put_(n, row, D, some, qs);
    jl_put_(n, row + M * D, D, some, qt);
  }
  if (k.yields) {
    sum->crushed += jl_column_(f, JLAW_POTENTIAL) * jl_crush_(f, &o);
    if (k.wears) jl_flatten_facets_(o.yw, o.z0, o.fz0, &o.fw, &o.kw);
    jl_flatten_facets_(o.y0, o.z0, o.fz0, &o.f0, &o.k0);
    jl_flatten_facets_(o.y1, o.z1, o.fz1, &o.f1, &o.k1);
  }
  if (k.ledger) sum->lost += jl_column_(f, JLAW_COMPLIANCE) * o.lost;
  if (k.wears) {
    sum->worn += jl_column_(f, JLAW_COMPLIANCE) * o.worn;
    sum->lowered += 0.5 * jl_column_(f, JLAW_POTENTIAL) * ((o.fw + o.f0) * (o.yw - o.y0));
  }
  if (k.fades) {
    jl_add_traction_(law, f, &o, sum, k.dim);
    if (k.tangent) jl_add_fading_tangent_(law, f, m, &o, sum, k);
    return;
  }
  const jl_real_ normal = jl_column_(f, JLAW_A) * o.f1, qs = law->soft * o.qs, qt = law->soft * o.qt;
  for (int i = 0; i < k.dim; i++) {
    const jl_real_ pull = jl_column_(f, JLAW_N + i) * normal;
    sum->F[i] += pull + (jl_column_(f, JLAW_S + i) * qs + jl_column_(f, JLAW_T + i) * qt);
  }
  if (k.tangent) jl_add_tangent_(law, f, &o, sum, k);
}

/* Advance joints by the increments d: their numbers n, F (dim), and C (dim, dim) for a tangent */
JL_IN_ void jl_step_(const jlaw_law *law, jl_numbers_ n, const jl_of_joint_ d[3], jl_of_joint_ F[3], jl_of_joint_ C[9],
             jl_kind_ k)
{
  const int dim = k.dim, M = law->facets, rest = jl_rest_row_(law);
  jl_motion_ m;
  jl_sums_ sum[JL_SUMS_];
  for (int i = 0; i < 3; i++) {
    m.p[i] = i < dim ? d[i] : jl_each_joint_(0.0);
    m.from[i] = i < dim ? jl_take_joint_(n, i) : jl_each_joint_(0.0);
    m.to[i] = m.from[i] + m.p[i];
  }
  m.had = m.has = jl_each_joint_(1.0);
  if (k.wears) jl_wear_slopes_(law, n, &m);
  if (k.fades) {
    m.start = jl_site_of_(law, m.from[1], m.from[2]);
    m.middle = jl_site_of_(law, m.from[1] + 0.5 * m.p[1], m.from[2] + 0.5 * m.p[2]);
    m.end = jl_site_of_(law, m.to[1], m.to[2]);
  }
  for (int i = 0; i < JL_SUMS_; i++) {
    for (int j = 0; j < 3; j++) sum[i].F[j] = jl_each_(0.0);
    for (int j = 0; k.tangent && j < 9; j++) sum[i].C[j] = jl_each_(0.0);
    sum[i].lost = sum[i].crushed = sum[i].lowered = sum[i].worn = jl_each_(0.0);
  }
  for (int at = 0; at < M; at += JL_TOGETHER_)
    jl_step_facets_(law, at, &m, n, sum + at / JL_TOGETHER_ % JL_SUMS_, k);
  for (int i = 0; i < dim; i++) {
    F[i] = jl_total_(sum, F[i]);
    for (int j = 0; k.tangent && j < dim; j++) C[dim * i + j] = jl_total_(sum, C[3 * i + j]);
    jl_put_joint_(n, i, m.to[i]);
  }
  if (!k.ledger) return;
  jl_of_joint_ lost = jl_total_(sum, lost);
  if (k.wears) {
    jl_of_joint_ lowered = jl_total_(sum, lowered);
    for (int l = 0; l < JL_JOINTS_; l++) /* >= 0 by the pairs of facets, but for rounding */
      JL_JOINT_(lowered, l) = JL_JOINT_(lowered, l) > 0.0 ? JL_JOINT_(lowered, l) : 0.0;
    jl_put_joint_(n, jl_worn_row_(law) + 1, jl_take_joint_(n, jl_worn_row_(law) + 1) + lost);
    lost += jl_total_(sum, worn) + lowered;
  }
  if (k.yields) {
    const jl_of_joint_ crushed = jl_total_(sum, crushed);
    jl_put_joint_(n, rest + M, jl_take_joint_(n, rest + M) + crushed);
    lost += crushed;
  }
  jl_put_joint_(n, dim, jl_take_joint_(n, dim) + lost);
}

/* ------------------------------------------------------------------ what a state is */

/* Facets from number `at` on in a state: y, z, and the virgin curve there as in y1 and z1; the
 * friction limit of q over G */
JL_IN_ void jl_facets_now_(const jlaw_law *law, jl_numbers_ n, int at, jl_facets_ *o)
{
  const int some = law->facets - at < JL_TOGETHER_ ? law->facets - at : JL_TOGETHER_;
  const double *f = jl_facet_of_(law, at);
  jl_of_joint_ slopes = jl_each_joint_(1.0), to[3];
  for (int i = 0; i < 3; i++) to[i] = i < law->dim ? jl_take_joint_(n, i) : jl_each_joint_(0.0);
  if (law->wears) slopes = 1.0 - jl_take_joint_(n, jl_worn_row_(law));
  o->y1 = o->z1 = o->fz1 = o->kz1 = jl_each_(0.0);
  o->strength = jl_each_(jl_column_(f, JLAW_STRENGTH));
  for (int i = 0; i < law->dim && !law->fades; i++) o->y1 += jl_column_(f, JLAW_M + i) * to[i];
  if (law->fades) {
    const jl_site_ here = jl_site_of_(law, to[1], to[2]);
    o->y1 = jl_climb_(law, f, to[0], &here, slopes);
    o->strength = o->strength * jl_plane_at_(f, &here, slopes).gamma;
  }
  o->y1 = jl_resolved_(o->y1);
  jl_virgin_curve_(law, o->y1, &o->f1, &o->k1, (jl_real_ *) 0);
  if (!law->yields) return;
  o->z1 = jl_take_(n, jl_rest_row_(law) + at, 1, some);
  jl_virgin_curve_(law, o->z1, &o->fz1, &o->kz1, (jl_real_ *) 0);
}

typedef struct { /* as reference.Measures; of the stored energy that of the shear springs */
  jl_of_joint_ sliding, slipping, separated, stored, reach, sheared;
} jl_amounts_;

typedef struct {
  jl_real_ sliding, slipping, separated, normal, sheared;
} jl_amount_sums_;

JL_IN_ void jl_measure_facets_(const jlaw_law *law, jl_numbers_ n, int at, jl_amount_sums_ *sum, jl_of_joint_ *reach)
{
  const int M = law->facets, D = law->cells, some = M - at < JL_TOGETHER_ ? M - at : JL_TOGETHER_;
  const double *f = jl_facet_of_(law, at), *cell = jl_cell_of_(law, at);
  jl_real_ held = jl_each_(0.0), sheared = jl_each_(0.0), whole_slips = jl_each_(1.0);
  jl_facets_ o;
  jl_facets_now_(law, n, at, &o);
  for (int i = 0; i < D && jl_any_(o.y1 > jl_column_(cell, JLAW_LOW)); i++) {
    jl_real_ G, kappa;
    const int row = jl_slider_row_(law) + at * D + i;
    const jl_real_ qs = jl_take_(n, row, D, some), qt = jl_take_(n, row + M * D, D, some);
    jl_hold_cell_(cell, o.y1, o.f1, o.k1, o.z1, o.fz1, o.kz1, law->yields, &G, &kappa);
    const jl_real_ q2 = qs * qs + qt * qt;
    const jl_yes_ stiff = kappa > JLAW_TINY;
    const jl_yes_ limited = jl_root_(q2) >= o.strength * (G * (1.0 - JLAW_LIMIT) - JLAW_ROUNDED * o.f1);
    held += jl_only_(limited, G);
    whole_slips = jl_only_(limited, whole_slips);
    sheared += jl_only_(stiff, q2 / jl_pick_(stiff, kappa, 1.0));
    cell += JLAW_ROWS * JLAW_LANES;
  }
  const jl_yes_ touches = o.y1 > o.z1;
  const jl_real_ force = jl_only_(touches, jl_larger_(o.f1 - o.fz1, jl_each_(0.0))),
             share = jl_each_(jl_column_(f, JLAW_SHARE));
  sum->sliding += share * jl_only_(touches, whole_slips);
  sum->slipping +=
      share * jl_smaller_(jl_only_(force > 0.0, held / jl_pick_(force > 0.0, force, 1.0)), jl_each_(1.0));
  sum->separated += share * jl_pick_(touches, 0.0, 1.0);
  jl_real_ normal = jl_psi_(law, o.y1);
  if (law->yields) normal = normal - jl_psi_(law, o.z1) - o.fz1 * (o.y1 - o.z1);
  sum->normal += jl_column_(f, JLAW_POTENTIAL) * jl_only_(touches, jl_larger_(normal, jl_each_(0.0)));
  sum->sheared += jl_column_(f, JLAW_COMPLIANCE) * sheared;
#ifdef JLAW_ABREAST
  for (int l = 0; l < some; l++) *reach = *reach > o.y1[l] ? *reach : o.y1[l];
#else
  *reach = jl_larger_(*reach, o.y1);
#endif
}

JL_IN_ jl_amounts_ jl_measure_(const jlaw_law *law, jl_numbers_ n)
{
  jl_amount_sums_ sum[JL_SUMS_];
  jl_amounts_ all;
  all.reach = jl_each_joint_(-DBL_MAX);
  const jl_amount_sums_ none = {jl_each_(0.0), jl_each_(0.0), jl_each_(0.0), jl_each_(0.0), jl_each_(0.0)};
  for (int i = 0; i < JL_SUMS_; i++) sum[i] = none;
  for (int at = 0; at < law->facets; at += JL_TOGETHER_)
    jl_measure_facets_(law, n, at, sum + at / JL_TOGETHER_ % JL_SUMS_, &all.reach);
  all.sliding = jl_total_(sum, sliding);
  all.slipping = jl_total_(sum, slipping);
  all.separated = jl_total_(sum, separated);
  all.sheared = jl_total_(sum, sheared);
  all.stored = jl_total_(sum, normal) + all.sheared;
  if (law->bonded) all.stored += jl_step_bond_(law, n, jl_damage_row_(law), NULL, NULL, 0, 0);
  return all;
}

/* ------------------------------------------------------------- kinds of a step */

JL_IN_ jl_kind_ jl_kind_of_(int dim, int yields, int fades, int wears, int ledger, int tangent, int kept)
{
  const jl_kind_ k = {dim, yields, fades, wears, ledger, tangent, kept};
  return k;
}

/* The step, compiled for each kind: a plane costs half of space; a tangent or ledger that is not
 * asked for costs nothing. Where asperities yield or slopes wear, the law needs the ledger. */
JL_IN_ void jl_step_of_kind_(const jlaw_law *law, jl_numbers_ n, const jl_of_joint_ d[3], jl_of_joint_ F[3],
                     jl_of_joint_ C[9], int ledger, int tangent, int kept)
{
#define JL_STEP_(dim, yields, fades, wears, ledger)                                         \
  (tangent ? jl_step_(law, n, d, F, C, jl_kind_of_(dim, yields, fades, wears, ledger, 1, kept)) \
           : jl_step_(law, n, d, F, C, jl_kind_of_(dim, yields, fades, wears, ledger, 0, kept)))
  const int dim = law->dim, y = law->yields, w = law->wears;
  if (law->fades && (y || w || dim == 1)) JL_STEP_(dim, y, 1, w, 1);
  else if (law->fades && dim == 3) JL_STEP_(3, 0, 1, 0, ledger);
  else if (law->fades) JL_STEP_(2, 0, 1, 0, ledger);
  else if (y || dim == 1) JL_STEP_(dim, y, 0, 0, 1);
  else if (dim == 3 && ledger) JL_STEP_(3, 0, 0, 0, 1);
  else if (dim == 3) JL_STEP_(3, 0, 0, 0, 0);
  else if (ledger) JL_STEP_(2, 0, 0, 0, 1);
  else JL_STEP_(2, 0, 0, 0, 0);
#undef JL_STEP_
  if (law->bonded) jl_step_bond_(law, n, jl_damage_row_(law), F, C, tangent, ledger || y || w);
}

/* ------------------------------------------------------------------ messages */

typedef struct {
  char *to;
  size_t size, at;
} jlaw_text_;

static JLAW_FUNCTION void jlaw_say_(jlaw_text_ *text, const char *words)
{
  for (; *words && text->at + 1 < text->size; words++) text->to[text->at++] = *words;
  if (text->size) text->to[text->at] = 0;
}

/* A number to five digits, without stdio and its locale */
static JLAW_FUNCTION void jlaw_say_number_(jlaw_text_ *text, double x)
{
  char digits[24];
  int exponent = 0, n = 0;
  if (x < 0.0) jlaw_say_(text, "-");
  x = fabs(x);
  if (!(x <= DBL_MAX)) {
    jlaw_say_(text, x > DBL_MAX ? "inf" : "nan");
    return;
  }
  for (; x >= 10.0; exponent++) x /= 10.0;
  for (; x > 0.0 && x < 1.0; exponent--) x *= 10.0;
  x += 0.00005;
  for (; x >= 10.0; exponent++) x /= 10.0;
  for (int i = 0; i < 5; i++) {
    const int digit = (int) x;
    digits[n++] = (char) ('0' + digit);
    if (i == 0) digits[n++] = '.';
    x = 10.0 * (x - digit);
  }
  digits[n++] = 'e';
  digits[n++] = exponent < 0 ? '-' : '+';
  exponent = exponent < 0 ? -exponent : exponent;
  for (int unit = exponent >= 100 ? 100 : 10; unit; unit /= 10)
    digits[n++] = (char) ('0' + exponent / unit % 10);
  digits[n] = 0;
  jlaw_say_(text, digits);
}

/* ------------------------------------------------------------------------ the step */

/* NaN, where the C library may have none */
static JLAW_FUNCTION double jlaw_none_(void)
{
  const double zero = 0.0;
  return zero / zero;
}

/* Phi and Phi' at one y */
static JLAW_FUNCTION double jlaw_virgin_one_(const jlaw_law *law, double y, double *slope)
{
  jl_real_ forces, slopes;
  jl_virgin_curve_(law, jl_resolved_(jl_each_(y)), &forces, &slopes, (jl_real_ *) 0);
  *slope = JL_LANE_(slopes, 0);
  return JL_LANE_(forces, 0);
}

static JLAW_FUNCTION double jlaw_of_facet_(const jlaw_law *law, int facet, int at)
{
  const int lane = facet % JLAW_LANES;
  return law->facet[(facet - lane) * JLAW_COLUMNS + at * JLAW_LANES + lane];
}

#ifdef JOINTLAW_NO_LEDGER
enum { JLAW_LEDGER = 0 };
#else
enum { JLAW_LEDGER = 1 };
#endif

JLAW_CLONES JLAW_FUNCTION void jlaw_step(const jlaw_law *law, double *s, size_t stride,
                                         const double *d, double *F, double *C)
{
  const jl_numbers_ n = {s, stride, 0};
  jl_step_of_kind_(law, n, d, F, C, JLAW_LEDGER, C != NULL, 0);
}

/* Whether all sliders hold forces that a law can have; 0 for NaN */
static JLAW_FUNCTION int jlaw_sound_(const double *q, int n)
{
  double sum[4] = {0.0, 0.0, 0.0, 0.0};
  int i = 0;
  for (; i + 4 <= n; i += 4)
    for (int l = 0; l < 4; l++) sum[l] += q[i + l] * q[i + l];
  for (; i < n; i++) sum[0] += q[i] * q[i];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]) < 1e300;
}

/* Whether energies, flattened depths, wear and damage of a state are numbers of this law */
static JLAW_FUNCTION int jlaw_proper_(const jlaw_law *law, const double *s)
{
  const double *rest = s + jl_rest_row_(law), *worn = s + jl_worn_row_(law);
  int good = fabs(s[law->dim]) <= DBL_MAX;
  for (int f = 0; law->yields && f < law->facets; f++)
    good = good && rest[f] >= 0.0 && rest[f] <= law->largest_reach;
  if (law->yields) good = good && fabs(rest[law->facets]) <= DBL_MAX;
  if (law->wears)
    good = good && worn[0] >= 0.0 && worn[0] <= 1.0 && worn[1] >= 0.0 && worn[1] <= DBL_MAX;
  if (law->bonded) good = good && s[jl_damage_row_(law)] >= 0.0 && s[jl_damage_row_(law)] <= 1.0;
  return good && jlaw_sound_(s + jl_slider_row_(law), jl_rest_row_(law) - jl_slider_row_(law));
}

static JLAW_FUNCTION int jlaw_refuse_(const jlaw_law *law, const double *s, const double *d,
                                      int damaged, char *message, size_t size)
{
  jlaw_text_ text = {message, size, 0};
  int finite = 1;
  jlaw_say_(&text, damaged ? "" : "the step d = (");
  for (int i = 0; !damaged && i < law->dim; i++) {
    jlaw_say_(&text, i ? ", " : "");
    jlaw_say_number_(&text, d[i]);
    finite = finite && fabs(d[i]) <= DBL_MAX;
  }
  if (damaged) {
    jlaw_say_(&text,
              "the state holds numbers that are not finite or no forces of this law; nothing "
              "was moved. Start from zeros or from a state that this law wrote");
  } else if (!finite) {
    jlaw_say_(&text,
              ") m is not finite; nothing was moved. Look for the fault in the host's motion");
  } else {
    jlaw_say_(&text, ") m leads from closure ");
    jlaw_say_number_(&text, s[0]);
    jlaw_say_(&text, " m beyond the reach of ");
    jlaw_say_number_(&text, law->largest_reach);
    jlaw_say_(&text, " m, where forces overflow; nothing was moved. Take a smaller step");
  }
  return -1;
}

JLAW_FUNCTION int jlaw_update(const jlaw_law *law, const double *s0, double *s1, const double *d,
                              double *F, double *C, char *message, size_t size)
{
  const int dim = law->dim, rows = jl_state_rows_(law);
  double far = 0.0, step_size = 0.0; /* NaN stays in sums */
  for (int i = 0; i < dim; i++) far += fabs(s0[i]), step_size += fabs(d[i]);
  const double reach = law->stretch * (far + step_size);
  const int damaged = !(far <= DBL_MAX) || !jlaw_proper_(law, s0);
  if (damaged || !(reach <= law->largest_reach))
    return jlaw_refuse_(law, s0, d, damaged, message, size);
  if (s1 != s0)
    for (int i = 0; i < rows; i++) s1[i] = s0[i];
  jlaw_step(law, s1, 1, d, F, C);
  return 0;
}

/* ------------------------------------------------------------ what a state is */

JLAW_FUNCTION int jlaw_dim(const jlaw_law *law) { return law->dim; }
JLAW_FUNCTION int jlaw_state_size(const jlaw_law *law) { return jl_state_rows_(law); }
JLAW_FUNCTION const char *jlaw_fingerprint(const jlaw_law *law) { return law->fingerprint; }
JLAW_FUNCTION int jlaw_unmated(const jlaw_law *law, double *s)
{
  const int far = law->fades && law->dim > 1;
  for (int i = 0; i < jl_state_rows_(law); i++) s[i] = 0.0;
  if (far) s[0] = law->first_touch, s[1] = JLAW_FAR * law->mating_length;
  if (law->bonded) s[jl_damage_row_(law)] = 1.0;
  return far ? 0 : -1;
}
JLAW_FUNCTION double jlaw_dissipated(const jlaw_law *law, const double *s) { return s[law->dim]; }

JLAW_CLONES static JLAW_FUNCTION jl_amounts_ jlaw_measure_(const jlaw_law *law, const double *s)
{
  const jl_numbers_ n = {(double *) s, 1, 0}; /* only read */
  return jl_measure_(law, n);
}

JLAW_FUNCTION double jlaw_stored(const jlaw_law *law, const double *s)
{
  return jlaw_measure_(law, s).stored;
}

JLAW_FUNCTION void jlaw_shares(const jlaw_law *law, const double *s, double shares[3])
{
  const jl_amounts_ all = jlaw_measure_(law, s);
  shares[0] = all.sliding;
  shares[1] = all.slipping;
  shares[2] = all.separated;
}

/* ------------------------------------------------------------ unsheared joint */

JLAW_FUNCTION double jlaw_normal_stress(const jlaw_law *law, double closure)
{
  double slope, late = 0.0;
  if (!(closure <= law->largest_reach)) return jlaw_none_();
  for (int f = 0; law->yields && f < law->facets; f++) /* what yielding takes off first loading */
    for (int i = JLAW_LATE; i < JLAW_LATE + 4; i += 2) {
      const double depth = jlaw_of_facet_(law, f, i + 1);
      late += jlaw_of_facet_(law, f, i) * jlaw_virgin_one_(law, closure - depth, &slope);
    }
  if (law->bonded && closure < 0.0) { /* a joint that opens */
    jl_bonded_ b = {{closure, 0.0, 0.0}, 0.0, {0.0}, {0.0}, 0.0};
    jl_hold_(law, &b);
    return b.F[0];
  }
  return law->closure_factor * jlaw_virgin_one_(law, closure, &slope) - late;
}

JLAW_FUNCTION double jlaw_max_stiffness(const jlaw_law *law, double closure)
{
  double slope;
  if (!(closure <= law->largest_reach)) return jlaw_none_();
  const double force = jlaw_virgin_one_(law, closure, &slope);
  return law->stiffness_factor * slope + law->bending_factor * force
         + fmax(law->bond_normal, law->bond_shear);
}

JLAW_FUNCTION double jlaw_closure(const jlaw_law *law, double normal_stress)
{
  double low = 0.0, high = law->farthest;
  if (!(normal_stress >= 0.0) || !(jlaw_normal_stress(law, high) >= normal_stress))
    return jlaw_none_();
  while (1) { /* the stress rises: halve the exponent first, then the number */
    const double middle =
        high > 4.0 * low && high > 1e-300 ? sqrt(high * fmax(low, 1e-300)) : 0.5 * (low + high);
    if (!(middle > low && middle < high)) return low == 0.0 ? 0.0 : high;
    if (jlaw_normal_stress(law, middle) < normal_stress) low = middle;
    else high = middle;
  }
}

/* --------------------------------------------------------------- turned axes */

JLAW_FUNCTION void jlaw_swap_bodies(const jlaw_law *law, double *s)
{
  const int dim = law->dim, D = law->cells, M = law->facets;
  if (dim > 1) s[1] = -s[1]; /* shear along axis 2 */
  double *qs = s + jl_slider_row_(law), *qt = qs + M * D, *depth = qt + M * D;
  for (int f = 0; f < M; f++) {
    const int other = (int) jlaw_of_facet_(law, f, JLAW_MIRROR);
    for (int i = 0; i < D; i++) {
      const double here = qs[f * D + i], turned = qt[f * D + i];
      if (other > f) {
        qs[f * D + i] = qs[other * D + i], qt[f * D + i] = -qt[other * D + i];
        qs[other * D + i] = here, qt[other * D + i] = -turned;
      } else if (other == f) qt[f * D + i] = -turned; /* t changes its sense in the mirror */
    }
    if (law->yields && other > f) {
      const double here = depth[f];
      depth[f] = depth[other], depth[other] = here;
    }
  }
}

/* Numbers of a ring of n facets, read at azimuths turned by the angle: the trigonometric
 * interpolation of n (even) places, or the straight one, which makes no new extremes */
static JLAW_FUNCTION void jlaw_turn_(double *x, int n, int jl_step_, double angle, int straight)
{
  double old[JLAW_AZIMUTHS];
  const double pi = 3.14159265358979323846;
  for (int j = 0; j < n; j++) old[j] = x[j * jl_step_], x[j * jl_step_] = 0.0;
  for (int j = 0; j < n; j++)
    for (int k = 0; k < n; k++) {
      const double way = remainder(angle + 2.0 * pi * (j - k) / n, 2.0 * pi), half = sin(0.5 * way);
      double weight = 1.0;
      if (straight) weight = fmax(1.0 - fabs(way) * n / (2.0 * pi), 0.0);
      else if (fabs(half) > 1e-9) weight = sin(0.5 * n * way) * cos(0.5 * way) / (n * half);
      x[j * jl_step_] += weight * old[k];
    }
}

/* Brings sliders beyond their friction limit back to it */
static JLAW_FUNCTION void jlaw_hold_(const jlaw_law *law, double *s)
{
  const jl_numbers_ n = {s, 1, 0};
  const int M = law->facets, D = law->cells;
  for (int at = 0; at < M; at += JL_TOGETHER_) {
    const int some = M - at < JL_TOGETHER_ ? M - at : JL_TOGETHER_;
    const double *cell = jl_cell_of_(law, at);
    jl_facets_ o;
    jl_facets_now_(law, n, at, &o);
    for (int i = 0; i < D; i++, cell += JLAW_ROWS * JLAW_LANES) {
      const int row = jl_slider_row_(law) + at * D + i;
      jl_real_ G, kappa, qs = jl_take_(n, row, D, some), qt = jl_take_(n, row + M * D, D, some);
      jl_hold_cell_(cell, o.y1, o.f1, o.k1, o.z1, o.fz1, o.kz1, law->yields, &G, &kappa);
      const jl_real_ cap = o.strength * G;
      const jl_real_ size = jl_root_(qs * qs + qt * qt);
      const jl_yes_ jl_beyond_ = size > cap;
      const jl_real_ share = jl_pick_(jl_beyond_, cap / jl_pick_(jl_beyond_, size, 1.0), 1.0);
      jl_put_(n, row, D, some, qs * share);
      jl_put_(n, row + M * D, D, some, qt * share);
    }
  }
}

JLAW_FUNCTION void jlaw_rotate(const jlaw_law *law, double *s, double angle)
{
  const int dim = law->dim, D = law->cells, M = law->facets;
  const double before = jlaw_measure_(law, s).sheared, c = cos(angle), d = sin(angle);
  double *q = s + jl_slider_row_(law), *depth = s + jl_rest_row_(law);
  if (dim == 2 && c < 0.0) jlaw_swap_bodies(law, s); /* the axis changes its sense */
  if (dim != 3) return;
  const double along = s[1], across = s[2];
  s[1] = c * along + d * across, s[2] = c * across - d * along;
  for (int f = 0, n; f < M; f += n) { /* rings */
    n = (int) jlaw_of_facet_(law, f, JLAW_RING);
    for (int i = 0; i < D; i++) {
      jlaw_turn_(q + f * D + i, n, D, angle, 0);
      jlaw_turn_(q + (M + f) * D + i, n, D, angle, 0);
    }
    if (law->yields) jlaw_turn_(depth + f, n, 1, angle, 1);
  }
  jlaw_hold_(law, s);
  const double after = jlaw_measure_(law, s).sheared;
  if (after > before) /* sliders gain nothing */
    for (int i = 0; i < 2 * M * D; i++) q[i] *= sqrt(before / after);
  else s[dim] += before - after;
}

/* ------------------------------------------------------------- table files */
#ifndef JOINTLAW_NO_FILES

#define JLAW_LONGEST (1L << 28) /* bytes of a table file: those of a law have 1e5 to 1e7 */

/* The bytes of a file and a zero; NULL if it cannot be read */
static char *jlaw_load_(const char *file, size_t *length)
{
  FILE *stream = fopen(file, "rb");
  const long size = stream && !fseek(stream, 0, SEEK_END) ? ftell(stream) : -1;
  char *bytes = size >= 0 && size < JLAW_LONGEST ? (char *) malloc((size_t) size + 1) : NULL;
  if (bytes) {
    rewind(stream);
    *length = fread(bytes, 1, (size_t) size, stream);
    bytes[*length] = 0;
  }
  if (stream) fclose(stream);
  return bytes;
}

/* FNV-1a of 64 bits, without carriage returns: any other change of one byte changes it */
static unsigned long long jlaw_sum_of_(const char *bytes, const char *end)
{
  unsigned long long sum = 0xCBF29CE484222325ULL;
  for (; bytes < end; bytes++)
    if (*bytes != '\r') sum = (sum ^ (unsigned char) *bytes) * 0x100000001B3ULL;
  return sum;
}

static int jlaw_hex_(char c)
{
  return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* Past blanks and lines that begin with # */
static const char *jlaw_skip_(const char *at)
{
  while (*at == ' ' || *at == '\n' || *at == '\r' || *at == '#')
    if (*at++ == '#')
      while (*at && *at != '\n') at++;
  return at;
}

/* Reads a word into `word`; empty if there is none or it is too long */
static const char *jlaw_word_(const char *at, char *word, size_t room)
{
  size_t n = 0;
  for (at = jlaw_skip_(at); *at > ' ' && n + 1 < room; at++) word[n++] = *at;
  word[*at > ' ' ? 0 : n] = 0;
  return at;
}

/* Reads a whole number, or a hexadecimal float as Python's float.hex writes it; NULL if neither.
 * No locale, no rounding. */
static const char *jlaw_number_(const char *at, double *number)
{
  at = jlaw_skip_(at);
  const int negative = *at == '-';
  at += negative;
  const int hex = at[0] == '0' && at[1] == 'x';
  unsigned long long digits = 0;
  int count = 0, places = 0, point = 0, power = 0;
  at += hex ? 2 : 0;
  for (; jlaw_hex_(*at) >= 0 || (*at == '.' && hex && !point); at++) {
    if (*at == '.') {
      point = 1;
      continue;
    }
    const int digit = jlaw_hex_(*at);
    if (++count > 15 || (!hex && digit > 9)) return NULL;
    digits = digits * (hex ? 16u : 10u) + (unsigned) digit;
    places += point;
  }
  if (hex && *at == 'p') {
    const int down = *++at == '-';
    int n = 0;
    at += *at == '-' || *at == '+';
    for (; *at >= '0' && *at <= '9' && n < 5; at++, n++) power = 10 * power + (*at - '0');
    if (n == 0) return NULL;
    power = down ? -power : power;
  }
  if (count == 0 || *at > ' ') return NULL;
  *number = ldexp((double) digits, power - 4 * places);
  if (negative) *number = -*number;
  return fabs(*number) <= DBL_MAX ? at : NULL;
}

/* Reads all numbers into law; NULL or what is wrong */
static const char *jlaw_parse_numbers_(const char **at, jlaw_law *law)
{
#define X(name, jl_whole_, least, most) {#name, offsetof(jlaw_law, name), jl_whole_, least, most},
  static const struct {
    const char *name;
    size_t place;
    int is_whole;
    double least, most;
  } keys[] = {JLAW_NUMBERS(X)};
#undef X
  char word[sizeof law->fingerprint];
  for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
    double number;
    char *to = (char *) law + keys[i].place;
    *at = jlaw_word_(*at, word, sizeof word);
    if (strcmp(word, keys[i].name)) return "a keyword is missing, unknown or not in its place";
    *at = jlaw_number_(*at, &number);
    if (!*at || !(number >= keys[i].least && number <= keys[i].most))
      return "a parameter is no number or out of its bounds";
    const int whole_number = (int) (keys[i].is_whole ? number : 0.0);
    if (keys[i].is_whole) memcpy(to, &whole_number, sizeof whole_number);
    else memcpy(to, &number, sizeof number);
  }
  return NULL;
}

/* Reads the text of a table file into law; NULL or what is wrong */
static const char *jlaw_parse_(const char *at, jlaw_law *law, size_t length)
{
  char word[sizeof law->fingerprint];
  at = jlaw_word_(at, word, sizeof word);
  if (strcmp(word, "fingerprint")) return "it does not tell its fingerprint";
  at = jlaw_word_(at, law->fingerprint, sizeof law->fingerprint);
  const char *wrong = jlaw_parse_numbers_(&at, law);
  if (wrong) return wrong;
  const size_t blocks = (size_t) (law->facets + JLAW_LANES - 1) / JLAW_LANES;
  const char *words[4] = {"facet", "depth", "curve", "energy"};
  const size_t sizes[4] = {blocks * JLAW_COLUMNS * JLAW_LANES,
                           blocks * (size_t) law->cells * JLAW_ROWS * JLAW_LANES,
                           4 * (size_t) law->pieces, 4 * (size_t) law->pieces};
  const size_t all = sizes[0] + sizes[1] + sizes[2] + sizes[3];
  if (all > length / 2) return "its sizes do not fit one another";
  double *to = law->own = (double *) malloc(all * sizeof *law->own);
  if (!to) return "there is no memory for it";
  for (int i = 0; i < 4; i++) {
    at = jlaw_word_(at, word, sizeof word);
    if (strcmp(word, words[i])) return "a table is missing, too short or too long";
    for (size_t n = 0; n < sizes[i]; n++, to++)
      if (!(at = jlaw_number_(at, to))) return "a table holds what is no number";
  }
  law->facet = law->own, law->depth = law->facet + sizes[0];
  law->curve = law->depth + sizes[1], law->energy = law->curve + sizes[2];
  for (size_t n = 0; n < sizes[0]; n++) { /* A and what follows it are no less than zero */
    const size_t which = n / JLAW_LANES % JLAW_COLUMNS;
    if ((which >= JLAW_A && !(law->facet[n] >= 0.0))
        || (which == JLAW_MIRROR && !(law->facet[n] < law->facets)))
      return "a facet is out of bounds";
  }
  for (int f = 0; f < law->facets;) {
    const double ring = jlaw_of_facet_(law, f, JLAW_RING);
    if (!(ring >= 1.0 && ring <= (double) JLAW_AZIMUTHS && ring <= law->facets - f))
      return "a ring of facets is out of bounds";
    f += (int) ring;
  }
  return *jlaw_skip_(at) ? "something follows the last table" : NULL;
}

static const char *jlaw_check_(char *bytes, size_t length, jlaw_law *law)
{
  static const char magic[] = "jointlaw tables ";
  const char *at = bytes + sizeof magic - 1;
  double version;
  if (strncmp(bytes, magic, sizeof magic - 1)) return "it is no table file of jointlaw";
  at = jlaw_number_(at, &version);
  if (!at || version != JLAW_FORMAT)
    return "it is of another version than this jointlaw.h; export law and header anew, together";
  char *end = bytes + length, word[20];
  while (end > bytes && end[-1] <= ' ' && end[-1] >= 0) end--;
  while (end > bytes && end[-1] != '\n') end--; /* to the last line */
  const char *sum = jlaw_word_(jlaw_word_(end, word, sizeof word), word, sizeof word);
  unsigned long long told = 0;
  for (int i = 0; i < 16; i++) {
    if (jlaw_hex_(word[i]) < 0) return "it ends too early: copy it again, whole";
    told = 16 * told + (unsigned) jlaw_hex_(word[i]);
  }
  if (strncmp(end, "sum ", 4) || word[16] || *jlaw_skip_(sum))
    return "it ends too early: copy it again, whole";
  if (told != jlaw_sum_of_(bytes, end)) return "it is damaged: its sum is wrong; export it again";
  *end = 0;
  return jlaw_parse_(at, law, length);
}

jlaw_law *jlaw_read(const char *file, char *message, size_t size)
{
  jlaw_text_ text = {message, size, 0};
  size_t length = 0;
  const char *wrong = "it cannot be read";
  char *bytes = jlaw_load_(file, &length);
  jlaw_law *law = (jlaw_law *) calloc(1, sizeof *law);
  if (bytes && law) wrong = jlaw_check_(bytes, length, law);
  free(bytes);
  if (!wrong) return law;
  jlaw_free(law);
  jlaw_say_(&text, file);
  jlaw_say_(&text, ": ");
  jlaw_say_(&text, wrong);
  return NULL;
}

void jlaw_free(jlaw_law *law)
{
  if (law) free(law->own);
  free(law);
}

#endif

#if defined(__GNUC__) && !defined(__clang__) && !defined(__CUDACC__)
#pragma GCC pop_options
#endif
#ifdef __cplusplus
}
#endif
#endif
