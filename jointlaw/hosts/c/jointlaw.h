/* jointlaw.h: the law of a rough rock joint, complete, in C99 (also C++11 and later). MIT licence.
 *
 *     #define JOINTLAW_IMPLEMENTATION                  in one source file, before this line:
 *     #include "jointlaw.h"
 *
 *     char message[JLAW_MESSAGE];
 *     jlaw_law *law = jlaw_read("granite.jlaw", message, sizeof message);
 *     double state[102] = {0};                         jlaw_state_size(law) numbers; zeros: virgin
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
 * host that cannot carry its axes with a body; for laws without a preferred direction (c = 0).
 * Exact for whole azimuths of the facets; in a plane the axis keeps or changes its sense. */
void jlaw_rotate(const jlaw_law *law, double *s, double angle);
/* The state after the bodies changed their roles: axis 1 turned round, axis 2 kept, axis 3 turned
 * round with it. Shear along 2 changes its sign, along 3 not. Exact. */
void jlaw_swap_bodies(const jlaw_law *law, double *s);

/* Of the law that the tables were made for: a Python state of another fingerprint does not fit. */
const char *jlaw_fingerprint(const jlaw_law *law);

/* The tables, for files NAME.h; not for the host. LANES facets lie side by side in a block. */
#define JLAW_FORMAT 1 /* of table files */
enum {
  JLAW_LANES = 16,
  JLAW_M = 0, JLAW_S = 3, JLAW_T = 6, JLAW_N = 9, /* m = n/c1, s, t, n: 3 columns each */
  JLAW_A = 12, JLAW_STIFF = 13,    /* A; A/c1 */
  JLAW_STRENGTH = 14,              /* mu lam A */
  JLAW_COMPLIANCE = 15,            /* c1/(2 A lam): from |q|^2/kappa to energy */
  JLAW_SOFT = 16,                  /* 1/lam */
  JLAW_POTENTIAL = 17,             /* A c1 */
  JLAW_SHARE = 18, JLAW_MIRROR = 19, /* of all orientations; the facet mirrored along axis 2 */
  JLAW_COLUMNS = 20
};
struct jlaw_law {
  int dim, facets, cells, pieces, azimuths; /* pieces of the curve; azimuths of a ring of facets */
  double critical_slip;                     /* infinite: the largest float */
  double eta, scale, rise;                  /* of the virgin curve */
  double closure_factor, stiffness_factor;  /* normal stress over Phi, bound of |C| over Phi' */
  double largest_reach, stretch;            /* m; bound of |y| over that of the displacement */
  const double *facet;  /* (blocks, JLAW_COLUMNS, LANES); zeros beyond the last facet */
  const double *depth;  /* (blocks, cells + 1, 3, LANES): zeta, and Phi and Phi' there */
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
#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif

/* The loops over lanes become vector instructions: of AVX2 where the machine has it, found out
 * at run time. (AVX2 without FMA: no fused operations.) */
#if defined(__GNUC__)
#define JLAW_INLINE static inline __attribute__((always_inline))
#else
#define JLAW_INLINE static inline
#endif
#if defined(__GNUC__) && !defined(__clang__)
#define JLAW_EACH(n) _Pragma("GCC ivdep") for (int l = 0; l < (n); l++)
#else
#define JLAW_EACH(n) for (int l = 0; l < (n); l++)
#endif
#define JLAW_W(column) w[(column) * JLAW_LANES + l] /* of the facets w, lane l */
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__OPTIMIZE__) && !defined(__AVX2__) \
    && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && !defined(JOINTLAW_PLAIN)
#define JLAW_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define JLAW_CLONES
#endif

/* The thresholds of kernels/reference.py */
#define JLAW_UNDERFLOW 1e-140 /* m: counts as zero */
#define JLAW_TINY 1e-290      /* a stiffness whose reciprocal might overflow: zero */
#define JLAW_NEAR 1e-5        /* of y: below such a change the chord is lost in rounding */
#define JLAW_GRAZING 1e-12    /* cosine at which the offset meets its limit */
#define JLAW_LIMIT 1e-9       /* of the friction limit: a slider this close is at it */
#define JLAW_ROUNDED 1e-12    /* of Phi, and of y: as much may be lost in rounding */

typedef double jlaw_lanes_[JLAW_LANES];

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

/* Phi and Phi' at y, and Phi'' if asked; zero where y <= 0. What counts as zero becomes zero. */
JLAW_INLINE void jlaw_virgin_(const jlaw_law *law, int n, double *y, double *force,
                              double *slope, double *bend)
{
  jlaw_lanes_ x, v, ts, c0, c1, c2, c3, power;
  int at[JLAW_LANES];
  const double pieces = law->pieces, top = pieces - 1.0, scale = law->scale, eta = law->eta;
  JLAW_EACH(n) {
    const double here = fabs(y[l]) >= JLAW_UNDERFLOW ? y[l] : 0.0;
    const double root = sqrt(here > 0.0 ? here : 0.0), r = 1.0 / (root + scale);
    const double place = root * r * pieces;
    at[l] = (int) (place < top ? place : top);
    x[l] = place - at[l];
    y[l] = here;
    v[l] = root;
    ts[l] = root * r * r * scale; /* t (1 - t) */
  }
  JLAW_EACH(n) {
    const double *c = law->curve + 4 * at[l];
    c0[l] = c[0], c1[l] = c[1], c2[l] = c[2], c3[l] = c[3];
  }
  if (eta == 0.5) JLAW_EACH(n) power[l] = v[l];
  else if (eta == 0.0) JLAW_EACH(n) power[l] = v[l] > 0.0 ? 1.0 : 0.0;
  else for (int l = 0; l < n; l++) power[l] = v[l] > 0.0 ? pow(y[l], eta) : 0.0;
  jlaw_lanes_ S, DS, DDS;
  JLAW_EACH(n) {
    S[l] = c0[l] + x[l] * (c1[l] + x[l] * (c2[l] + x[l] * c3[l]));
    DS[l] = 0.5 * ts[l] * (pieces * (c1[l] + x[l] * (2.0 * c2[l] + x[l] * (3.0 * c3[l]))));
  }
  if (bend) JLAW_EACH(n) {
    const double S2 = pieces * pieces * (2.0 * c2[l] + x[l] * (6.0 * c3[l]));
    DDS[l] = 0.25 * ts[l] * ts[l] * S2 + 0.5 * (scale - v[l]) / (scale + v[l]) * DS[l];
  }
  if (law->rise > 0.0) { /* S is tabulated over w^rise */
    const double W = scale * scale;
    for (int l = 0; l < n; l++) {
      const double here = y[l] > 0.0 ? y[l] : 0.0, w = here / (here + W);
      const double more = law->rise * W / (here + W), lift = pow(w, law->rise);
      if (bend) DDS[l] = lift * (DDS[l] + 2.0 * more * DS[l] + (more * more - more * w) * S[l]);
      DS[l] = lift * (DS[l] + more * S[l]);
      S[l] = lift * S[l];
    }
  }
  JLAW_EACH(n) {
    force[l] = power[l] * (y[l] > 0.0 ? y[l] : 0.0) * S[l];
    slope[l] = power[l] * ((1.0 + eta) * S[l] + DS[l]);
  }
  if (bend) JLAW_EACH(n) {
    const double all = eta * (1.0 + eta) * S[l] + (1.0 + 2.0 * eta) * DS[l] + DDS[l];
    bend[l] = power[l] / (y[l] > 0.0 ? y[l] : 1.0) * all;
  }
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
} jlaw_move_;

typedef struct { /* what the blocks add up to, lane by lane */
  jlaw_lanes_ F[3], C[9], pull[2], lost;
} jlaw_sum_;

typedef struct { /* a block of facets */
  jlaw_lanes_ y0, y1, f0, f1, k0, k1, es, et, bend; /* y, Phi, Phi'; de; Phi'' */
  jlaw_lanes_ qs, qt, vs, vt, bss, bst, btt;        /* sums over the cells: q; v and B of C */
} jlaw_block_;

/* Moves the offset by p, dragged along where it is at its limit: "Large shear" */
static void jlaw_limit_offset_(const jlaw_law *law, jlaw_move_ *m)
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
  double inside = -along + sqrt(fmax(D * D - (a0 * a0 + a1 * a1) + along * along, 0.0));
  inside = fmin(fmax(inside, 0.0), length);
  a0 += inside * e0, a1 += inside * e1;
  const double x = (length - inside) / D, decay = exp(-x), rest = -expm1(-x);
  const double cosine = fmin(fmax((a0 * e0 + a1 * e1) / D, 0.0), 1.0);
  const double sine = (a1 * e0 - a0 * e1) / D;
  const double bottom = (1.0 + cosine) + (1.0 - cosine) * decay * decay;
  const double cos1 = ((1.0 + cosine) - (1.0 - cosine) * decay * decay) / bottom;
  const double sin1 = 2.0 * sine * decay / bottom;
  m->to[1] = D * (cos1 * e0 - sin1 * e1), m->to[2] = D * (cos1 * e1 + sin1 * e0);
  m->slip = D * (x + log(bottom / 2.0));
  double turn = (rest * rest + cosine * rest * (1.0 + decay)) / bottom;
  turn += inside / (D * fmax(cosine, JLAW_GRAZING)) * (2.0 * decay / bottom - sin1 * sine);
  turn /= length;
  const int turns = law->dim == 3; /* along one line the offset does not turn */
  const double row0 = turns ? -turn * e1 - sin1 / D * e0 : 0.0;
  const double row1 = turns ? turn * e0 - sin1 / D * e1 : 0.0;
  m->J[0] = -m->to[2] * row0, m->J[1] = -m->to[2] * row1;
  m->J[2] = m->to[1] * row0, m->J[3] = m->to[1] * row1;
}

/* Share of a depth cell in Phi, and its slope: the bed beyond its lower limit less that beyond its
 * upper, which for the last cell is never reached. z: zeta, Phi, Phi' at both limits. */
JLAW_INLINE void jlaw_cell_(double y, double force, double slope, const double *z,
                            double *G, double *kappa)
{
  enum { NEXT = 3 * JLAW_LANES };
  const double from = z[0], force0 = z[JLAW_LANES], slope0 = z[2 * JLAW_LANES];
  const double to = z[NEXT], force1 = z[NEXT + JLAW_LANES], slope1 = z[NEXT + 2 * JLAW_LANES];
  const double low = y - from, high = y - to;
  const double past = force - force1 - slope1 * high;
  double g = force - force0 - slope0 * low, k = slope - slope0;
  g = high > 0.0 ? g - past : g;
  k = high > 0.0 ? slope1 - slope0 : k;
  k = ((low > 0.0) & (k > 0.0)) ? k : 0.0;
  const double most = k * low;
  g = g < most ? g : most;
  *G = g > 0.0 ? g : 0.0;
  *kappa = k;
}

/* One depth cell of a block of facets: load, friction limit, loss, tangent. q holds the sliders
 * of the cell before and after. */
JLAW_INLINE void jlaw_slide_(const double *w, const double *z, int n, jlaw_block_ *b,
                             jlaw_lanes_ q[2], jlaw_sum_ *sum, int ledger, int tangent)
{
  JLAW_EACH(n) {
    double G0, G1, k0, k1;
    jlaw_cell_(b->y0[l], b->f0[l], b->k0[l], z + l, &G0, &k0);
    jlaw_cell_(b->y1[l], b->f1[l], b->k1[l], z + l, &G1, &k1);
    /* trial force: by the chord where stiffness grows, scaled down where it falls */
    const double a = JLAW_W(JLAW_STIFF), dy = b->y1[l] - b->y0[l];
    const int grows = k1 > k0, near = fabs(dy) <= JLAW_NEAR * fabs(b->y1[l]);
    const double bottom = grows ? dy : k0;
    const double ratio = (grows ? G1 - G0 : k1) / (bottom != 0.0 ? bottom : 1.0);
    double chord = near ? 0.5 * (k0 + k1) : ratio;
    chord = chord > k0 ? chord : k0;
    chord = chord < k1 ? chord : k1;
    const double kept = grows ? 1.0 : ratio, add = a * (grows ? chord : k1);
    const double olds = q[0][l], oldt = q[1][l], es = b->es[l], et = b->et[l];
    const double ts = olds * kept + add * es, tt = oldt * kept + add * et;
    /* friction: |q| <= mu lam A G */
    const double new2 = ts * ts + tt * tt, size = sqrt(new2);
    const double strength = JLAW_W(JLAW_STRENGTH), cap = strength * G1;
    const double held = cap / (size > cap ? size : 1.0);
    const double share = size > cap ? held : 1.0, part = new2 > JLAW_TINY ? share : 0.0;
    q[0][l] = part * ts, q[1][l] = part * tt;
    b->qs[l] += part * ts, b->qt[l] += part * tt;
    if (ledger) { /* "No step can make energy": each term is >= 0 as written */
      const double r0 = 1.0 / (k0 > JLAW_TINY ? k0 : 1.0), r1 = 1.0 / (k1 > JLAW_TINY ? k1 : 1.0);
      const double rc = 1.0 / (chord > JLAW_TINY ? chord : 1.0), old2 = olds * olds + oldt * oldt;
      double hard = new2 * (rc - r1) + (k0 > JLAW_TINY ? old2 * (r0 - rc) : 0.0);
      double soft = (k0 - k1) * r0 * (old2 * r0), rub = 2.0 * share * (1.0 - share) * (new2 * r1);
      hard = chord > JLAW_TINY ? hard : 0.0;
      soft = k0 > JLAW_TINY ? soft : 0.0;
      rub = k1 > JLAW_TINY ? rub : 0.0;
      sum->lost[l] += JLAW_W(JLAW_COMPLIANCE) * ((grows ? hard : soft) + rub);
    }
    if (tangent) { /* "The tangent": J_q = beta (I - s s^T) E + v g^T */
      const double y = b->y1[l], low = y - z[l], high = y - z[3 * JLAW_LANES + l];
      const double curving = b->bend[l], bend = ((low > 0.0) & (high < 0.0)) ? curving : 0.0;
      const double chord1 = near ? 0.5 * bend : (k1 - chord) / (near ? 1.0 : dy);
      const double fade = k1 > JLAW_TINY ? bend / (k1 > JLAW_TINY ? k1 : 1.0) : 0.0;
      /* exactly at its limit a slider slips, and exactly as stiff as before a cell has not grown */
      const int slips = size >= strength * (G1 * (1.0 - JLAW_LIMIT) - JLAW_ROUNDED * b->f1[l]);
      const int stiffer = grows & (dy > JLAW_ROUNDED * fabs(y));
      const double unit = 1.0 / (size > 0.0 ? size : 1.0), us = ts * unit, ut = tt * unit;
      const double ws = stiffer ? a * chord1 * es : fade * ts;
      const double wt = stiffer ? a * chord1 * et : fade * tt;
      const double dot = us * ws + ut * wt, push = strength * k1;
      const double beta = cap > 0.0 ? share * add : 0.0, along = slips ? beta : 0.0;
      b->vs[l] += slips ? share * (ws - us * dot) + push * us : ws;
      b->vt[l] += slips ? share * (wt - ut * dot) + push * ut : wt;
      b->bss[l] += beta - along * us * us;
      b->bst[l] -= along * us * ut;
      b->btt[l] += beta - along * ut * ut;
    }
  }
}

/* C += along g^T + E^T B E of a block of facets */
JLAW_INLINE void jlaw_add_tangent_(const double *w, int n, const jlaw_move_ *m, const jlaw_block_ *b,
                                   jlaw_sum_ *sum, int dim)
{
  for (int i = 0; i < dim; i++)
    for (int j = 0; j < dim; j++)
      JLAW_EACH(n) {
        const double soft = JLAW_W(JLAW_SOFT), A = JLAW_W(JLAW_A);
        const double si = JLAW_W(JLAW_S + i), ti = JLAW_W(JLAW_T + i);
        const double sj = JLAW_W(JLAW_S + j), tj = JLAW_W(JLAW_T + j);
        const double along = A * JLAW_W(JLAW_N + i) * b->k1[l]
                             + soft * (si * b->vs[l] + ti * b->vt[l]);
        const double m1 = JLAW_W(JLAW_M + 1), m2 = JLAW_W(JLAW_M + 2);
        const double g = j == 0 ? JLAW_W(JLAW_M) : m1 * m->J[j - 1] + m2 * m->J[j + 1];
        sum->C[3 * i + j][l] += along * g + soft * ((si * b->bss[l] + ti * b->bst[l]) * sj
                                                    + (si * b->bst[l] + ti * b->btt[l]) * tj);
      }
}

/* A block of facets: y before and after, virgin curve, all cells, and its part of F and C */
JLAW_INLINE void jlaw_facets_(const jlaw_law *law, int block, const jlaw_move_ *m, const double *q0,
                              double *q1, jlaw_sum_ *sum, int dim, int ledger, int tangent)
{
  const double *w = law->facet + (size_t) block * JLAW_COLUMNS * JLAW_LANES;
  const int D = law->cells, first = block * JLAW_LANES;
  const int real = law->facets - first < JLAW_LANES ? law->facets - first : JLAW_LANES;
  const int n = (real + 3) & ~3; /* whole vectors */
  const double *z = law->depth + (size_t) block * (size_t) (D + 1) * 3 * JLAW_LANES;
  const size_t other = (size_t) law->facets * (size_t) D; /* from q_s to q_t of a slider */
  jlaw_block_ b;
  JLAW_EACH(n) {
    double y0 = JLAW_W(JLAW_M) * m->from[0], y1 = JLAW_W(JLAW_M) * m->to[0];
    double es = JLAW_W(JLAW_S) * m->p[0], et = 0.0;
    for (int i = 1; i < dim; i++) {
      y0 += JLAW_W(JLAW_M + i) * m->from[i], y1 += JLAW_W(JLAW_M + i) * m->to[i];
      es += JLAW_W(JLAW_S + i) * m->p[i], et += JLAW_W(JLAW_T + i) * m->p[i];
    }
    b.y0[l] = y0, b.y1[l] = y1, b.es[l] = es, b.et[l] = et;
    b.qs[l] = b.qt[l] = b.vs[l] = b.vt[l] = b.bss[l] = b.bst[l] = b.btt[l] = 0.0;
  }
  jlaw_virgin_(law, n, b.y0, b.f0, b.k0, NULL);
  jlaw_virgin_(law, n, b.y1, b.f1, b.k1, tangent ? b.bend : NULL);
  jlaw_lanes_ q[2];
  JLAW_EACH(n) q[0][l] = q[1][l] = 0.0;
  q0 += (size_t) first * (size_t) D, q1 += (size_t) first * (size_t) D;
  for (int i = 0; i < D; i++, q0++, q1++, z += 3 * JLAW_LANES) {
    JLAW_EACH(real) q[0][l] = q0[(size_t) (l * D)], q[1][l] = q0[other + (size_t) (l * D)];
    jlaw_slide_(w, z, n, &b, q, sum, ledger, tangent);
    JLAW_EACH(real) q1[(size_t) (l * D)] = q[0][l], q1[other + (size_t) (l * D)] = q[1][l];
  }
  for (int i = 0; i < dim; i++)
    JLAW_EACH(n) {
      const double normal = JLAW_W(JLAW_A) * b.f1[l], soft = JLAW_W(JLAW_SOFT);
      const double pull = JLAW_W(JLAW_N + i) * normal;
      sum->F[i][l] += pull + soft * (JLAW_W(JLAW_S + i) * b.qs[l] + JLAW_W(JLAW_T + i) * b.qt[l]);
      if (i > 0) sum->pull[i - 1][l] += pull;
    }
  if (tangent) jlaw_add_tangent_(w, n, m, &b, sum, dim);
}

/* In an order that no compiler changes */
JLAW_INLINE double jlaw_total_(const double *x)
{
  double part[4];
  for (int l = 0; l < 4; l++) part[l] = (x[l] + x[l + 8]) + (x[l + 4] + x[l + 12]);
  return (part[0] + part[2]) + (part[1] + part[3]);
}

JLAW_INLINE void jlaw_all_(const jlaw_law *law, const jlaw_move_ *m, const double *s0, double *s1,
                           double *F, double *C, int dim, int ledger, int tangent)
{
  jlaw_sum_ sum;
  memset(&sum, 0, tangent ? sizeof sum : sizeof sum); /* TODO */
  for (int block = 0; block * JLAW_LANES < law->facets; block++)
    jlaw_facets_(law, block, m, s0 + 2 * dim, s1 + 2 * dim, &sum, dim, ledger, tangent);
  double lost = jlaw_total_(sum.lost);
  const double drag = jlaw_total_(sum.pull[0]) * m->to[1] + jlaw_total_(sum.pull[1]) * m->to[2];
  if (m->slip > 0.0 && drag > 0.0) lost += m->slip * drag / law->critical_slip;
  for (int i = 0; i < dim; i++) F[i] = jlaw_total_(sum.F[i]);
  for (int i = 0; tangent && i < dim; i++)
    for (int j = 0; j < dim; j++) C[dim * i + j] = jlaw_total_(sum.C[3 * i + j]);
  for (int i = 0; i < dim; i++) s1[i] = s0[i] + m->p[i];
  for (int i = 1; i < dim; i++) s1[dim + i - 1] = m->to[i];
  s1[2 * dim - 1] = s0[2 * dim - 1] + (ledger ? lost : 0.0);
}

#ifdef JOINTLAW_NO_LEDGER
enum { JLAW_LEDGER = 0 };
#else
enum { JLAW_LEDGER = 1 };
#endif

/* Constants for the compiler: a plane costs half of space, and what is not asked for nothing */
JLAW_CLONES static void jlaw_advance_(const jlaw_law *law, const jlaw_move_ *m, const double *s0,
                                      double *s1, double *F, double *C)
{
  if (law->dim == 3 && !C) jlaw_all_(law, m, s0, s1, F, C, 3, JLAW_LEDGER, 0);
  else if (law->dim == 3) jlaw_all_(law, m, s0, s1, F, C, 3, JLAW_LEDGER, 1);
  else if (law->dim == 2 && !C) jlaw_all_(law, m, s0, s1, F, C, 2, JLAW_LEDGER, 0);
  else if (law->dim == 2) jlaw_all_(law, m, s0, s1, F, C, 2, JLAW_LEDGER, 1);
  else jlaw_all_(law, m, s0, s1, F, C, 1, JLAW_LEDGER, C != NULL);
}

/* The largest of |closure|, |shear| and |offset| of a state: with `stretch` it bounds every |y| */
static double jlaw_far_(const double *x, int n)
{
  double far = 0.0;
  for (int i = 0; i < n; i++) far = fabs(x[i]) <= far ? far : fabs(x[i]); /* NaN stays */
  return far;
}

/* Whether all sliders hold forces that a law can have; not for NaN */
static int jlaw_sound_(const double *q, int n)
{
  double sum[4] = {0.0, 0.0, 0.0, 0.0};
  int i = 0;
  for (; i + 4 <= n; i += 4)
    for (int l = 0; l < 4; l++) sum[l] += q[i + l] * q[i + l];
  for (; i < n; i++) sum[0] += q[i] * q[i];
  return (sum[0] + sum[2]) + (sum[1] + sum[3]) < 1e300;
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
  const double reach = law->stretch * (jlaw_far_(s0, 2 * dim - 1) + jlaw_far_(d, dim));
  const int damaged = !(fabs(s0[2 * dim - 1]) <= DBL_MAX) || !(jlaw_far_(s0, 2 * dim - 1) <= DBL_MAX)
                      || !jlaw_sound_(s0 + 2 * dim, 2 * law->facets * law->cells);
  if (damaged || !(reach <= law->largest_reach))
    return jlaw_refuse_(law, s0, d, damaged, message, size);
  jlaw_move_ m = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 0.0}, 0.0};
  for (int i = 0; i < dim; i++) m.p[i] = d[i];
  m.from[0] = s0[0], m.to[0] = s0[0] + d[0];
  for (int i = 1; i < dim; i++) m.from[i] = s0[dim + i - 1];
  jlaw_limit_offset_(law, &m);
  jlaw_advance_(law, &m, s0, s1, F, C);
  return 0;
}

/* ------------------------------------------------------------ what a state is */

int jlaw_dim(const jlaw_law *law) { return law->dim; }
int jlaw_state_size(const jlaw_law *law) { return 2 * law->dim + 2 * law->facets * law->cells; }
const char *jlaw_fingerprint(const jlaw_law *law) { return law->fingerprint; }
double jlaw_dissipated(const jlaw_law *law, const double *s) { return s[2 * law->dim - 1]; }

typedef struct { double stored, sliding, slipping, separated; } jlaw_measures_;

static jlaw_measures_ jlaw_measure_(const jlaw_law *law, const double *s)
{
  jlaw_measures_ all = {0.0, 0.0, 0.0, 0.0};
  const int dim = law->dim, D = law->cells;
  for (int f = 0; f < law->facets; f++) {
    const double *w = law->facet + (size_t) (f / JLAW_LANES) * JLAW_COLUMNS * JLAW_LANES + f % JLAW_LANES;
    const double *z = law->depth + (size_t) (f / JLAW_LANES) * (size_t) (D + 1) * 3 * JLAW_LANES + f % JLAW_LANES;
    const double *qs = s + 2 * dim + f * D, *qt = qs + law->facets * D, share = w[JLAW_SHARE * JLAW_LANES];
    jlaw_lanes_ y, force, slope;
    y[0] = w[JLAW_M * JLAW_LANES] * s[0];
    for (int i = 1; i < dim; i++) y[0] += w[(JLAW_M + i) * JLAW_LANES] * s[dim + i - 1];
    jlaw_virgin_(law, 1, y, force, slope, NULL);
    double at_limit = 0.0;
    int whole = 1;
    for (int i = 0; i < D; i++, z += 3 * JLAW_LANES) {
      double G, kappa;
      jlaw_cell_(y[0], force[0], slope[0], z, &G, &kappa);
      const double q2 = qs[i] * qs[i] + qt[i] * qt[i];
      const double cap = w[JLAW_STRENGTH * JLAW_LANES] * (G * (1.0 - JLAW_LIMIT) - JLAW_ROUNDED * force[0]);
      const int held = sqrt(q2) >= cap;
      at_limit += held ? G : 0.0;
      whole = whole && held;
      if (kappa > JLAW_TINY) all.stored += w[JLAW_COMPLIANCE * JLAW_LANES] * q2 / kappa;
    }
    all.stored += w[JLAW_POTENTIAL * JLAW_LANES] * jlaw_psi_(law, y[0]);
    if (force[0] > 0.0) all.slipping += share * at_limit / force[0];
    if (y[0] > 0.0 && whole) all.sliding += share;
    if (!(y[0] > 0.0)) all.separated += share;
  }
  return all;
}

double jlaw_stored(const jlaw_law *law, const double *s) { return jlaw_measure_(law, s).stored; }

void jlaw_shares(const jlaw_law *law, const double *s, double shares[3])
{
  const jlaw_measures_ all = jlaw_measure_(law, s);
  shares[0] = all.sliding, shares[1] = all.slipping, shares[2] = all.separated;
}

/* ------------------------------------------------------------ unsheared joint */

static double jlaw_virgin_one_(const jlaw_law *law, double closure, double *slope)
{
  jlaw_lanes_ y, force, slopes;
  y[0] = closure;
  jlaw_virgin_(law, 1, y, force, slopes, NULL);
  *slope = slopes[0];
  return force[0];
}

double jlaw_normal_stress(const jlaw_law *law, double closure)
{
  double slope;
  if (!(closure <= law->largest_reach)) return nan("");
  return law->closure_factor * jlaw_virgin_one_(law, closure, &slope);
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
  double low = 0.0, high = law->largest_reach;
  if (!(normal_stress >= 0.0) || !(jlaw_normal_stress(law, high) >= normal_stress)) return nan("");
  while (1) { /* the stress rises: halve the exponent first, then the number */
    const double middle = high > 4.0 * low && high > 1e-300 ? sqrt(high * fmax(low, 1e-300))
                                                            : 0.5 * (low + high);
    if (!(middle > low && middle < high)) return low == 0.0 ? 0.0 : high;
    if (jlaw_normal_stress(law, middle) < normal_stress) low = middle;
    else high = middle;
  }
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
  double dim = 0, facets = 0, cells = 0, pieces = 0, azimuths = 0;
  const jlaw_key_ keys[] = {
    {"dim", &dim, 1, 3}, {"facets", &facets, 1, 1e6}, {"cells", &cells, 1, 1e6},
    {"pieces", &pieces, 1, 1e6}, {"azimuths", &azimuths, 1, 1e6},
    {"critical_slip", &law->critical_slip, JLAW_UNDERFLOW, DBL_MAX},
    {"eta", &law->eta, 0, DBL_MAX}, {"scale", &law->scale, DBL_MIN, DBL_MAX},
    {"rise", &law->rise, 0, DBL_MAX}, {"closure_factor", &law->closure_factor, 0, DBL_MAX},
    {"stiffness_factor", &law->stiffness_factor, 0, DBL_MAX},
    {"largest_reach", &law->largest_reach, 0, DBL_MAX}, {"stretch", &law->stretch, 1, DBL_MAX}};
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
  law->pieces = (int) pieces, law->azimuths = (int) azimuths;
  const size_t blocks = (size_t) (law->facets + JLAW_LANES - 1) / JLAW_LANES;
  const char *words[4] = {"facet", "depth", "curve", "energy"};
  const size_t sizes[4] = {blocks * JLAW_COLUMNS * JLAW_LANES,
                           blocks * (size_t) (law->cells + 1) * 3 * JLAW_LANES,
                           4 * (size_t) law->pieces, 4 * (size_t) law->pieces};
  const size_t all = sizes[0] + sizes[1] + sizes[2] + sizes[3];
  if (law->facets % law->azimuths || all > length / 2) return "its sizes do not fit one another";
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
        || (column == JLAW_MIRROR && !(law->facet[n] < facets))) return "a facet is out of bounds";
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

#ifdef __cplusplus
}
#endif
#endif
