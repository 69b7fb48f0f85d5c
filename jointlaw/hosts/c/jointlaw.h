/* jointlaw.h: the law of a rough rock joint, complete, in C99 (also C++11 and later). MIT licence.
 *
 *     #define JOINTLAW_IMPLEMENTATION                  in one source file, before this line:
 *     #include "jointlaw.h"
 *
 *     char message[JLAW_MESSAGE];
 *     jlaw_law *law = jlaw_read("granite.jlaw", message, sizeof message);
 *     double state[162] = {0};                         jlaw_state_size(law) numbers; zeros: virgin
 *     if (jlaw_update(law, state, state, d, F, NULL, message, sizeof message)) ... message tells
 *
 * Table files (.jlaw, or as constants NAME.h) are written by `jointlaw export c`.
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
#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif

#define JLAW_MESSAGE 300 /* bytes that hold every message */

typedef struct jlaw_law jlaw_law;

/* Read a table file. NULL and a message if it cannot be read, is damaged or of another version. */
jlaw_law *jlaw_read(const char *file, char *message, size_t size);
void jlaw_free(jlaw_law *law);

int jlaw_dim(const jlaw_law *law);        /* components of d: 3, 2 in a plane, 1 for closure only */
int jlaw_state_size(const jlaw_law *law); /* numbers of state, as in a Python snapshot */

/* One step from state s0 to s1 (may be the same) by d (dim): F (dim), and C (dim, dim) if not NULL.
 * Returns 0; or -1 and a message where d or the state is not finite or forces would overflow:
 * nothing is written then. */
int jlaw_update(const jlaw_law *law, const double *s0, double *s1, const double *d, double *F,
                double *C, char *message, size_t size);

double jlaw_stored(const jlaw_law *law, const double *s);     /* elastic energy, J/m2 */
double jlaw_dissipated(const jlaw_law *law, const double *s); /* lost since virgin, J/m2 */
/* Shares from 0 to 1. sliding: of all facets, those at their friction limit; slipping: of the
 * friction capacity, what is at its limit; separated: of all facets, those out of touch. */
void jlaw_shares(const jlaw_law *law, const double *s, double shares[3]);

/* Unsheared joint: normal stress (Pa) at a closure (m), and the inverse. NaN where there is none. */
double jlaw_normal_stress(const jlaw_law *law, double closure);
double jlaw_closure(const jlaw_law *law, double normal_stress);
/* Bound of |C| (Pa/m) while no facet is closed further: dt < 2 sqrt(mass/(area * this)). */
double jlaw_max_stiffness(const jlaw_law *law, double closure);

/* The state in axes 2 and 3 that are turned by this angle (rad, from 2 to 3) about the normal. For a
 * host that cannot carry its axes with a body, and laws without a preferred direction (c = 0).
 * Shear and offset turn exactly. Sliders and flattened depths are read between the azimuths of
 * their ring of facets: exact where the angle is a whole number of azimuths of every ring, else
 * the better the more there are. Sliders gain no energy; what they lose counts as dissipated. In a
 * plane the axis keeps or changes its sense. */
void jlaw_rotate(const jlaw_law *law, double *s, double angle);
/* The state after the bodies changed their roles: axis 1 turned round, axis 2 kept, axis 3 turned
 * round with it. Shear along 2 changes its sign, along 3 not. Exact. */
void jlaw_swap_bodies(const jlaw_law *law, double *s);

/* Of the law that the tables were made for: a Python state of another fingerprint does not fit. */
const char *jlaw_fingerprint(const jlaw_law *law);

/* The tables, for files NAME.h; not for the host. LANES facets lie side by side in a block. */
#define JLAW_FORMAT 2 /* of table files */
enum {
  JLAW_LANES = 4,
  JLAW_M = 0, JLAW_S = 3, JLAW_T = 6, JLAW_N = 9, /* m = n/c1, s, t, n: 3 columns each */
  JLAW_A = 12, JLAW_STIFF = 13,    /* A; A/c1 */
  JLAW_STRENGTH = 14,              /* mu lam A */
  JLAW_COMPLIANCE = 15,            /* c1/(2 A lam): from |q|^2/kappa to energy */
  JLAW_SOFT = 16,                  /* 1/lam */
  JLAW_POTENTIAL = 17,             /* A c1 */
  JLAW_SHARE = 18, JLAW_MIRROR = 19, /* of all orientations; the facet mirrored along axis 2 */
  JLAW_RING = 20,                  /* facets of this inclination, one after the other */
  JLAW_USED = 21,                  /* cells that are not empty, most of the block */
  JLAW_YIELD = 22,                 /* y_p = d_y/c1 */
  JLAW_LATE = 23, /* unsheared joint: share, depth, share, depth of what yielding takes off */
  JLAW_COLUMNS = 27,
  JLAW_ROWS = 6, /* of a depth cell: zeta, Phi, Phi' at its begin; zeta at its end, G, kappa there */
  JLAW_AZIMUTHS = 512 /* most */
};
struct jlaw_law {
  int dim, facets, cells, pieces, yields, wears; /* pieces of the curve; 0 or 1 */
  double critical_slip;                     /* infinite: the largest float */
  double eta, scale, rise;                  /* of the virgin curve */
  double closure_factor, stiffness_factor;  /* normal stress over Phi, bound of |C| over Phi' */
  double largest_reach, stretch;            /* m; bound of |y| over that of the displacement */
  double farthest;                          /* m: largest closure that a stress is looked for in */
  double mu, mu_residual, wear_slip;        /* of asperities that wear */
  const double *facet;  /* (blocks, JLAW_COLUMNS, LANES); zeros beyond the last facet */
  const double *depth;  /* (blocks, cells, JLAW_ROWS, LANES) */
  const double *curve;  /* (pieces, 4): S of the virgin curve */
  const double *energy; /* (pieces, 4): T */
  double *own;          /* what jlaw_free frees */
  char fingerprint[80];
};

#ifdef __cplusplus
}
#endif
#endif

#if defined(JOINTLAW_IMPLEMENTATION) && !defined(JOINTLAW_IMPLEMENTED)
#define JOINTLAW_IMPLEMENTED
#ifdef __FAST_MATH__
#error "jointlaw.h: -ffast-math breaks the tests for NaN; take -fno-math-errno -fno-trapping-math"
#endif
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __cplusplus
extern "C" {
#endif
/* No fused operations here, whatever the flags */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off")
#endif

/* Four facets side by side in one vector, or (JOINTLAW_PLAIN, other compilers) one after the
 * other with the same bits. AVX2 or AVX-512 where the machine has it, found out at run time. */
#if defined(__GNUC__)
#define JLAW_INLINE static inline __attribute__((always_inline))
#define JLAW_APART static __attribute__((noinline))
#else
#define JLAW_INLINE static inline
#define JLAW_APART static
#endif
#if defined(__GNUC__) && !defined(JOINTLAW_PLAIN)
#pragma GCC diagnostic push /* all functions of vectors are inline */
#pragma GCC diagnostic ignored "-Wpsabi"
#define JLAW_WIDE 4
typedef double jlaw_v_ __attribute__((vector_size(32)));
typedef double jlaw_loose_ __attribute__((vector_size(32), aligned(8), may_alias));
typedef long long jlaw_mask_ __attribute__((vector_size(32)));
typedef int jlaw_whole_ __attribute__((vector_size(16)));
#define JLAW_LOAD(p) ((jlaw_v_) *(const jlaw_loose_ *) (p))
#define JLAW_AT(v, l) ((v)[l])
#define JLAW_LIST(a, b, c, d) {a, b, c, d}
#define JLAW_WHOLE(x) __builtin_convertvector(x, jlaw_whole_)
#define JLAW_DOUBLE(i) __builtin_convertvector(i, jlaw_v_)
#define JLAW_ABS(x) ((jlaw_v_) ((jlaw_mask_) (x) & 0x7FFFFFFFFFFFFFFFLL))
#define JLAW_PICK(m, a, b) ((jlaw_v_) (((m) & (jlaw_mask_) (a)) | (~(m) & (jlaw_mask_) (b))))
#else
#define JLAW_WIDE 1
typedef double jlaw_v_;
typedef int jlaw_mask_, jlaw_whole_;
#define JLAW_LOAD(p) (*(p))
#define JLAW_AT(v, l) (v)
#define JLAW_LIST(a, b, c, d) a
#define JLAW_WHOLE(x) ((int) (x))
#define JLAW_DOUBLE(i) ((double) (i))
#define JLAW_ABS(x) fabs(x)
#define JLAW_PICK(m, a, b) ((m) ? (a) : (b))
#endif
#define JLAW_W(column) JLAW_LOAD(w + (column) * JLAW_LANES) /* of the facets w */
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__OPTIMIZE__) && !defined(__AVX2__) \
    && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && !defined(JOINTLAW_PLAIN)
#define JLAW_CLONES __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define JLAW_CLONES
#endif

/* The thresholds of kernels/reference.py */
#define JLAW_UNDERFLOW 1e-140 /* m: counts as zero */
#define JLAW_TINY 1e-290      /* a stiffness whose reciprocal might overflow: zero */
#define JLAW_LEAST 1e-300     /* lost in any stiffness or force but 0: no division by 0 */
#define JLAW_NEAR 1e-5        /* of y: below such a change the chord is lost in rounding */
#define JLAW_GRAZING 1e-12    /* cosine at which the offset meets its limit */
#define JLAW_LIMIT 1e-9       /* of the friction limit: a slider this close is at it */
#define JLAW_ROUNDED 1e-12    /* of Phi, and of y: as much may be lost in rounding */

/* ------------------------------------------------------------------ messages */

typedef struct { char *to; size_t size, at; } jlaw_text_;

static void jlaw_say_(jlaw_text_ *text, const char *words)
{
  for (; *words && text->at + 1 < text->size; words++) text->to[text->at++] = *words;
  if (text->size) text->to[text->at] = 0;
}

/* A number to five digits, without stdio and its locale */
static void jlaw_say_number_(jlaw_text_ *text, double x)
{
  char digits[24];
  int exponent = 0, n = 0;
  if (x != x) { jlaw_say_(text, "nan"); return; }
  if (x < 0.0) { jlaw_say_(text, "-"); x = -x; }
  if (x > DBL_MAX) { jlaw_say_(text, "inf"); return; }
  while (x >= 10.0) { x /= 10.0; exponent++; }
  while (x > 0.0 && x < 1.0) { x *= 10.0; exponent--; }
  x += 0.00005;
  if (x >= 10.0) { x /= 10.0; exponent++; }
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

/* -------------------------------------------------------------- virgin curve */

JLAW_INLINE void jlaw_root_(jlaw_v_ *x)
{
  for (int l = 0; l < JLAW_WIDE; l++) JLAW_AT(*x, l) = sqrt(JLAW_AT(*x, l));
}
JLAW_INLINE void jlaw_at_least_(jlaw_v_ *x, const jlaw_v_ *y) { *x = JLAW_PICK(*x > *y, *x, *y); }
JLAW_INLINE void jlaw_at_most_(jlaw_v_ *x, const jlaw_v_ *y) { *x = JLAW_PICK(*x < *y, *x, *y); }

typedef double jlaw_lanes_[JLAW_WIDE];
typedef struct { jlaw_lanes_ y, power, S, DS, DDS; } jlaw_lift_;

/* y^eta for any eta, and S that is tabulated over w^rise */
JLAW_APART void jlaw_lift_up_(const jlaw_law *law, jlaw_lift_ *to)
{
  const double W = law->scale * law->scale;
  for (int l = 0; l < JLAW_WIDE; l++) {
    const double y = to->y[l], w = y / (y + W), more = law->rise * W / (y + W);
    const double S = to->S[l], DS = to->DS[l], up = y > 0.0 ? pow(w, law->rise) : 0.0;
    if (law->rise > 0.0) {
      to->DDS[l] = up * (to->DDS[l] + 2.0 * more * DS + (more * more - more * w) * S);
      to->DS[l] = up * (DS + more * S);
      to->S[l] = up * S;
    }
    if (law->eta == 0.0) to->power[l] = y > 0.0 ? 1.0 : 0.0;
    else if (law->eta != 0.5) to->power[l] = y > 0.0 ? pow(y, law->eta) : 0.0;
  }
}

/* Phi and Phi' at y, and Phi'' if asked; zero where y <= 0. What counts as zero becomes zero. */
JLAW_INLINE void jlaw_virgin_(const jlaw_law *law, jlaw_v_ *y, jlaw_v_ *force, jlaw_v_ *slope,
                              jlaw_v_ *bend)
{
  const double pieces = law->pieces, scale = law->scale, eta = law->eta;
  const double *curve = law->curve;
  const jlaw_v_ zero = {0.0}, top = zero + (pieces - 1.0);
  *y = JLAW_PICK(JLAW_ABS(*y) >= JLAW_UNDERFLOW, *y, zero);
  const jlaw_v_ here = JLAW_PICK(*y > 0.0, *y, zero);
  jlaw_v_ v = here;
  jlaw_root_(&v);
  const jlaw_v_ r = 1.0 / (v + scale);
  jlaw_v_ x = v * r * pieces, bound = x;
  jlaw_at_most_(&bound, &top);
  const jlaw_whole_ at = JLAW_WHOLE(bound);
  x = x - JLAW_DOUBLE(at);
  const double *c[JLAW_LANES];
  for (int l = 0; l < JLAW_WIDE; l++) c[l] = curve + 4 * JLAW_AT(at, l);
  const jlaw_v_ c0 = JLAW_LIST(c[0][0], c[1][0], c[2][0], c[3][0]);
  const jlaw_v_ c1 = JLAW_LIST(c[0][1], c[1][1], c[2][1], c[3][1]);
  const jlaw_v_ c2 = JLAW_LIST(c[0][2], c[1][2], c[2][2], c[3][2]);
  const jlaw_v_ c3 = JLAW_LIST(c[0][3], c[1][3], c[2][3], c[3][3]);
  const jlaw_v_ ts = v * r * r * scale; /* t (1 - t) */
  jlaw_v_ S = c0 + x * (c1 + x * (c2 + x * c3)), DDS = zero, power = v;
  jlaw_v_ DS = 0.5 * ts * (pieces * (c1 + x * (2.0 * c2 + x * (3.0 * c3))));
  if (bend)
    DDS = 0.25 * ts * ts * (pieces * pieces * (2.0 * c2 + x * (6.0 * c3)))
          + 0.5 * (scale - v) * r * DS;
  if (eta != 0.5 || law->rise > 0.0) {
    jlaw_lift_ to;
    for (int l = 0; l < JLAW_WIDE; l++) {
      to.y[l] = JLAW_AT(here, l), to.power[l] = JLAW_AT(v, l), to.S[l] = JLAW_AT(S, l);
      to.DS[l] = JLAW_AT(DS, l), to.DDS[l] = JLAW_AT(DDS, l);
    }
    jlaw_lift_up_(law, &to);
    power = JLAW_LOAD(to.power), S = JLAW_LOAD(to.S), DS = JLAW_LOAD(to.DS), DDS = JLAW_LOAD(to.DDS);
  }
  *force = power * here * S;
  *slope = power * ((1.0 + eta) * S + DS);
  if (bend)
    *bend = power / JLAW_PICK(*y > 0.0, *y, zero + 1.0)
            * (eta * (1.0 + eta) * S + (1.0 + 2.0 * eta) * DS + DDS);
}

/* Phi and Phi' at one y */
static double jlaw_virgin_one_(const jlaw_law *law, double y, double *slope)
{
  const jlaw_v_ zero = {0.0};
  jlaw_v_ at = zero + y, force, slopes;
  jlaw_virgin_(law, &at, &force, &slopes, NULL);
  *slope = JLAW_AT(slopes, 0);
  return JLAW_AT(force, 0);
}

/* Psi, the integral of Phi, at one y */
static double jlaw_psi_(const jlaw_law *law, double y)
{
  if (!(y >= JLAW_UNDERFLOW)) return 0.0;
  const double v = sqrt(y), place = v / (v + law->scale) * law->pieces, top = law->pieces - 1.0;
  const int at = (int) (place < top ? place : top);
  const double x = place - at, *c = law->energy + 4 * at;
  double T = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
  if (law->rise > 0.0) T *= pow(y / (y + law->scale * law->scale), law->rise);
  return T * y * y * (law->eta == 0.5 ? v : pow(y, law->eta));
}

/* ------------------------------------------------------------------ one step */

typedef struct {
  double p[3], from[3], to[3]; /* increment; closure and in-plane offset before and after */
  double J[4], slip;           /* d offset/d p; way along the offset at its limit */
  double worn, since;          /* friction now over that of unworn asperities, of the last step */
} jlaw_move_;

typedef struct { /* what the blocks add up to, lane by lane */
  jlaw_v_ F[3][JLAW_LANES / JLAW_WIDE], C[9][JLAW_LANES / JLAW_WIDE];
  jlaw_v_ pull[2][JLAW_LANES / JLAW_WIDE], lost[JLAW_LANES / JLAW_WIDE];
  jlaw_v_ crushed[JLAW_LANES / JLAW_WIDE], normal[JLAW_LANES / JLAW_WIDE]; /* plastic work; A Phi */
} jlaw_sum_;

typedef struct { /* facets side by side */
  jlaw_v_ y0, y1, f0, f1, k0, k1, es, et, bend; /* y, Phi, Phi'; de; Phi'' */
  jlaw_v_ qs, qt, lost, vs, vt, bss, bst, btt;  /* sums over the cells: q, loss, v and B of C */
  jlaw_v_ z0, z1, fz0, fz1, kz0, kz1;           /* flattened depth, Phi and Phi' there */
  jlaw_v_ ws, wt, open;                         /* sums of the softening by z1; any kappa */
} jlaw_facets_;

/* x between bounds; fmin and fmax would be calls of a library, for the sake of NaN */
JLAW_INLINE double jlaw_within_(double x, double least, double most)
{
  return x > least ? (x < most ? x : most) : least;
}

/* Moves the offset by p, dragged along where it is at its limit: "Large shear". J for a tangent */
JLAW_INLINE void jlaw_limit_offset_(const jlaw_law *law, jlaw_move_ *m, int tangent)
{
  const double D = law->critical_slip, p0 = m->p[1], p1 = m->p[2];
  double a0 = m->from[1], a1 = m->from[2];
  m->to[1] = a0 + p0, m->to[2] = a1 + p1;
  m->slip = m->J[1] = m->J[2] = 0.0;
  m->J[0] = m->J[3] = 1.0;
  if (D == DBL_MAX) return;
  if (!(m->to[1] * m->to[1] + m->to[2] * m->to[2] > D * D)
      || !(m->to[1] * p0 + m->to[2] * p1 > 0.0)) return;
  const double length = hypot(p0, p1), e0 = p0 / length, e1 = p1 / length;
  const double along = a0 * e0 + a1 * e1;
  const double before = D * D - (a0 * a0 + a1 * a1) + along * along;
  const double inside = jlaw_within_(sqrt(before > 0.0 ? before : 0.0) - along, 0.0, length);
  a0 += inside * e0, a1 += inside * e1;
  const double x = (length - inside) / D, decay = exp(-x);
  const double cosine = jlaw_within_((a0 * e0 + a1 * e1) / D, 0.0, 1.0);
  const double sine = (a1 * e0 - a0 * e1) / D;
  const double bottom = (1.0 + cosine) + (1.0 - cosine) * decay * decay;
  const double cos1 = ((1.0 + cosine) - (1.0 - cosine) * decay * decay) / bottom;
  const double sin1 = 2.0 * sine * decay / bottom;
  m->to[1] = D * (cos1 * e0 - sin1 * e1), m->to[2] = D * (cos1 * e1 + sin1 * e0);
  m->slip = D * (x + log(bottom / 2.0));
  if (!tangent) return;
  const double rest = -expm1(-x);
  double turn = (rest * rest + cosine * rest * (1.0 + decay)) / bottom;
  turn += inside / (D * fmax(cosine, JLAW_GRAZING)) * (2.0 * decay / bottom - sin1 * sine);
  turn /= length;
  const int turns = law->dim == 3; /* along one line the offset does not turn */
  const double row0 = turns ? -turn * e1 - sin1 / D * e0 : 0.0;
  const double row1 = turns ? turn * e0 - sin1 / D * e1 : 0.0;
  m->J[0] = -m->to[2] * row0, m->J[1] = -m->to[2] * row1;
  m->J[2] = m->to[1] * row0, m->J[3] = m->to[1] * row1;
}

/* Share of a depth cell in Phi, and its slope. z: zeta, Phi, Phi' at the lower limit; zeta at the
 * upper, and G and kappa from there on. */
JLAW_INLINE void jlaw_cell_(const jlaw_v_ *y, const jlaw_v_ *force, const jlaw_v_ *slope,
                            const jlaw_v_ z[JLAW_ROWS], jlaw_v_ *G, jlaw_v_ *kappa)
{
  const jlaw_v_ zero = {0.0}, low = *y - z[0], high = *y - z[3];
  jlaw_v_ g = JLAW_PICK(high > 0.0, z[4] + z[5] * high, *force - z[1] - z[2] * low);
  jlaw_v_ k = JLAW_PICK(high > 0.0, z[5], *slope - z[2]);
  k = JLAW_PICK((low > 0.0) & (k > 0.0), k, zero);
  const jlaw_v_ most = k * low;
  jlaw_at_most_(&g, &most);
  jlaw_at_least_(&g, &zero);
  *G = g;
  *kappa = k;
}

/* The same less what the cell holds, H, at the flattened depth: "Yielding" */
JLAW_INLINE void jlaw_flatten_(const jlaw_v_ *y, const jlaw_v_ *depth, const jlaw_v_ *H, jlaw_v_ *G,
                               jlaw_v_ *kappa)
{
  const jlaw_v_ zero = {0.0}, over = *y - *depth, k = JLAW_PICK(over > 0.0, *kappa, zero);
  const jlaw_v_ most = k * over;
  jlaw_v_ g = *G - *H;
  jlaw_at_most_(&g, &most);
  jlaw_at_least_(&g, &zero);
  *G = g;
  *kappa = k;
}

typedef struct { /* sliders of one depth cell of facets side by side */
  jlaw_v_ G0, G1, k0, k1, reached;   /* G and kappa; G at the new y before springs yield there */
  jlaw_v_ dy, chord, now, strength;  /* of y; of G; kappa of what was added; mu lam A */
  jlaw_v_ ts, tt, size, cap, share;  /* trial force, friction limit, cap/size or 1 */
  jlaw_v_ kz1;                       /* kappa at the flattened depth */
  jlaw_mask_ grows, near;
} jlaw_slider_;

/* G and kappa of a cell before and after the step; springs yield at the new y at once */
JLAW_INLINE void jlaw_cells_(const double *limits, const jlaw_facets_ *f, jlaw_slider_ *s,
                             int yields)
{
  jlaw_v_ z[JLAW_ROWS], H0, H1, kz0, k;
  for (int i = 0; i < JLAW_ROWS; i++) z[i] = JLAW_LOAD(limits + i * JLAW_LANES);
  jlaw_cell_(&f->y0, &f->f0, &f->k0, z, &s->G0, &s->k0);
  jlaw_cell_(&f->y1, &f->f1, &f->k1, z, &s->G1, &s->k1);
  s->reached = s->G1, k = s->k1;
  if (!yields) return;
  jlaw_cell_(&f->z0, &f->fz0, &f->kz0, z, &H0, &kz0);
  jlaw_cell_(&f->z1, &f->fz1, &f->kz1, z, &H1, &s->kz1);
  jlaw_flatten_(&f->y0, &f->z0, &H0, &s->G0, &s->k0);
  jlaw_flatten_(&f->y1, &f->z0, &H0, &s->reached, &k);
  jlaw_flatten_(&f->y1, &f->z1, &H1, &s->G1, &s->k1);
}

/* Friction has fallen: sliders come back to their limit, and lose what they held beyond it */
JLAW_INLINE void jlaw_wear_(const jlaw_slider_ *s, double since, jlaw_v_ *qs, jlaw_v_ *qt,
                            jlaw_v_ *lost)
{
  const jlaw_v_ zero = {0.0}, one = zero + 1.0, size2 = *qs * *qs + *qt * *qt;
  const jlaw_v_ cap = s->strength * s->G0;
  const jlaw_mask_ stiff = s->k0 > JLAW_TINY;
  const jlaw_v_ back = JLAW_PICK(size2 > cap * cap, zero + since, one);
  const jlaw_v_ gone = (1.0 - back) * (1.0 + back) * size2;
  *lost += JLAW_PICK(stiff, gone / JLAW_PICK(stiff, s->k0, one), zero);
  *qs = back * *qs, *qt = back * *qt;
}

/* "The tangent": J_q = beta (I - s s^T) E + v g^T of sliders */
JLAW_INLINE void jlaw_slide_tangent_(const double *w, const double *limits, const jlaw_slider_ *s,
                                     jlaw_facets_ *f, int yields)
{
  const jlaw_v_ zero = {0.0}, one = zero + 1.0, a = JLAW_W(JLAW_STIFF);
  const jlaw_v_ begin = JLAW_LOAD(limits), end = JLAW_LOAD(limits + 3 * JLAW_LANES);
  const jlaw_v_ bend = JLAW_PICK((f->y1 > begin) & (f->y1 < end), f->bend, zero);
  const jlaw_v_ slope = (s->k1 - s->chord) / JLAW_PICK(s->near, one, s->dy);
  const jlaw_v_ chord1 = JLAW_PICK(s->near, 0.5 * bend, slope);
  const jlaw_mask_ stiff = s->k1 > JLAW_TINY;
  const jlaw_v_ fade = JLAW_PICK(stiff, bend / JLAW_PICK(stiff, s->k1, one), zero);
  /* where rounding would decide: what did not close has not grown, what is at its limit slips */
  const jlaw_mask_ stiffer = s->grows & (s->dy > JLAW_ROUNDED * JLAW_ABS(f->y1));
  const jlaw_v_ least = s->strength * (s->G1 * (1.0 - JLAW_LIMIT) - JLAW_ROUNDED * f->f1);
  const jlaw_mask_ slips = s->size >= least;
  const jlaw_v_ unit = 1.0 / JLAW_PICK(s->size > 0.0, s->size, one);
  const jlaw_v_ us = s->ts * unit, ut = s->tt * unit;
  const jlaw_v_ vs = JLAW_PICK(stiffer, a * chord1 * f->es, fade * s->ts);
  const jlaw_v_ vt = JLAW_PICK(stiffer, a * chord1 * f->et, fade * s->tt);
  const jlaw_v_ dot = us * vs + ut * vt, push = s->strength * s->k1;
  const jlaw_v_ beta = JLAW_PICK(s->cap > 0.0, s->share * (a * s->now), zero);
  const jlaw_v_ along = JLAW_PICK(slips, beta, zero);
  f->vs += JLAW_PICK(slips, s->share * (vs - us * dot) + push * us, vs);
  f->vt += JLAW_PICK(slips, s->share * (vt - ut * dot) + push * ut, vt);
  f->bss += beta - along * us * us;
  f->bst -= along * us * ut;
  f->btt += beta - along * ut * ut;
  if (yields) {
    const jlaw_v_ pull = s->strength * JLAW_PICK(slips & (s->k1 > 0.0), s->kz1, zero);
    f->ws += pull * us, f->wt += pull * ut;
    f->open = f->open + s->k1;
  }
}

/* One depth cell of facets: load, friction limit, loss, tangent; q: sliders before and after */
JLAW_INLINE void jlaw_slide_(const double *w, const double *limits, const jlaw_move_ *m,
                             jlaw_facets_ *f, jlaw_v_ *qs, jlaw_v_ *qt, int yields, int wears,
                             int ledger, int tangent)
{
  const jlaw_v_ zero = {0.0}, one = zero + 1.0, a = JLAW_W(JLAW_STIFF);
  jlaw_slider_ s;
  jlaw_cells_(limits, f, &s, yields);
  const jlaw_v_ k0 = s.k0, k1 = s.k1;
  s.strength = JLAW_W(JLAW_STRENGTH);
  if (wears) {
    s.strength = s.strength * m->worn;
    jlaw_wear_(&s, m->since, qs, qt, &f->lost);
  }
  /* trial force: by the chord where stiffness grows, scaled down where it falls */
  s.dy = f->y1 - f->y0;
  s.grows = k1 > k0;
  s.near = JLAW_ABS(s.dy) <= JLAW_NEAR * JLAW_ABS(f->y1);
  if (yields) s.near = s.near & ((k0 > 0.0) | (k1 <= 0.0)); /* flattened springs touch all at once */
  const jlaw_v_ top = JLAW_PICK(s.grows, s.reached - s.G0, k1);
  const jlaw_v_ ratio = top / JLAW_PICK(s.grows, s.dy, k0 + JLAW_LEAST);
  s.chord = JLAW_PICK(s.near, 0.5 * (k0 + k1), ratio);
  jlaw_at_least_(&s.chord, &k0);
  jlaw_at_most_(&s.chord, &k1);
  s.now = JLAW_PICK(s.grows, s.chord, k1);
  const jlaw_v_ kept = JLAW_PICK(s.grows, one, ratio), add = a * s.now;
  const jlaw_v_ old2 = *qs * *qs + *qt * *qt;
  s.ts = *qs * kept + add * f->es, s.tt = *qt * kept + add * f->et;
  /* friction: |q| <= mu lam A G */
  const jlaw_v_ new2 = s.ts * s.ts + s.tt * s.tt;
  s.size = new2, s.cap = s.strength * s.G1;
  jlaw_root_(&s.size);
  jlaw_v_ whole = s.size;
  jlaw_at_least_(&whole, &s.cap);
  s.share = s.cap / (whole + JLAW_LEAST);
  const jlaw_v_ part = JLAW_PICK(new2 > JLAW_TINY, s.share, zero);
  *qs = part * s.ts, *qt = part * s.tt;
  f->qs += *qs, f->qt += *qt;
  if (ledger) { /* "No step creates energy": each factor is >= 0 as written */
    const jlaw_v_ high = JLAW_PICK(s.grows, s.chord, k0), low = JLAW_PICK(s.grows, k0, k1);
    const jlaw_v_ k01 = k0 * high, k11 = k1 * s.now;
    const jlaw_v_ rub = k1 - s.now + 2.0 * s.share * (1.0 - s.share) * s.now;
    f->lost += JLAW_PICK(k01 > JLAW_TINY, old2 * ((high - low) / k01), zero)
               + JLAW_PICK(k11 > JLAW_TINY, new2 * (rub / k11), zero);
  }
  if (tangent) jlaw_slide_tangent_(w, limits, &s, f, yields);
}

/* C += along g^T + E^T B E of facets; where the flattened depth moves less softening g_z^T */
JLAW_INLINE void jlaw_add_tangent_(const double *w, const jlaw_move_ *m, const jlaw_facets_ *f,
                                   jlaw_sum_ *sum, int at, int dim, int yields)
{
  const jlaw_v_ zero = {0.0}, soft = JLAW_W(JLAW_SOFT), stiff = JLAW_W(JLAW_A) * f->k1;
  const jlaw_mask_ moves = (f->z1 > f->z0) & (f->open > 0.0);
  const jlaw_mask_ own = f->z1 <= f->y1 - JLAW_W(JLAW_YIELD); /* or the opposite facet presses */
  for (int i = 0; i < dim; i++) {
    const jlaw_v_ n = JLAW_W(JLAW_N + i), s = JLAW_W(JLAW_S + i), t = JLAW_W(JLAW_T + i);
    const jlaw_v_ along = stiff * n + soft * (s * f->vs + t * f->vt);
    const jlaw_v_ left = soft * (s * f->bss + t * f->bst), right = soft * (s * f->bst + t * f->btt);
    jlaw_v_ less = zero;
    if (yields)
      less = JLAW_PICK(moves, JLAW_W(JLAW_A) * f->kz1 * n + soft * (s * f->ws + t * f->wt), zero);
    for (int j = 0; j < dim; j++) {
      jlaw_v_ g = JLAW_W(JLAW_M); /* dy/dd */
      if (j > 0) g = JLAW_W(JLAW_M + 1) * m->J[j - 1] + JLAW_W(JLAW_M + 2) * m->J[j + 1];
      sum->C[3 * i + j][at] += along * g + left * JLAW_W(JLAW_S + j) + right * JLAW_W(JLAW_T + j);
      if (yields) sum->C[3 * i + j][at] -= j > 0 ? less * JLAW_PICK(own, g, -g) : less * g;
    }
  }
}

/* The lanes of a block in an array of numbers per facet. Lanes beyond the last facet have zeros
 * in all tables; they read its number, and what they write is written over by it. */
JLAW_INLINE void jlaw_take_(const double *from, const size_t at[JLAW_LANES], jlaw_v_ *x)
{
  const jlaw_v_ all = JLAW_LIST(from[0], from[at[1]], from[at[2]], from[at[3]]);
  (void) at; /* one lane does without */
  *x = all;
}
JLAW_INLINE void jlaw_put_(double *to, const size_t at[JLAW_LANES], const jlaw_v_ *x)
{
  for (int l = JLAW_WIDE - 1; l >= 0; l--) to[at[l]] = JLAW_AT(*x, l);
}

/* Flattened depths of facets, before and after the step, and the virgin curve there */
JLAW_INLINE void jlaw_press_(const jlaw_law *law, const double *w, const jlaw_move_ *m,
                             const size_t lanes[JLAW_LANES], const double *from, double *to,
                             jlaw_facets_ *f)
{
  const jlaw_v_ zero = {0.0};
  jlaw_v_ y = f->y1, deeper;
  jlaw_take_(from, lanes, &f->z0);
  if (law->critical_slip < DBL_MAX) { /* one depth for a facet and its opposite */
    y = JLAW_W(JLAW_M) * m->to[0] - (JLAW_W(JLAW_M + 1) * m->to[1] + JLAW_W(JLAW_M + 2) * m->to[2]);
    jlaw_at_least_(&y, &f->y1);
  }
  f->z1 = y - JLAW_W(JLAW_YIELD);
  jlaw_at_least_(&f->z1, &f->z0);
  jlaw_virgin_(law, &f->z0, &f->fz0, &f->kz0, NULL);
  f->fz1 = f->fz0, f->kz1 = f->kz0;
  deeper = JLAW_PICK(f->z1 > f->z0, zero + 1.0, zero);
  int moves = 0;
  for (int l = 0; l < JLAW_WIDE; l++) moves += JLAW_AT(deeper, l) > 0.0;
  if (moves) jlaw_virgin_(law, &f->z1, &f->fz1, &f->kz1, NULL);
  jlaw_put_(to, lanes, &f->z1);
}

/* Phi less its value at the flattened depth */
JLAW_INLINE void jlaw_less_flat_(const jlaw_v_ *y, const jlaw_v_ *depth, const jlaw_v_ *less,
                               jlaw_v_ *force, jlaw_v_ *slope)
{
  const jlaw_v_ zero = {0.0};
  jlaw_v_ left = *force - *less;
  jlaw_at_least_(&left, &zero);
  *force = JLAW_PICK(*y > *depth, left, zero);
  *slope = JLAW_PICK(*y > *depth, *slope, zero);
}

/* Plastic work of facets, over A c1: exact where they press themselves flat */
JLAW_INLINE void jlaw_crush_(const double *w, const jlaw_facets_ *f, jlaw_v_ *work)
{
  const jlaw_v_ zero = {0.0}, most = JLAW_W(JLAW_YIELD);
  jlaw_v_ c0 = f->y0 - f->z0, c1 = f->y1 - f->z1;
  jlaw_at_least_(&c0, &zero), jlaw_at_most_(&c0, &most);
  jlaw_at_least_(&c1, &zero), jlaw_at_most_(&c1, &most);
  *work = JLAW_PICK(f->y1 - most >= f->z1, most, 0.5 * (c0 + c1)) * (f->fz1 - f->fz0);
}

/* Facets from number `first` on: y before and after, virgin curve, cells, and their part of F, C */
JLAW_INLINE void jlaw_add_facets_(const jlaw_law *law, int first, const jlaw_move_ *m,
                                  const double *s0, double *s1, jlaw_sum_ *sum, int dim, int yields,
                                  int wears, int ledger, int tangent)
{
  const int D = law->cells, lane = first % JLAW_LANES, at = lane / JLAW_WIDE;
  const size_t block = (size_t) first / JLAW_LANES, other = (size_t) law->facets * (size_t) D;
  const size_t rest = 2 * (size_t) law->dim + 2 * other; /* other: from q_s to q_t of a slider */
  const double *w = law->facet + block * JLAW_COLUMNS * JLAW_LANES + lane;
  const double *z = law->depth + block * (size_t) D * JLAW_ROWS * JLAW_LANES + lane;
  const double *qs0 = s0 + 2 * law->dim + (size_t) first * (size_t) D, *qt0 = qs0 + other;
  double *qs1 = s1 + 2 * law->dim + (size_t) first * (size_t) D, *qt1 = qs1 + other;
  const jlaw_v_ zero = {0.0};
  size_t lanes[JLAW_LANES], places[JLAW_LANES];
  for (int l = 0; l < JLAW_LANES; l++) {
    lanes[l] = (size_t) (first + l < law->facets ? l : law->facets - 1 - first);
    places[l] = lanes[l] * (size_t) D;
  }
  jlaw_facets_ f = {zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero,
                    zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero};
  for (int i = 0; i < dim; i++) {
    f.y0 += JLAW_W(JLAW_M + i) * m->from[i], f.y1 += JLAW_W(JLAW_M + i) * m->to[i];
    f.es += JLAW_W(JLAW_S + i) * m->p[i];
    if (i > 0) f.et += JLAW_W(JLAW_T + i) * m->p[i];
  }
  jlaw_virgin_(law, &f.y0, &f.f0, &f.k0, NULL);
  jlaw_virgin_(law, &f.y1, &f.f1, &f.k1, tangent ? &f.bend : NULL);
  if (yields)
    jlaw_press_(law, w, m, lanes, s0 + rest + first, s1 + rest + first, &f);
  const int used = (int) w[JLAW_USED * JLAW_LANES];
  for (int i = 0; i < D; i++, qs0++, qt0++, qs1++, qt1++, z += JLAW_ROWS * JLAW_LANES) {
    jlaw_v_ qs = zero, qt = zero;
    jlaw_take_(qs0, places, &qs), jlaw_take_(qt0, places, &qt);
    if (i < used) jlaw_slide_(w, z, m, &f, &qs, &qt, yields, wears, ledger, tangent);
    jlaw_put_(qs1, places, &qs), jlaw_put_(qt1, places, &qt);
  }
  if (yields) {
    jlaw_v_ work;
    jlaw_crush_(w, &f, &work);
    sum->crushed[at] += JLAW_W(JLAW_POTENTIAL) * work;
    jlaw_less_flat_(&f.y0, &f.z0, &f.fz0, &f.f0, &f.k0);
    jlaw_less_flat_(&f.y1, &f.z1, &f.fz1, &f.f1, &f.k1);
  }
  if (wears) sum->normal[at] += JLAW_W(JLAW_A) * (f.f0 + f.f1);
  const jlaw_v_ normal = JLAW_W(JLAW_A) * f.f1, soft = JLAW_W(JLAW_SOFT);
  for (int i = 0; i < dim; i++) {
    const jlaw_v_ pull = JLAW_W(JLAW_N + i) * normal;
    sum->F[i][at] += pull + soft * (JLAW_W(JLAW_S + i) * f.qs + JLAW_W(JLAW_T + i) * f.qt);
    if (i > 0 && ledger) sum->pull[i - 1][at] += pull;
  }
  if (ledger) sum->lost[at] += JLAW_W(JLAW_COMPLIANCE) * f.lost;
  if (tangent) jlaw_add_tangent_(w, m, &f, sum, at, dim, yields);
}

JLAW_INLINE double jlaw_total_(const jlaw_v_ *x)
{
  double lane[JLAW_LANES];
  for (int l = 0; l < JLAW_LANES; l++) lane[l] = JLAW_AT(x[l / JLAW_WIDE], l);
  return (lane[0] + lane[2]) + (lane[1] + lane[3]);
}

/* Whether all sliders hold forces that a law can have; not for NaN */
JLAW_INLINE int jlaw_sound_(const double *q, size_t n)
{
  const jlaw_v_ zero = {0.0};
  jlaw_v_ one = zero, two = zero;
  double sum = 0.0;
  size_t i = 0;
  for (; i + 2 * JLAW_WIDE <= n; i += 2 * JLAW_WIDE) {
    one += JLAW_LOAD(q + i) * JLAW_LOAD(q + i);
    two += JLAW_LOAD(q + i + JLAW_WIDE) * JLAW_LOAD(q + i + JLAW_WIDE);
  }
  if (i + JLAW_WIDE <= n) {
    one += JLAW_LOAD(q + i) * JLAW_LOAD(q + i);
    i += JLAW_WIDE;
  }
  for (; i < n; i++) sum += q[i] * q[i];
  one += two;
  for (int l = 0; l < JLAW_WIDE; l++) sum += JLAW_AT(one, l);
  return sum < 1e300;
}

/* The step; 0, or -1 where the sliders are damaged: nothing is written then */
JLAW_INLINE int jlaw_step_(const jlaw_law *law, const jlaw_move_ *m, const double *s0, double *s1,
                           double *F, double *C, int dim, int yields, int wears, int ledger,
                           int tangent)
{
  const int parts = law->dim; /* components that there are; those up to dim are zeros */
  const size_t M = (size_t) law->facets, sliders = 2 * M * (size_t) law->cells;
  const jlaw_v_ zero = {0.0};
  jlaw_sum_ sum;
  if (!jlaw_sound_(s0 + 2 * parts, sliders)) return -1;
  for (int at = 0; at < JLAW_LANES / JLAW_WIDE; at++) {
    sum.lost[at] = sum.pull[0][at] = sum.pull[1][at] = sum.crushed[at] = sum.normal[at] = zero;
    for (int i = 0; i < dim; i++) sum.F[i][at] = zero;
    for (int i = 0; tangent && i < 9; i++) sum.C[i][at] = zero;
  }
  for (int first = 0; first < law->facets; first += JLAW_WIDE)
    jlaw_add_facets_(law, first, m, s0, s1, &sum, dim, yields, wears, ledger, tangent);
  double lost = jlaw_total_(sum.lost);
  if (ledger && m->slip > 0.0) {
    const double along = jlaw_total_(sum.pull[0]) * m->to[1] + jlaw_total_(sum.pull[1]) * m->to[2];
    if (along > 0.0) lost += m->slip * along / law->critical_slip;
  }
  for (int i = 0; i < parts; i++) F[i] = jlaw_total_(sum.F[i]);
  for (int i = 0; tangent && i < parts; i++)
    for (int j = 0; j < parts; j++) C[parts * i + j] = jlaw_total_(sum.C[3 * i + j]);
  const double *rest0 = s0 + 2 * parts + sliders;
  double *rest1 = s1 + 2 * parts + sliders;
  if (wears) { /* slip of the asperities: the loss over the mean friction limit */
    const double limit = 0.5 * law->mu * m->worn * jlaw_total_(sum.normal);
    const size_t last = yields ? M + 1 : 0;
    rest1[last] = rest0[last] + (limit > 0.0 ? lost / limit : 0.0);
    rest1[last + 1] = law->mu - law->mu * m->worn;
  }
  if (yields) {
    rest1[M] = rest0[M] + jlaw_total_(sum.crushed);
    lost += jlaw_total_(sum.crushed);
  }
  lost += s0[2 * parts - 1];
  s1[2 * parts - 1] = lost;
  s1[0] = m->to[0];
  if (parts > 1) s1[1] = s0[1] + m->p[1], s1[parts] = m->to[1];
  if (parts > 2) s1[2] = s0[2] + m->p[2], s1[4] = m->to[2];
  return 0;
}

#ifdef JOINTLAW_NO_LEDGER
enum { JLAW_LEDGER = 0 };
#else
enum { JLAW_LEDGER = 1 };
#endif

/* Constants for the compiler: a plane costs half of space, and what is not asked for nothing */
JLAW_CLONES static int jlaw_advance_(const jlaw_law *law, const jlaw_move_ *m, const double *s0,
                                     double *s1, double *F, double *C)
{
  const int y = law->yields, w = law->wears;
  if (y || w) return jlaw_step_(law, m, s0, s1, F, C, 3, y, w, 1, C != NULL);
  if (law->dim == 3 && !C) return jlaw_step_(law, m, s0, s1, F, C, 3, 0, 0, JLAW_LEDGER, 0);
  if (law->dim == 3) return jlaw_step_(law, m, s0, s1, F, C, 3, 0, 0, JLAW_LEDGER, 1);
  if (!C) return jlaw_step_(law, m, s0, s1, F, C, 2, 0, 0, JLAW_LEDGER, 0);
  return jlaw_step_(law, m, s0, s1, F, C, 2, 0, 0, JLAW_LEDGER, 1);
}

/* First number after the sliders: flattened depths, plastic work; then slip of the asperities, and
   by how much their friction had fallen in the last step */
static size_t jlaw_rest_(const jlaw_law *law)
{
  return 2 * (size_t) law->dim + 2 * (size_t) law->facets * (size_t) law->cells;
}

static const double *jlaw_slip_(const jlaw_law *law, const double *s)
{
  return s + jlaw_rest_(law) + (law->yields ? law->facets + 1 : 0);
}

/* Whether energies, flattened depths and slip of a state are numbers that a law can have */
static int jlaw_proper_(const jlaw_law *law, const double *s)
{
  const double *rest = s + jlaw_rest_(law), *slip = jlaw_slip_(law, s);
  int good = fabs(s[2 * law->dim - 1]) <= DBL_MAX;
  for (int f = 0; law->yields && f < law->facets; f++)
    good = good && rest[f] >= 0.0 && rest[f] <= law->largest_reach;
  if (law->yields) good = good && fabs(rest[law->facets]) <= DBL_MAX;
  if (law->wears) good = good && slip[0] >= 0.0 && slip[0] <= DBL_MAX;
  if (law->wears) good = good && slip[1] >= 0.0 && slip[1] <= law->mu;
  return good;
}

/* Friction after the slip of the asperities, over that of unworn ones: "Wear" */
static double jlaw_worn_(const jlaw_law *law, const double *s)
{
  if (!law->wears || !(law->mu > 0.0)) return 1.0;
  const double mu = law->mu_residual + (law->mu - law->mu_residual) * exp(-*jlaw_slip_(law, s) / law->wear_slip);
  return mu / law->mu;
}

/* Friction over that of the last step, whose friction limits a state is within */
static double jlaw_since_(const jlaw_law *law, const double *s, double worn)
{
  const double last = law->wears ? law->mu - jlaw_slip_(law, s)[1] : 0.0, mu = law->mu * worn;
  return mu < last ? mu / last : 1.0;
}

static int jlaw_refuse_(const jlaw_law *law, const double *s, const double *d, int damaged,
                        char *message, size_t size)
{
  jlaw_text_ text = {message, size, 0};
  if (damaged) {
    jlaw_say_(&text, "the state holds numbers that are not finite or no forces of this law; nothing "
                     "was moved. Start from zeros or from a state that this law wrote");
    return -1;
  }
  jlaw_say_(&text, "the step d = (");
  int finite = 1;
  for (int i = 0; i < law->dim; i++) {
    jlaw_say_(&text, i ? ", " : "");
    jlaw_say_number_(&text, d[i]);
    finite = finite && fabs(d[i]) <= DBL_MAX;
  }
  if (!finite) {
    jlaw_say_(&text, ") m is not finite; nothing was moved. Look for the fault in the host's motion");
    return -1;
  }
  jlaw_say_(&text, ") m leads from closure ");
  jlaw_say_number_(&text, s[0]);
  jlaw_say_(&text, " m beyond the reach of ");
  jlaw_say_number_(&text, law->largest_reach);
  jlaw_say_(&text, " m, where forces overflow; nothing was moved. Take a smaller step");
  return -1;
}

int jlaw_update(const jlaw_law *law, const double *s0, double *s1, const double *d, double *F,
                double *C, char *message, size_t size)
{
  const int dim = law->dim;
  jlaw_move_ m;
  m.p[0] = d[0], m.p[1] = dim > 1 ? d[1] : 0.0, m.p[2] = dim > 2 ? d[2] : 0.0;
  m.from[0] = s0[0], m.from[1] = dim > 1 ? s0[dim] : 0.0, m.from[2] = dim > 2 ? s0[4] : 0.0;
  m.to[0] = s0[0] + d[0];
  m.worn = law->wears ? jlaw_worn_(law, s0) : 1.0;
  m.since = jlaw_since_(law, s0, m.worn);
  const double shear = (dim > 1 ? fabs(s0[1]) : 0.0) + (dim > 2 ? fabs(s0[2]) : 0.0);
  const double far = fabs(s0[0]) + fabs(m.from[1]) + fabs(m.from[2]) + shear;
  const double reach = law->stretch * (far + fabs(m.p[0]) + fabs(m.p[1]) + fabs(m.p[2]));
  const int damaged = !(far <= DBL_MAX) || !jlaw_proper_(law, s0); /* NaN stays in sums */
  if (damaged || !(reach <= law->largest_reach))
    return jlaw_refuse_(law, s0, d, damaged, message, size);
  jlaw_limit_offset_(law, &m, C != NULL);
  if (jlaw_advance_(law, &m, s0, s1, F, C)) return jlaw_refuse_(law, s0, d, 1, message, size);
  return 0;
}

/* ------------------------------------------------------------ what a state is */

int jlaw_dim(const jlaw_law *law) { return law->dim; }
int jlaw_state_size(const jlaw_law *law)
{
  return (int) jlaw_rest_(law) + (law->yields ? law->facets + 1 : 0) + 2 * law->wears;
}
const char *jlaw_fingerprint(const jlaw_law *law) { return law->fingerprint; }
double jlaw_dissipated(const jlaw_law *law, const double *s) { return s[2 * law->dim - 1]; }

static double jlaw_of_facet_(const jlaw_law *law, int facet, int column)
{
  const int block = facet / JLAW_LANES, lane = facet % JLAW_LANES;
  return law->facet[((size_t) block * JLAW_COLUMNS + (size_t) column) * JLAW_LANES + (size_t) lane];
}

typedef struct { /* facets side by side in a state: y, Phi, Phi'; flattened depth; strength */
  jlaw_v_ y, force, slope, z, fz, kz, strength;
  const double *w;             /* their tables */
  size_t places[JLAW_LANES];   /* of their sliders */
} jlaw_now_;

JLAW_INLINE void jlaw_facets_now_(const jlaw_law *law, const double *s, double worn, int first,
                                  jlaw_now_ *now)
{
  const jlaw_v_ zero = {0.0};
  const int lane = first % JLAW_LANES;
  const double *w = law->facet + (size_t) (first - lane) * JLAW_COLUMNS + lane;
  size_t lanes[JLAW_LANES];
  for (int l = 0; l < JLAW_LANES; l++) {
    lanes[l] = (size_t) (first + l < law->facets ? l : law->facets - 1 - first);
    now->places[l] = lanes[l] * (size_t) law->cells;
  }
  now->w = w;
  now->y = now->z = now->fz = now->kz = zero;
  for (int i = 0; i < law->dim; i++)
    now->y += JLAW_W(JLAW_M + i) * s[i ? law->dim + i - 1 : 0];
  jlaw_virgin_(law, &now->y, &now->force, &now->slope, NULL);
  if (law->yields) {
    jlaw_take_(s + jlaw_rest_(law) + first, lanes, &now->z);
    jlaw_virgin_(law, &now->z, &now->fz, &now->kz, NULL);
  }
  now->strength = JLAW_W(JLAW_STRENGTH) * worn;
}

/* G, kappa and slider of a cell of these facets */
JLAW_INLINE void jlaw_cell_now_(const jlaw_law *law, const double *s, int first, int cell,
                                const jlaw_now_ *now, jlaw_v_ *G, jlaw_v_ *kappa, jlaw_v_ *qs,
                                jlaw_v_ *qt)
{
  const size_t row = ((size_t) (first / JLAW_LANES) * (size_t) law->cells + (size_t) cell) * JLAW_ROWS;
  const double *q = s + 2 * law->dim + first * law->cells + cell;
  jlaw_v_ z[JLAW_ROWS], H, h;
  for (int j = 0; j < JLAW_ROWS; j++)
    z[j] = JLAW_LOAD(law->depth + (row + (size_t) j) * JLAW_LANES + first % JLAW_LANES);
  jlaw_cell_(&now->y, &now->force, &now->slope, z, G, kappa);
  if (law->yields) {
    jlaw_cell_(&now->z, &now->fz, &now->kz, z, &H, &h);
    jlaw_flatten_(&now->y, &now->z, &H, G, kappa);
  }
  jlaw_take_(q, now->places, qs), jlaw_take_(q + law->facets * law->cells, now->places, qt);
}

typedef struct { double normal, sheared, sliding, slipping, separated; } jlaw_measures_;

/* Energies of normal and shear springs, and the shares */
JLAW_CLONES static jlaw_measures_ jlaw_measure_(const jlaw_law *law, const double *s)
{
  jlaw_measures_ all = {0.0, 0.0, 0.0, 0.0, 0.0};
  const jlaw_v_ zero = {0.0}, one = zero + 1.0;
  const double worn = jlaw_worn_(law, s);
  for (int first = 0; first < law->facets; first += JLAW_WIDE) {
    jlaw_now_ now;
    jlaw_facets_now_(law, s, worn, first, &now);
    const double *w = now.w;
    jlaw_v_ sheared = zero, at_limit = zero, whole = one, G, kappa, qs = zero, qt = zero;
    for (int i = 0; i < law->cells; i++) {
      jlaw_cell_now_(law, s, first, i, &now, &G, &kappa, &qs, &qt);
      const jlaw_v_ q2 = qs * qs + qt * qt;
      jlaw_v_ size = q2;
      jlaw_root_(&size);
      const jlaw_v_ least = now.strength * (G * (1.0 - JLAW_LIMIT) - JLAW_ROUNDED * now.force);
      const jlaw_mask_ held = size >= least, stiff = kappa > JLAW_TINY;
      at_limit += JLAW_PICK(held, G, zero);
      whole = JLAW_PICK(held, whole, zero);
      sheared += JLAW_PICK(stiff, JLAW_W(JLAW_COMPLIANCE) * q2 / JLAW_PICK(stiff, kappa, one), zero);
    }
    for (int l = 0; l < JLAW_WIDE && first + l < law->facets; l++) {
      const double y = JLAW_AT(now.y, l), z = JLAW_AT(now.z, l), fz = JLAW_AT(now.fz, l);
      const double force = JLAW_AT(now.force, l) - fz, share = w[JLAW_SHARE * JLAW_LANES + l];
      if (!(y > z)) {
        all.separated += share;
        continue;
      }
      double normal = jlaw_psi_(law, y);
      if (law->yields) normal -= jlaw_psi_(law, z) + fz * (y - z);
      if (normal > 0.0) all.normal += w[JLAW_POTENTIAL * JLAW_LANES + l] * normal;
      all.sheared += JLAW_AT(sheared, l);
      if (force > 0.0) all.slipping += share * fmin(JLAW_AT(at_limit, l) / force, 1.0);
      if (JLAW_AT(whole, l) > 0.0) all.sliding += share;
    }
  }
  return all;
}

double jlaw_stored(const jlaw_law *law, const double *s)
{
  const jlaw_measures_ all = jlaw_measure_(law, s);
  return all.normal + all.sheared;
}

void jlaw_shares(const jlaw_law *law, const double *s, double shares[3])
{
  const jlaw_measures_ all = jlaw_measure_(law, s);
  shares[0] = all.sliding, shares[1] = all.slipping, shares[2] = all.separated;
}

/* ------------------------------------------------------------ unsheared joint */

double jlaw_normal_stress(const jlaw_law *law, double closure)
{
  double slope, late = 0.0;
  if (!(closure <= law->largest_reach)) return nan("");
  for (int f = 0; law->yields && f < law->facets; f++) /* what yielding takes off first loading */
    for (int i = JLAW_LATE; i < JLAW_LATE + 4; i += 2) {
      const double depth = jlaw_of_facet_(law, f, i + 1);
      late += jlaw_of_facet_(law, f, i) * jlaw_virgin_one_(law, closure - depth, &slope);
    }
  return law->closure_factor * jlaw_virgin_one_(law, closure, &slope) - late;
}

double jlaw_max_stiffness(const jlaw_law *law, double closure)
{
  double slope;
  if (!(closure <= law->largest_reach)) return nan("");
  jlaw_virgin_one_(law, closure, &slope);
  return law->stiffness_factor * slope;
}

double jlaw_closure(const jlaw_law *law, double normal_stress)
{
  double low = 0.0, high = law->farthest;
  if (!(normal_stress >= 0.0) || !(jlaw_normal_stress(law, high) >= normal_stress)) return nan("");
  while (1) { /* the stress rises: halve the exponent first, then the number */
    const double middle = high > 4.0 * low && high > 1e-300 ? sqrt(high * fmax(low, 1e-300))
                                                            : 0.5 * (low + high);
    if (!(middle > low && middle < high)) return low == 0.0 ? 0.0 : high;
    if (jlaw_normal_stress(law, middle) < normal_stress) low = middle;
    else high = middle;
  }
}

/* --------------------------------------------------------------- turned axes */

void jlaw_swap_bodies(const jlaw_law *law, double *s)
{
  const int dim = law->dim, D = law->cells, M = law->facets;
  for (int i = 1; i < 2 * dim - 1; i += dim - 1) s[i] = -s[i]; /* shear and offset along axis 2 */
  double *qs = s + 2 * dim, *qt = qs + M * D, *depth = qt + M * D;
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
static void jlaw_turn_(double *x, int n, int step, double angle, int straight)
{
  double old[JLAW_AZIMUTHS];
  const double pi = 3.14159265358979323846;
  for (int j = 0; j < n; j++) old[j] = x[j * step], x[j * step] = 0.0;
  for (int j = 0; j < n; j++)
    for (int k = 0; k < n; k++) {
      const double way = remainder(angle + 2.0 * pi * (j - k) / n, 2.0 * pi), half = sin(0.5 * way);
      double weight = 1.0;
      if (straight) weight = fmax(1.0 - fabs(way) * n / (2.0 * pi), 0.0);
      else if (fabs(half) > 1e-9) weight = sin(0.5 * n * way) * cos(0.5 * way) / (n * half);
      x[j * step] += weight * old[k];
    }
}

/* Brings sliders beyond their friction limit back to it */
static void jlaw_hold_(const jlaw_law *law, double *s)
{
  const jlaw_v_ zero = {0.0}, one = zero + 1.0;
  const double worn = jlaw_worn_(law, s);
  for (int first = 0; first < law->facets; first += JLAW_WIDE) {
    double *q = s + 2 * law->dim + first * law->cells;
    jlaw_now_ now;
    jlaw_facets_now_(law, s, worn, first, &now);
    for (int i = 0; i < law->cells; i++) {
      jlaw_v_ G, kappa, qs = zero, qt = zero;
      jlaw_cell_now_(law, s, first, i, &now, &G, &kappa, &qs, &qt);
      const jlaw_v_ cap = now.strength * G;
      jlaw_v_ size = qs * qs + qt * qt;
      jlaw_root_(&size);
      const jlaw_mask_ beyond = size > cap;
      const jlaw_v_ share = JLAW_PICK(beyond, cap / JLAW_PICK(beyond, size, one), one);
      qs = qs * share, qt = qt * share;
      jlaw_put_(q + i, now.places, &qs), jlaw_put_(q + law->facets * law->cells + i, now.places, &qt);
    }
  }
}

void jlaw_rotate(const jlaw_law *law, double *s, double angle)
{
  const int dim = law->dim, D = law->cells, M = law->facets;
  const double before = jlaw_measure_(law, s).sheared, c = cos(angle), d = sin(angle);
  double *q = s + 2 * dim, *depth = s + jlaw_rest_(law);
  if (dim == 2 && c < 0.0) jlaw_swap_bodies(law, s); /* the axis changes its sense */
  if (dim != 3) return;
  for (int i = 1; i <= 3; i += 2) { /* shear and offset */
    const double along = s[i], across = s[i + 1];
    s[i] = c * along + d * across, s[i + 1] = c * across - d * along;
  }
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
  else s[5] += before - after;
}

/* ------------------------------------------------------------- table files */

#define JLAW_LONGEST ((size_t) 1 << 28) /* bytes of a table file: those of a law have 1e5 to 1e7 */

/* The bytes of a file and a zero; NULL if it cannot be read */
static char *jlaw_load_(const char *file, size_t *length)
{
  FILE *stream = fopen(file, "rb");
  char *bytes = NULL, *more;
  size_t room = 0, n = 0;
  if (!stream) return NULL;
  for (int open = 1; open && n < JLAW_LONGEST;) {
    if (n + 1 >= room) {
      room = room ? 2 * room : (size_t) 1 << 17;
      more = (char *) realloc(bytes, room);
      if (!more) break;
      bytes = more;
    }
    const size_t got = fread(bytes + n, 1, room - n - 1, stream);
    open = got > 0;
    n += got;
  }
  if (ferror(stream) || !bytes) { free(bytes); bytes = NULL; }
  else bytes[n] = 0;
  fclose(stream);
  *length = n;
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
    if (*at++ == '#') while (*at && *at != '\n') at++;
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
    if (*at == '.') { point = 1; continue; }
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

typedef struct { const char *word; double *to, least, most; } jlaw_key_;

/* Reads all keywords into law; NULL or what is wrong */
static const char *jlaw_parse_(const char *at, jlaw_law *law, size_t length)
{
  double dim = 0, facets = 0, cells = 0, pieces = 0, yields = 0, wears = 0;
  const jlaw_key_ keys[] = {
    {"dim", &dim, 1, 3}, {"facets", &facets, 1, 1e6}, {"cells", &cells, 1, 1e6},
    {"pieces", &pieces, 1, 1e6}, {"yields", &yields, 0, 1}, {"wears", &wears, 0, 1},
    {"critical_slip", &law->critical_slip, JLAW_UNDERFLOW, DBL_MAX},
    {"eta", &law->eta, 0, DBL_MAX}, {"scale", &law->scale, DBL_MIN, DBL_MAX},
    {"rise", &law->rise, 0, DBL_MAX}, {"closure_factor", &law->closure_factor, 0, DBL_MAX},
    {"stiffness_factor", &law->stiffness_factor, 0, DBL_MAX},
    {"largest_reach", &law->largest_reach, 0, DBL_MAX}, {"stretch", &law->stretch, 1, DBL_MAX},
    {"farthest", &law->farthest, 0, DBL_MAX}, {"mu", &law->mu, 0, DBL_MAX},
    {"mu_residual", &law->mu_residual, 0, DBL_MAX},
    {"wear_slip", &law->wear_slip, DBL_MIN, DBL_MAX}};
  enum { KEYS = sizeof keys / sizeof keys[0] };
  char word[sizeof law->fingerprint];
  at = jlaw_word_(at, word, sizeof word);
  if (strcmp(word, "fingerprint")) return "it does not tell its fingerprint";
  at = jlaw_word_(at, law->fingerprint, sizeof law->fingerprint);
  for (int i = 0; i < KEYS; i++) {
    at = jlaw_word_(at, word, sizeof word);
    if (strcmp(word, keys[i].word)) return "a keyword is missing, unknown or not in its place";
    at = jlaw_number_(at, keys[i].to);
    if (!at || !(*keys[i].to >= keys[i].least && *keys[i].to <= keys[i].most))
      return "a parameter is no number or out of its bounds";
  }
  law->dim = (int) dim, law->facets = (int) facets, law->cells = (int) cells;
  law->pieces = (int) pieces, law->yields = (int) yields, law->wears = (int) wears;
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
    const size_t column = n / JLAW_LANES % JLAW_COLUMNS;
    if ((column >= JLAW_A && !(law->facet[n] >= 0.0))
        || (column == JLAW_MIRROR && !(law->facet[n] < facets))
        || (column == JLAW_USED && !(law->facet[n] <= cells))) return "a facet is out of bounds";
  }
  for (int f = 0; f < law->facets;) {
    const double ring = jlaw_of_facet_(law, f, JLAW_RING);
    if (!(ring >= 1.0 && ring <= (double) JLAW_AZIMUTHS && ring <= facets - f))
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

#if defined(__GNUC__) && !defined(JOINTLAW_PLAIN)
#pragma GCC diagnostic pop
#endif
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC pop_options
#endif
#ifdef __cplusplus
}
#endif
#endif
