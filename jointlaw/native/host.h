/* jointlaw.h: the law of a rough rock joint, complete, in C99 (also C++11 and later). MIT licence.
 *
 *     #define JOINTLAW_IMPLEMENTATION   // in one source file, before this line:
 *     #include "jointlaw.h"
 *
 *     char message[JLAW_MESSAGE];
 *     jlaw_law *law = jlaw_read("granite.jlaw", message, sizeof message); // of `jointlaw export c`
 *     double *state = (double *) calloc(jlaw_state_size(law), sizeof *state); // virgin, mated
 *     double d[3] = {1e-7, 5e-8, 0.0}, F[3];
 *     if (jlaw_update(law, state, state, d, F, NULL, message, sizeof message)) puts(message);
 *
 * Axes: 1 is the normal of the joint, 2 and 3 span it. d is the displacement increment (m) of one
 * body into and along the other: closure first, then the jlaw_dim - 1 components of shear. F is the
 * traction (Pa), compression positive: the force on the body that moves by +d is -area F.
 * C = dF/dd (Pa/m) in row-major order. Energies are per area (J/m2).
 *
 * A law is constant after reading: any number of threads may share it. States belong to the caller;
 * two threads must not advance the same state at the same time. Only jlaw_read and jlaw_free allocate
 * memory or access files. No function uses the locale or a global variable.
 *
 * Build with -ffp-contract=off: the results are then bitwise identical with every compiler and on
 * every x86-64. For speed add -O3 -fno-math-errno -fno-trapping-math, which change no result; never
 * -ffast-math. -march=native compiles the law once, for this processor; without it gcc and clang
 * compile it for two kinds of x86-64 and choose at run time.
 *
 * With JOINTLAW_FLOAT_SLIDERS, before this header in the file with JOINTLAW_IMPLEMENTATION, and
 * before tables NAME.h, the forces of sliders are stored as float: states take about half of the
 * memory, all arithmetic stays in double. Two floats take the place of one double of the state, so
 * hosts copy states as before, but must not read numbers behind s[jlaw_dim].
 *
 * The page "theory-incremental" of the documentation and jointlaw/kernels/asperities.py describe the
 * step, with the same symbols.
 */
#ifndef JOINTLAW_H
#define JOINTLAW_H
#ifndef __CUDACC_RTC__
#include <math.h>
#include <stddef.h>
#endif
#ifndef JLAW_FUNCTION
#define JLAW_FUNCTION /* qualifier of every function and table: __device__ for CUDA */
#endif
#ifdef __cplusplus
extern "C" {
#endif

#define JLAW_MESSAGE 300 /* bytes sufficient for every message */

#ifdef JOINTLAW_FLOAT_SLIDERS
#define JLAW_STORAGE ":float" /* ends the hash of a law, since states are not those with doubles */
#else
#define JLAW_STORAGE ""
#endif

typedef struct jlaw_law jlaw_law;

#ifndef JOINTLAW_NO_FILES
/* Read a table file. Returns NULL and writes a message if the file is missing, damaged or of another
 * version. */
jlaw_law *jlaw_read(const char *file, char *message, size_t size);
void jlaw_free(jlaw_law *law);
#endif

/* Components of d: 3, 2 for motion in a plane, 1 for closure only. Numbers of a state, as in a snapshot
 * of the Python package; fewer with JOINTLAW_FLOAT_SLIDERS */
JLAW_FUNCTION int jlaw_dim(const jlaw_law *law);
JLAW_FUNCTION int jlaw_state_size(const jlaw_law *law);

/* Advance a joint from state s0 to s1, which may be the same array, by d (dim); writes F (dim), and C
 * (dim, dim) unless it is NULL. Returns 0. If d or the state is not finite, or forces would overflow,
 * it returns -1 and writes a message and nothing else. */
JLAW_FUNCTION int jlaw_update(const jlaw_law *law, const double *s0, double *s1, const double *d,
                              double *F, double *C, char *message, size_t size);

/* Advance n joints of an array: states `stride` numbers apart, d (n, dim), F (n, dim), and C (n, dim,
 * dim) unless it is NULL. -DJOINTLAW_MANY -march=native vectorises it over joints; the results are
 * bitwise identical with jlaw_update. Returns n, or the index of the first joint whose step is
 * invalid: this joint and all later ones are unchanged, and jlaw_update gives the reason. */
JLAW_FUNCTION size_t jlaw_update_many(const jlaw_law *law, double *states, size_t stride,
                                      const double *d, double *F, double *C, size_t n);

/* Initialise a joint whose faces do not interlock, for example blocks that touch again after a fall:
 * at first touch, 100 mating lengths from the interlocked position along axis 2. Closure counts from
 * the interlocked position, so s[0] is negative, and the host closes the joint from there on. Returns
 * 0, or -1 for a law with an infinite mating length, which always interlocks: the state is then the
 * virgin one. In both cases the bond of the law is broken. */
JLAW_FUNCTION int jlaw_init_unmated(const jlaw_law *law, double *s);

/* Opening (m) up to which an intact joint bears tension; 0 where it bears none. A host keeps a joint at
 * least until it has opened this far. */
JLAW_FUNCTION double jlaw_tensile_opening(const jlaw_law *law);
/* Whether joints have a bond or cohesion that can break; and break it, as of faces that meet anew */
JLAW_FUNCTION int jlaw_has_damage(const jlaw_law *law);
JLAW_FUNCTION void jlaw_break_bond(const jlaw_law *law, double *s);

/* jlaw_update without its checks, for hosts that validate their steps and for GPUs. Row i of the state
 * is s[i stride], so that joints may be stored side by side, (rows, n). C may be NULL. */
JLAW_FUNCTION void jlaw_step(const jlaw_law *law, double *s, size_t stride, const double *d,
                             double *F, double *C);

/* Traction F (dim) in Pa of a state, without a step: bitwise the traction of the step that wrote it. A
 * step by d = 0 is not neutral if asperities degrade, since degradation lags one step. Use this function
 * for the forces at the start of a run and for output. The state must be valid for this law. */
JLAW_FUNCTION void jlaw_traction(const jlaw_law *law, const double *state, double *F);

/* Elastic energy, and energy dissipated since the virgin state, J/m2 */
JLAW_FUNCTION double jlaw_stored_energy(const jlaw_law *law, const double *s);
JLAW_FUNCTION double jlaw_dissipated_energy(const jlaw_law *law, const double *s);
/* Fractions from 0 to 1: facets at their friction limit (sliding); friction capacity that is exhausted
 * (slipping); facets out of contact (separated) */
JLAW_FUNCTION void jlaw_contact_fractions(const jlaw_law *law, const double *s,
                                          double fractions[3]);

/* Unsheared joint: normal stress (Pa) at a closure (m), and its inverse; NaN if there is no solution */
JLAW_FUNCTION double jlaw_normal_stress(const jlaw_law *law, double closure);
JLAW_FUNCTION double jlaw_closure(const jlaw_law *law, double normal_stress);
/* Close a joint from the virgin state s to this normal stress (Pa, >= 0), without shear: writes the
 * state and F (dim). One step to jlaw_closure misses the stress slightly if asperities yield or
 * degrade by stress, because that closure is the limit of many steps; this function meets it to
 * rounding. Returns 0, or -1 if no closure bears the stress: s is then virgin and F zero. */
JLAW_FUNCTION int jlaw_preload(const jlaw_law *law, double *s, double normal_stress, double *F);
/* Upper bound of |C| (Pa/m) as long as the effective closure of no facet exceeds `closure`. A time step
 * is stable if dt < 2 sqrt(mass/(area * bound)). */
JLAW_FUNCTION double jlaw_max_stiffness(const jlaw_law *law, double closure);

/* Transform a state to axes 2 and 3 rotated by this angle (rad, from 2 to 3) about the normal, for
 * hosts that cannot attach the axes to a body and laws without a preferred direction (c = 0). The
 * displacement is rotated exactly. Slider forces and plastic indentations are interpolated between
 * the azimuths of the facets of one inclination: exact if the angle is a multiple of the interval
 * between azimuths at every inclination, otherwise the error decreases with their number. Sliders
 * gain no energy, and energy that they lose counts as dissipated. In a plane the axis keeps or
 * reverses its direction. */
JLAW_FUNCTION void jlaw_rotate(const jlaw_law *law, double *s, double angle);
/* Transform a state after the two bodies are exchanged: axes 1 and 3 reverse, axis 2 stays. The shear
 * displacement along axis 2 changes its sign, along axis 3 it does not. Exact. */
JLAW_FUNCTION void jlaw_swap_bodies(const jlaw_law *law, double *s);

/* Hydraulic aperture e (m) of a joint at a closure (m), and its derivative de/dclosure, from -1 to 0,
 * unless `slope` is NULL: as jl.Aperture of Python. The transmissivity is e^3/12 (m3): the flow per
 * width is e^3/(12 viscosity) times the pressure gradient. NAME.h has NAME_aperture if the law file
 * has a table [aperture]. */
typedef struct {
  double hydraulic, at, length; /* m: aperture at the closure `at`; closure that divides it by e */
} jlaw_aperture;

JLAW_FUNCTION static inline double jlaw_hydraulic_aperture(const jlaw_aperture *map, double closure,
                                                           double *slope)
{
  const double L = map->length;
  const double transition = map->hydraulic <= L ? map->at + L * log(map->hydraulic / L)
                                                : map->at + (map->hydraulic - L); /* e = L there */
  const double opening = transition - closure;
  const double ratio = opening < 0.0 ? exp(opening / L) : 1.0;
  if (slope) *slope = -ratio;
  return opening > 0.0 ? L * ratio + opening : L * ratio;
}

/* Hash of the parameters of the law: store it with saved states, which fit only this law */
JLAW_FUNCTION const char *jlaw_fingerprint(const jlaw_law *law);

/* struct jlaw_law, for the generated files NAME.h; hosts do not access it */
#include "layout.h"

#ifdef __cplusplus
}
#endif
#endif

#if defined(JOINTLAW_IMPLEMENTATION) && !defined(JOINTLAW_IMPLEMENTED)
#define JOINTLAW_IMPLEMENTED
#ifdef __FAST_MATH__
#error "jointlaw.h: -ffast-math removes the checks for NaN; use -fno-math-errno -fno-trapping-math"
#endif
#ifdef __CUDACC_RTC__
#define DBL_MAX 1.7976931348623157e308
#define NAN (0.0 / 0.0)
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
/* No fused multiply-add in this file, whatever the flags */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__) && !defined(__CUDACC__)
#pragma GCC push_options
#pragma GCC optimize("fp-contract=off", "no-gcse", "no-gcse-after-reload")
#endif
#ifdef __GNUC__ /* functions of vectors are inline: no ABI to warn of */
#pragma GCC diagnostic ignored "-Wpsabi"
#endif

#ifdef JOINTLAW_FLOAT_SLIDERS
#define JLAW_FLOAT_SLIDERS
#endif

/* Vectors of four facets, or, with JOINTLAW_SCALAR, other compilers and CUDA, one facet at a time with
 * the same bits. AVX2 is selected at run time if the processor supports it, unless the compiler may
 * use it anyway, or JOINTLAW_NO_DISPATCH switches the selection off. */
#if defined(__GNUC__) && !defined(JOINTLAW_SCALAR) && !defined(__CUDACC__) \
    && !defined(__CUDACC_RTC__)
#define JL_W 4
#define JLAW_FACET_VECTORS
#endif
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__OPTIMIZE__) && !defined(__AVX2__) \
    && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)                           \
    && defined(JLAW_FACET_VECTORS) && !defined(JOINTLAW_NO_DISPATCH)
#define JLAW_MULTIVERSIONED __attribute__((target_clones("avx2", "default")))
#define JLAW_HAS_VERSIONS
#else
#define JLAW_MULTIVERSIONED
#endif
/* Each kind of a step is a function of its own: inlined into one function, they take 1.7 times the
 * memory to compile. A function whose version is selected at run time is never inlined. */
#if defined(__GNUC__) && !defined(__CUDACC__) && !defined(__CUDACC_RTC__)
#ifdef JLAW_HAS_VERSIONS
#define JL_STEP_FUNCTION JLAW_MULTIVERSIONED static
#else
#define JL_STEP_FUNCTION static __attribute__((noinline))
#endif
#define JM_STEP_FUNCTION static __attribute__((noinline))
#endif
#ifdef JOINTLAW_NO_DISSIPATION
enum { JLAW_TRACKS_DISSIPATION = 0 };
#else
enum { JLAW_TRACKS_DISSIPATION = 1 };
#endif

/* The law for as many joints as a vector of this processor has lanes */
#if defined(JOINTLAW_MANY) && defined(__AVX2__) && defined(__OPTIMIZE__) \
    && defined(JLAW_FACET_VECTORS)
#ifdef __AVX512DQ__
#define JM_W 8
#else
#define JM_W 4
#endif
#define JM_STATES_CONTIGUOUS
#include "many.h"
static void jlaw_step_vector_(const jlaw_law *law, double *s, size_t stride, const double *d,
                              double *F, double *C)
{
  const jm_states n = {s, 1, stride};
  const int dim = law->dim;
  jm_real p[3], f[3], c[9];
  for (int l = 0; l < JM_W; l++)
    for (int i = 0; i < dim; i++) p[i][l] = d[l * dim + i];
  jm_step_of_kind(law, n, p, f, c, JLAW_TRACKS_DISSIPATION, C != NULL, 0, NULL);
  for (int l = 0; l < JM_W; l++) {
    for (int i = 0; i < dim; i++) F[l * dim + i] = f[i][l];
    for (int i = 0; C && i < dim * dim; i++) C[l * dim * dim + i] = c[i][l];
  }
}
#endif
#if defined(__AVX512F__) \
    && !defined(__clang__) /* with AVX-512 the code of gcc for facets is slower */
#pragma GCC target("no-avx512f")
#endif

#include "lanes.h"
#include "elements.h"
#include "law.h"

/* ------------------------------------------------------------------ messages */

typedef struct { /* a buffer of `size` bytes, `at` of them written */
  char *to;
  size_t size, at;
} jlaw_message_;

static JLAW_FUNCTION void jlaw_append_(jlaw_message_ *text, const char *words)
{
  for (; *words && text->at + 1 < text->size; words++) text->to[text->at++] = *words;
  if (text->size) text->to[text->at] = 0;
}

/* Append a number with five digits, without stdio and its locale */
static JLAW_FUNCTION void jlaw_append_number_(jlaw_message_ *text, double x)
{
  char digits[24];
  int exponent = 0, n = 0;
  if (x < 0.0) jlaw_append_(text, "-");
  x = fabs(x);
  if (!(x <= DBL_MAX)) {
    jlaw_append_(text, x > DBL_MAX ? "inf" : "nan");
    return;
  }
  for (; x >= 10.0; exponent++) x /= 10.0;
  for (; x > 0.0 && x < 1.0; exponent--) x *= 10.0;
  int number = (int) (1e4 * x + 0.5);
  if (number > 99999) number /= 10, exponent++;
  for (int unit = 10000; unit; unit /= 10) {
    digits[n++] = (char) ('0' + number / unit % 10);
    if (n == 1) digits[n++] = '.';
  }
  digits[n++] = 'e';
  digits[n++] = exponent < 0 ? '-' : '+';
  exponent = exponent < 0 ? -exponent : exponent;
  for (int unit = exponent >= 100 ? 100 : 10; unit; unit /= 10)
    digits[n++] = (char) ('0' + exponent / unit % 10);
  digits[n] = 0;
  jlaw_append_(text, digits);
}

static JLAW_FUNCTION void jlaw_append_integer_(jlaw_message_ *text, int n)
{
  char digits[12];
  int at = (int) sizeof digits - 1;
  digits[at] = 0;
  do digits[--at] = (char) ('0' + n % 10);
  while (n /= 10);
  jlaw_append_(text, digits + at);
}

/* ------------------------------------------------------------------------ the step */

/* Phi at y, and Phi' */
static JLAW_FUNCTION double jlaw_first_loading_at_(const jlaw_law *law, double y, double *slope)
{
  jl_real forces, slopes;
  jl_first_loading_curve(law, jl_flush_underflow(jl_broadcast(y)), &forces, &slopes, (jl_real *) 0);
  *slope = JL_LANE(slopes, 0);
  return JL_LANE(forces, 0);
}

static JLAW_FUNCTION double jlaw_facet_value_(const jlaw_law *law, int facet, int at)
{
  return jl_facet_table(law, facet)[at * JLAW_FACET_LANES];
}

JLAW_MULTIVERSIONED JLAW_FUNCTION void jlaw_step(const jlaw_law *law, double *s, size_t stride,
                                                 const double *d, double *F, double *C)
{
  const jl_states n = {s, stride, 0};
  jl_step_of_kind(law, n, d, F, C, JLAW_TRACKS_DISSIPATION, C != NULL, 0, NULL);
}

#ifdef JLAW_FLOAT_SLIDERS
typedef union {
  double number;
  unsigned long long bits;
} jlaw_pair_;
typedef union {
  float number;
  unsigned int bits;
} jlaw_half_;

/* Read or write the pair of floats in a number of a state; pair[0]: q_s, pair[1]: q_t */
static JLAW_FUNCTION void jlaw_read_pair_(const double *q, double pair[2])
{
  jlaw_pair_ both;
  jlaw_half_ half;
  both.number = *q;
  for (int i = 0; i < 2; i++) half.bits = (unsigned int) (both.bits >> (32 * i)), pair[i] = half.number;
}
static JLAW_FUNCTION void jlaw_write_pair_(double *q, const double pair[2])
{
  jlaw_pair_ both;
  jlaw_half_ half;
  both.bits = 0;
  for (int i = 0; i < 2; i++)
    half.number = (float) pair[i], both.bits |= (unsigned long long) half.bits << (32 * i);
  *q = both.number;
}

/* Whether all slider forces are finite; q: n pairs */
static JLAW_FUNCTION int jlaw_sliders_are_valid_(const double *q, int n)
{
  double sum = 0.0;
  for (int i = 0; i < n; i++) {
    double pair[2];
    jlaw_read_pair_(q + i, pair);
    sum += fabs(pair[0]) + fabs(pair[1]);
  }
  return sum <= DBL_MAX;
}
#else
/* Whether all slider forces are finite and of admissible size */
static JLAW_FUNCTION int jlaw_sliders_are_valid_(const double *q, int n)
{
  double sum[4] = {0.0, 0.0, 0.0, 0.0};
  int i = 0;
  for (; i + 4 <= n; i += 4)
    for (int l = 0; l < 4; l++) sum[l] += q[i + l] * q[i + l];
  for (; i < n; i++) sum[0] += q[i] * q[i];
  return (sum[0] + sum[1]) + (sum[2] + sum[3]) < JLAW_MAX_SLIDER_SQUARES;
}
#endif

/* Whether energies, plastic indentations, degradation and damage of a state are valid for this law */
static JLAW_FUNCTION int jlaw_state_is_valid_(const jlaw_law *law, const double *s)
{
  const double *plastic = s + jl_plastic_row(law), *degradation = s + jl_degradation_row(law);
  int valid = fabs(s[law->dim]) <= DBL_MAX;
  for (int f = 0; law->yields && f < law->facets; f++)
    valid = valid && plastic[f] >= 0.0 && plastic[f] <= law->max_effective_closure;
  if (law->yields) valid = valid && fabs(plastic[law->facets]) <= DBL_MAX;
  if (jl_slopes_change(law)) valid = valid && degradation[0] >= 0.0 && degradation[0] <= 1.0;
  if (law->degrades) valid = valid && degradation[1] >= 0.0 && degradation[1] <= DBL_MAX;
  if (law->degrades_by_stress) {
    const double peak = s[jl_peak_stress_row(law)];
    valid = valid && peak >= 0.0 && peak <= DBL_MAX;
  }
  jl_rows rows[JLAW_ELEMENT_ROW_NAMES];
  const int names = jl_has_elements(law) ? jl_list_rows(law, jl_element_row(law), rows) : 0;
  for (int i = 0; i < names; i++)
    for (int j = rows[i].first; j < rows[i].first + rows[i].count; j++)
      valid = valid && s[j] >= rows[i].lower && s[j] <= rows[i].upper;
  return valid
         && jlaw_sliders_are_valid_(s + jl_slider_row(law),
                                    jl_plastic_row(law) - jl_slider_row(law));
}

enum { JLAW_STATE_PARTS = 8 + JLAW_ELEMENT_ROW_NAMES };

/* List the parts of a state in their order, by the names of a snapshot in Python, with the bounds of
 * their numbers; returns how many */
static JLAW_FUNCTION int jlaw_list_state_parts_(const jlaw_law *law, jl_rows parts[JLAW_STATE_PARTS])
{
  const int M = law->facets, D = law->cells;
  const double delta = law->max_effective_closure / law->closure_per_displacement;
  const jl_rows asperities[8] = {
      {"delta", 0, law->dim, 0, 0, -delta, delta},
      {"dissipated_energy", law->dim, 1, 0, 0, -DBL_MAX, DBL_MAX},
      {"q", jl_slider_row(law), JL_NUMBERS_PER_SLIDER * M * D, 0, 0, -DBL_MAX, DBL_MAX},
      {"indentation", jl_plastic_row(law), law->yields * M, 0, 0, 0.0, law->max_effective_closure},
      {"plastic_work", jl_plastic_row(law) + M, law->yields, 0, 0, -DBL_MAX, DBL_MAX},
      {"lost_slopes", jl_degradation_row(law), jl_slopes_change(law), 0, 0, 0.0, 1.0},
      {"shear_work", jl_degradation_row(law) + 1, law->degrades, 0, 0, 0.0, DBL_MAX},
      {"peak_contact_stress", jl_peak_stress_row(law), law->degrades_by_stress, 0, 0, 0.0, DBL_MAX}};
  int n = 0;
  for (int i = 0; i < 8; i++)
    if (asperities[i].count) parts[n++] = asperities[i];
  return n + jl_list_rows(law, jl_element_row(law), parts + n);
}

/* Write which number of a state is out of bounds, its value and its bound */
static JLAW_FUNCTION void jlaw_report_state_(const jlaw_law *law, const double *s,
                                             jlaw_message_ *text)
{
  jl_rows parts[JLAW_STATE_PARTS];
  const int n = jlaw_list_state_parts_(law, parts);
  for (int i = 0; i < n; i++)
    for (int j = 0; j < parts[i].count; j++) {
      const double x = s[parts[i].first + j];
      if (x >= parts[i].lower && x <= parts[i].upper) continue;
      jlaw_append_(text, parts[i].name);
      if (parts[i].count > 1) {
        jlaw_append_(text, "[");
        jlaw_append_integer_(text, j);
        jlaw_append_(text, "]");
      }
      jlaw_append_(text, " (number ");
      jlaw_append_integer_(text, parts[i].first + j);
      jlaw_append_(text, ") of the state is ");
      jlaw_append_number_(text, x);
      if (x != x) return;
      jlaw_append_(text, x > parts[i].upper ? ", above its bound " : ", below its bound ");
      jlaw_append_number_(text, x > parts[i].upper ? parts[i].upper : parts[i].lower);
      return;
    }
  /* each number is within its bounds: a sum of them is not */
  if (!jlaw_sliders_are_valid_(s + jl_slider_row(law), jl_plastic_row(law) - jl_slider_row(law))) {
#ifdef JLAW_FLOAT_SLIDERS
    jlaw_append_(text, "q of the state has a float that is not finite");
#else
    jlaw_append_(text, "q of the state has a sum of squares above ");
    jlaw_append_number_(text, JLAW_MAX_SLIDER_SQUARES);
#endif
  } else jlaw_append_(text, "delta of the state is too large");
}

static JLAW_FUNCTION int jlaw_report_invalid_(const jlaw_law *law, const double *s, const double *d,
                                              int state_is_invalid, char *message, size_t size)
{
  jlaw_message_ text = {message, size, 0};
  int finite = 1;
  if (state_is_invalid) {
    jlaw_report_state_(law, s, &text);
    jlaw_append_(&text, "; the state is unchanged. Start from zeros or from a state that this law "
                        "wrote");
    return -1;
  }
  for (int i = 0; i < law->dim; i++) {
    jlaw_append_(&text, i ? ", " : "the step d = (");
    jlaw_append_number_(&text, d[i]);
    finite = finite && fabs(d[i]) <= DBL_MAX;
  }
  jlaw_append_(&text, finite ? ") m from closure "
                             : ") m is not finite; the state is unchanged. Check the motion that "
                               "the host computes");
  if (!finite) return -1;
  jlaw_append_number_(&text, s[0]);
  jlaw_append_(&text, " m exceeds the admissible closure of ");
  jlaw_append_number_(&text, law->max_effective_closure);
  jlaw_append_(&text,
               " m, above which forces overflow; the state is unchanged. Use a smaller step");
  return -1;
}

/* Whether sliders can have forces that do not fit into a float at this effective closure */
static JLAW_FUNCTION int jlaw_sliders_overflow_(const jlaw_law *law, double closure)
{
#ifdef JLAW_FLOAT_SLIDERS
  double slope;
  const double strength = law->mu / law->stiffness_ratio * law->stiffness_factor;
  return law->asperities
         && !(strength * jlaw_first_loading_at_(law, closure, &slope) <= JLAW_MAX_FLOAT_FORCE);
#else
  (void) law, (void) closure;
  return 0;
#endif
}

/* Whether jlaw_update accepts a state and a step; state_is_invalid: whether the state is the reason */
static JLAW_FUNCTION int jlaw_step_is_valid_(const jlaw_law *law, const double *s, const double *d,
                                             int *state_is_invalid)
{
  double distance = 0.0, step_size = 0.0; /* NaN propagates through sums */
  for (int i = 0; i < law->dim; i++) distance += fabs(s[i]), step_size += fabs(d[i]);
  const double bound = law->closure_per_displacement;
  *state_is_invalid =
      !(bound * distance <= law->max_effective_closure) || !jlaw_state_is_valid_(law, s);
  return !*state_is_invalid
         && bound * (distance + step_size) <= law->max_effective_closure
         && !jlaw_sliders_overflow_(law, bound * (distance + step_size));
}

JLAW_FUNCTION int jlaw_update(const jlaw_law *law, const double *s0, double *s1, const double *d,
                              double *F, double *C, char *message, size_t size)
{
  int state_is_invalid;
  if (!jlaw_step_is_valid_(law, s0, d, &state_is_invalid))
    return jlaw_report_invalid_(law, s0, d, state_is_invalid, message, size);
  if (s1 != s0)
    for (int i = 0; i < jl_state_rows(law); i++) s1[i] = s0[i];
  jlaw_step(law, s1, 1, d, F, C);
  return 0;
}

JLAW_FUNCTION size_t jlaw_update_many(const jlaw_law *law, double *states, size_t stride,
                                      const double *d, double *F, double *C, size_t n)
{
  const size_t dim = (size_t) law->dim;
  size_t valid = 0, at = 0;
  for (int state_is_invalid; valid < n; valid++)
    if (!jlaw_step_is_valid_(law, states + valid * stride, d + valid * dim, &state_is_invalid))
      break;
#ifdef JM_W
  for (; at + JM_W <= valid; at += JM_W)
    jlaw_step_vector_(law, states + at * stride, stride, d + at * dim, F + at * dim,
                      C ? C + at * dim * dim : NULL);
#endif
  for (; at < valid; at++)
    jlaw_step(law, states + at * stride, 1, d + at * dim, F + at * dim,
              C ? C + at * dim * dim : NULL);
  return valid;
}

/* -------------------------------------------------------- evaluation of a state */

JLAW_FUNCTION int jlaw_dim(const jlaw_law *law) { return law->dim; }
JLAW_FUNCTION int jlaw_state_size(const jlaw_law *law) { return jl_state_rows(law); }
JLAW_FUNCTION const char *jlaw_fingerprint(const jlaw_law *law) { return law->fingerprint; }
JLAW_FUNCTION double jlaw_tensile_opening(const jlaw_law *law) { return law->tensile_opening; }

JLAW_FUNCTION int jlaw_has_damage(const jlaw_law *law)
{
  jl_rows rows[JLAW_ELEMENT_ROW_NAMES];
  const int names = jl_list_rows(law, jl_element_row(law), rows);
  int has_damage = 0;
  for (int i = 0; i < names; i++) has_damage = has_damage || rows[i].is_damage;
  return has_damage;
}

JLAW_FUNCTION void jlaw_break_bond(const jlaw_law *law, double *s)
{
  jl_rows rows[JLAW_ELEMENT_ROW_NAMES];
  const int names = jl_list_rows(law, jl_element_row(law), rows);
  for (int i = 0; i < names; i++)
    if (rows[i].is_damage) s[rows[i].first] = rows[i].upper; /* as after separation */
}

JLAW_FUNCTION int jlaw_init_unmated(const jlaw_law *law, double *s)
{
  const int separates = law->interlock_decays && law->dim > 1;
  for (int i = 0; i < jl_state_rows(law); i++) s[i] = 0.0;
  if (separates) s[0] = law->first_touch_closure, s[1] = JLAW_UNMATED_DISTANCE * law->mating_length;
  jlaw_break_bond(law, s);
  return separates ? 0 : -1;
}

JLAW_FUNCTION double jlaw_dissipated_energy(const jlaw_law *law, const double *s)
{
  return s[law->dim];
}

JLAW_MULTIVERSIONED static JLAW_FUNCTION jl_measures jlaw_measure_(const jlaw_law *law,
                                                                   const double *s)
{
  const jl_states n = {(double *) s, 1, 0}; /* only read */
  return jl_measure(law, n);
}

JLAW_MULTIVERSIONED JLAW_FUNCTION void jlaw_traction(const jlaw_law *law, const double *s, double *F)
{
  const jl_states n = {(double *) s, 1, 0}; /* only read */
  jl_traction(law, n, F);
}

JLAW_FUNCTION double jlaw_stored_energy(const jlaw_law *law, const double *s)
{
  return jlaw_measure_(law, s).stored;
}

JLAW_FUNCTION void jlaw_contact_fractions(const jlaw_law *law, const double *s, double fractions[3])
{
  const jl_measures all = jlaw_measure_(law, s);
  fractions[0] = all.sliding;
  fractions[1] = all.slipping;
  fractions[2] = all.separated;
}

/* ------------------------------------------------------------ unsheared joint */

/* Sine of the inclination of a facet whose slope is tan_theta, at a contact stress over the
 * degradation stress */
static JLAW_FUNCTION double jlaw_degraded_sine_(const jlaw_law *law, double tan_theta,
                                                double relative_stress)
{
  const double slope = tan_theta
                       * (law->slope_residual + (1.0 - law->slope_residual) / (1.0 + relative_stress));
  return slope / sqrt(1.0 + slope * slope);
}

/* Normal stress of asperities that degrade by stress: DegradingFacets of
 * discretisation/first_loading_response.py */
static JLAW_FUNCTION double jlaw_degraded_stress_(const jlaw_law *law, double closure)
{
  const double nodes[4][2] = {
      /* of Gauss and Legendre on (-1, 1), one half, and weights */
      {0.1834346424956498, 0.362683783378362},
      {0.525532409916329, 0.31370664587788727},
      {0.7966664774136267, 0.22238103445337448},
      {0.9602898564975363, 0.10122853629037626}};
  double slope, contact_stress = 0.0, friction = 0.0;
  const double force = jlaw_first_loading_at_(law, closure, &slope);
  for (int f = 0; f < law->facets; f++) {
    const double y_p = jlaw_facet_value_(law, f, JLAW_YIELD_CLOSURE);
    const double indented = law->yields ? jlaw_first_loading_at_(law, closure - y_p, &slope) : 0.0;
    contact_stress += jlaw_facet_value_(law, f, JLAW_ENERGY_FACTOR) * (force - indented);
  }
  const double relative_stress = contact_stress / law->degradation_stress;
  const double top = log1p(relative_stress);
  for (int f = 0; f < law->facets; f++) {
    const double y_p = jlaw_facet_value_(law, f, JLAW_YIELD_CLOSURE);
    const double indented = law->yields ? jlaw_first_loading_at_(law, closure - y_p, &slope) : 0.0;
    const double c1 = jlaw_facet_value_(law, f, JLAW_COS_THETA),
                 tan_theta = jlaw_facet_value_(law, f, JLAW_TAN_THETA),
                 A = jlaw_facet_value_(law, f, JLAW_A);
    const double sine = jlaw_degraded_sine_(law, tan_theta, relative_stress);
    double mean = top > 0.0 ? 0.0 : sine;
    for (int i = 0; top > 0.0 && i < 8; i++) {
      const double x = 0.5 * (i < 4 ? 1.0 - nodes[i][0] : 1.0 + nodes[i - 4][0]);
      mean += exp(x * top) * (0.5 * nodes[i % 4][1] * top / relative_stress)
              * jlaw_degraded_sine_(law, tan_theta, expm1(x * top));
    }
    const double stick = mean * force * law->stiffness_ratio / c1;
    const double slip = law->mu * c1 * (force - indented) / sqrt(1.0 - sine * sine);
    friction += A * sine * (stick < slip ? stick : slip);
  }
  return contact_stress + friction;
}

JLAW_FUNCTION double jlaw_normal_stress(const jlaw_law *law, double closure)
{
  double slope, yield_correction = 0.0;
  if (!(closure <= law->max_effective_closure)) return NAN;
  for (int f = 0; law->yields && !law->degrades_by_stress && f < law->facets;
       f++) /* less stress by yielding */
    for (int i = JLAW_YIELD_CORRECTION; i < JLAW_YIELD_CORRECTION + 4; i += 2) {
      const double depth = jlaw_facet_value_(law, f, i + 1);
      yield_correction +=
          jlaw_facet_value_(law, f, i) * jlaw_first_loading_at_(law, closure - depth, &slope);
    }
  double stress =
      law->asperities
          ? law->normal_stress_factor * jlaw_first_loading_at_(law, closure, &slope) - yield_correction
          : 0.0;
  if (law->degrades_by_stress) stress = jlaw_degraded_stress_(law, closure);
#define JL_FIRST(name)                                                          \
  if (law->name) {                                                              \
    jl_element_step p = {{0.0}, {closure, 0.0, 0.0}, {0.0}, {0.0}, {0.0}, 0.0}; \
    jl_##name##_step(law, &p, 0);                                               \
    stress += p.F[0];                                                           \
  }
  JLAW_ELEMENTS(JL_FIRST)
#undef JL_FIRST
  return stress;
}

JLAW_FUNCTION double jlaw_max_stiffness(const jlaw_law *law, double closure)
{
  double slope = 0.0;
  if (!(closure <= law->max_effective_closure)) return NAN;
  const double force = law->asperities ? jlaw_first_loading_at_(law, closure, &slope) : 0.0;
  return law->stiffness_factor * JL_LANE(jl_facet_stiffness_bound(law, jl_broadcast(slope)), 0)
         + law->curvature_stiffness_factor * force + jl_elements_stiffness_bound(law, NULL, 0, 1);
}

JLAW_FUNCTION double jlaw_closure(const jlaw_law *law, double normal_stress)
{
  double low = 0.0, high = law->max_search_closure;
  if (!(normal_stress >= 0.0 && jlaw_normal_stress(law, high) >= normal_stress)) return NAN;
  while (1) { /* bisection: of the exponent at first, then of the number */
    const double middle =
        high > 4.0 * low && high > 1e-300 ? sqrt(high * fmax(low, 1e-300)) : 0.5 * (low + high);
    if (!(middle > low && middle < high)) return low == 0.0 ? 0.0 : high;
    if (jlaw_normal_stress(law, middle) < normal_stress) low = middle;
    else high = middle;
  }
}

/* Close a virgin joint by one step; returns F[0] less the normal stress, and C[0] */
static JLAW_FUNCTION double jlaw_close_virgin_(const jlaw_law *law, double *s, double closure,
                                               double normal_stress, double *F, double *stiffness)
{
  const double d[3] = {closure, 0.0, 0.0};
  double C[9];
  for (int i = 0; i < jl_state_rows(law); i++) s[i] = 0.0;
  jlaw_step(law, s, 1, d, F, C);
  *stiffness = C[0];
  return F[0] - normal_stress;
}

JLAW_FUNCTION int jlaw_preload(const jlaw_law *law, double *s, double normal_stress, double *F)
{
  double closure = jlaw_closure(law, normal_stress), low = 0.0, high = law->max_search_closure;
  const int has_solution = closure >= 0.0; /* not NaN */
  for (int i = 0; i < jl_state_rows(law); i++) s[i] = 0.0;
  for (int i = 0; i < law->dim; i++) F[i] = 0.0;
  if (!has_solution || closure == 0.0) return has_solution ? 0 : -1;
  double stiffness, excess = jlaw_close_virgin_(law, s, closure, normal_stress, F, &stiffness);
  if (!law->yields && !law->degrades_by_stress) return 0; /* one step is as good as many */
  for (int i = 0; i < 200 && fabs(excess) > 1e-14 * normal_stress; i++) { /* rounding */
    if (excess < 0.0) low = closure;
    else high = closure;
    double next = closure - excess / stiffness;
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next == closure || !(next > low && next < high)) break; /* neighbouring numbers */
    closure = next;
    excess = jlaw_close_virgin_(law, s, closure, normal_stress, F, &stiffness);
  }
  return 0;
}

/* -------------------------------------------------------------- rotated axes */

/* x, or 0.0 for a negative zero: a step writes positive zeros only, and leaves sliders of cells that are
 * not loaded as they are, so negative zeros would make equal states differ in their bits */
static JLAW_FUNCTION double jlaw_positive_zero_(double x) { return x + 0.0; }

/* Rotate or reflect the vectors of the elements in the plane of the joint */
static JLAW_FUNCTION void jlaw_rotate_elements_(const jlaw_law *law, double *s,
                                                const double rotation[2][2])
{
  jl_rows rows[JLAW_ELEMENT_ROW_NAMES];
  const int names = jl_list_rows(law, jl_element_row(law), rows);
  for (int i = 0; i < names; i++) {
    double *q = s + rows[i].first;
    const int count = rows[i].is_vector ? rows[i].count : 0;
    const double old[2] = {count > 0 ? q[0] : 0.0, count > 1 ? q[1] : 0.0};
    for (int j = 0; j < count; j++)
      q[j] = jlaw_positive_zero_(rotation[j][0] * old[0] + rotation[j][1] * old[1]);
  }
}

/* Forces (q_s, q_t) of the slider of a cell; q: the sliders of a state */
static JLAW_FUNCTION void jlaw_get_slider_(const jlaw_law *law, const double *q, int cell,
                                           double force[2])
{
#ifdef JLAW_FLOAT_SLIDERS
  (void) law;
  jlaw_read_pair_(q + cell, force);
#else
  force[0] = q[cell], force[1] = q[law->facets * law->cells + cell];
#endif
}

/* Store them, with JLAW_FLOAT_SLIDERS to the nearest float, zeros without a sign */
static JLAW_FUNCTION void jlaw_set_slider_(const jlaw_law *law, double *q, int cell,
                                           const double force[2])
{
#ifdef JLAW_FLOAT_SLIDERS
  const double pair[2] = {jlaw_positive_zero_(force[0]), jlaw_positive_zero_(force[1])};
  (void) law;
  jlaw_write_pair_(q + cell, pair);
#else
  q[cell] = jlaw_positive_zero_(force[0]);
  q[law->facets * law->cells + cell] = jlaw_positive_zero_(force[1]);
#endif
}

JLAW_FUNCTION void jlaw_swap_bodies(const jlaw_law *law, double *s)
{
  const int dim = law->dim, D = law->cells, M = law->facets;
  if (dim > 1) s[1] = jlaw_positive_zero_(-s[1]); /* shear along axis 2 */
  double *q = s + jl_slider_row(law), *z = s + jl_plastic_row(law);
  for (int f = 0; f < M; f++) {
    const int other =
        (int) jlaw_facet_value_(law, f, JLAW_MIRROR); /* f itself at a right angle to axis 2 */
    if (other < f) continue;                          /* already exchanged */
    for (int i = 0; i < D; i++) {
      double of_f[2], of_other[2];
      jlaw_get_slider_(law, q, f * D + i, of_f);
      jlaw_get_slider_(law, q, other * D + i, of_other);
      of_f[1] = -of_f[1], of_other[1] = -of_other[1]; /* t reverses */
      jlaw_set_slider_(law, q, f * D + i, of_other);
      jlaw_set_slider_(law, q, other * D + i, of_f);
    }
    if (!law->yields) continue;
    const double z_f = z[f];
    z[f] = z[other], z[other] = z_f;
  }
  const double swap[2][2] = {{-1.0, 0.0}, {0.0, 1.0}};
  jlaw_rotate_elements_(law, s, swap);
}

/* Interpolate the numbers of n facets of one inclination, `spacing` from one another, at azimuths
 * rotated by the angle: trigonometrically (n is even), or linearly, which creates no new extremes */
static JLAW_FUNCTION void jlaw_rotate_ring_(double *x, int n, int spacing, double angle, int linear)
{
  double old[JLAW_MAX_AZIMUTHS];
  const double pi = 3.14159265358979323846;
  for (int j = 0; j < n; j++) old[j] = x[j * spacing], x[j * spacing] = 0.0;
  for (int j = 0; j < n; j++)
    for (int k = 0; k < n; k++) {
      const double phi = remainder(angle + 2.0 * pi * (j - k) / n, 2.0 * pi), half = sin(0.5 * phi);
      double weight = 1.0;
      if (linear) weight = fmax(1.0 - fabs(phi) * n / (2.0 * pi), 0.0);
      else if (fabs(half) > 1e-9) weight = sin(0.5 * n * phi) * cos(0.5 * phi) / (n * half);
      x[j * spacing] += weight * old[k];
    }
}

/* Rotate the slider forces of the cells `cell` of n facets of one inclination, D cells from facet to
 * facet */
static JLAW_FUNCTION void jlaw_rotate_sliders_(const jlaw_law *law, double *s, int cell, int n,
                                               double angle)
{
  const int D = law->cells;
  double *q = s + jl_slider_row(law);
#ifdef JLAW_FLOAT_SLIDERS
  double force[2][JLAW_MAX_AZIMUTHS], rotated[2][JLAW_MAX_AZIMUTHS];
  const unsigned long long key = jl_rounding_key(s, law->dim);
  for (int j = 0; j < n; j++) {
    double pair[2];
    jlaw_get_slider_(law, q, cell + j * D, pair);
    for (int i = 0; i < 2; i++) force[i][j] = rotated[i][j] = pair[i];
  }
  for (int i = 0; i < 2; i++) jlaw_rotate_ring_(rotated[i], n, 1, angle, 0);
  for (int j = 0; j < n; j++) {
    jl_real qs = jl_broadcast(rotated[0][j]), qt = jl_broadcast(rotated[1][j]);
    jl_round_sliders(jl_rounding_noise(key, cell + j * D, 0, jl_broadcast(force[0][j]),
                                       jl_broadcast(force[1][j])),
                     &qs, &qt);
    const double pair[2] = {JL_LANE(qs, 0), JL_LANE(qt, 0)};
    jlaw_set_slider_(law, q, cell + j * D, pair);
  }
#else
  jlaw_rotate_ring_(q + cell, n, D, angle, 0);
  jlaw_rotate_ring_(q + law->facets * D + cell, n, D, angle, 0);
#endif
}

/* Return sliders that exceed their friction limit to it */
static JLAW_FUNCTION void jlaw_limit_sliders_(const jlaw_law *law, double *s)
{
  const jl_states n = {s, 1, 0};
#ifdef JLAW_FLOAT_SLIDERS
  const jl_joint_bits key = jl_rounding_key(s, law->dim);
#endif
  const int M = law->facets, D = law->cells;
  for (int at = 0; at < M; at += JL_FACETS_PER_PASS) {
    const int count = M - at < JL_FACETS_PER_PASS ? M - at : JL_FACETS_PER_PASS;
    const double *cell = jl_cell_table(law, at);
    jl_facet_step o;
    jl_evaluate_facets(law, n, at, &o);
    for (int i = 0; i < D; i++, cell += JLAW_ROWS * JLAW_FACET_LANES) {
      const int row = jl_slider_row(law) + at * D + i;
      jl_real G, kappa, qs, qt;
      jl_load_sliders(n, row, M * D, D, count, &qs, &qt);
      jl_evaluate_cell(cell, o.y1, o.f1, o.k1, o.z1, o.fz1, o.kz1, law->yields, &G, &kappa);
      const jl_real limit = o.strength * G;
      const jl_real size = jl_sqrt(qs * qs + qt * qt);
      const jl_mask exceeds = size > JL_LIMIT_FACTOR * limit;
      const jl_real factor = jl_select(exceeds, limit / jl_select(exceeds, size, 1.0), 1.0);
#ifdef JLAW_FLOAT_SLIDERS
      const jl_bits noise = jl_rounding_noise(key, at * D + i, D, qs, qt);
      qs = qs * factor, qt = qt * factor;
      jl_round_sliders(noise, &qs, &qt);
      jl_store_sliders(n, row, M * D, D, count, qs, qt);
#else
      jl_store_sliders(n, row, M * D, D, count, qs * factor + 0.0, qt * factor + 0.0);
#endif
    }
  }
}

JLAW_FUNCTION void jlaw_rotate(const jlaw_law *law, double *s, double angle)
{
  const int dim = law->dim, D = law->cells, M = law->facets;
  const double before = jlaw_measure_(law, s).sheared, c = cos(angle), d = sin(angle);
  double *q = s + jl_slider_row(law), *z = s + jl_plastic_row(law);
  if (dim == 2 && c < 0.0) jlaw_swap_bodies(law, s); /* the axis reverses */
  if (dim != 3) return;
  const double along = s[1], across = s[2];
  s[1] = jlaw_positive_zero_(c * along + d * across);
  s[2] = jlaw_positive_zero_(c * across - d * along);
  const double rotation[2][2] = {{c, d}, {-d, c}};
  jlaw_rotate_elements_(law, s, rotation);
  for (int f = 0, n; f < M; f += n) { /* inclinations */
    n = (int) jlaw_facet_value_(law, f, JLAW_RING_SIZE);
    for (int i = 0; i < D; i++) jlaw_rotate_sliders_(law, s, f * D + i, n, angle);
    if (law->yields) jlaw_rotate_ring_(z + f, n, 1, angle, 1);
  }
  jlaw_limit_sliders_(law, s);
  const double after = jlaw_measure_(law, s).sheared;
  if (after > before) /* interpolation must not add energy */
    for (int i = 0; i < M * D; i++) {
      double force[2];
      jlaw_get_slider_(law, q, i, force);
      force[0] *= sqrt(before / after), force[1] *= sqrt(before / after);
      jlaw_set_slider_(law, q, i, force);
    }
  else s[dim] += before - after;
}

/* ------------------------------------------------------------- table files */
#ifndef JOINTLAW_NO_FILES

#define JLAW_MAX_FILE_BYTES (1L << 28) /* of a table file; laws have 1e5 to 1e7 */

/* Read a file and append a zero byte; NULL if it cannot be read */
static char *jlaw_read_bytes_(const char *file, size_t *length)
{
  FILE *stream = fopen(file, "rb");
  const long size = stream && !fseek(stream, 0, SEEK_END) ? ftell(stream) : -1;
  char *bytes = size >= 0 && size < JLAW_MAX_FILE_BYTES ? (char *) malloc((size_t) size + 1) : NULL;
  if (bytes) {
    rewind(stream);
    *length = fread(bytes, 1, (size_t) size, stream);
    bytes[*length] = 0;
  }
  if (stream) fclose(stream);
  return bytes;
}

/* 64-bit FNV-1a hash, without carriage returns: any other change of one byte changes it */
static unsigned long long jlaw_checksum_(const char *bytes, const char *end)
{
  unsigned long long sum = 0xCBF29CE484222325ULL;
  for (; bytes < end; bytes++)
    if (*bytes != '\r') sum = (sum ^ (unsigned char) *bytes) * 0x100000001B3ULL;
  return sum;
}

/* Skip blanks and comment lines, which begin with # */
static const char *jlaw_skip_blanks_(const char *at)
{
  while (*at == ' ' || *at == '\n' || *at == '\r' || *at == '#')
    if (*at++ == '#')
      while (*at && *at != '\n') at++;
  return at;
}

/* Read a word into `word`; empty if there is none or it is too long */
static const char *jlaw_read_word_(const char *at, char *word, size_t room)
{
  size_t n = 0;
  for (at = jlaw_skip_blanks_(at); *at > ' ' && n + 1 < room; at++) word[n++] = *at;
  word[*at > ' ' ? 0 : n] = 0;
  return at;
}

/* Read a finite number; NULL if there is none. Floats are hexadecimal without a decimal point, so that
 * they depend on neither locale nor rounding. */
static const char *jlaw_read_number_(const char *at, double *number)
{
  const char *begin = jlaw_skip_blanks_(at);
  char *end;
  *number = strtod(begin, &end);
  return end > begin && *end <= ' ' && fabs(*number) <= DBL_MAX ? end : NULL;
}

/* Read the integers and floats of a law; NULL, or the reason for a failure */
static const char *jlaw_parse_scalars_(const char **at, jlaw_law *law)
{
#define X(name, is_integer, lower, upper) \
  {#name, offsetof(jlaw_law, name), is_integer, lower, upper},
  static const struct {
    const char *name;
    size_t offset;
    int is_integer;
    double lower, upper;
  } keys[] = {JLAW_KEYWORDS(X)};
#undef X
  char word[sizeof law->fingerprint];
  for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
    double number;
    char *to = (char *) law + keys[i].offset;
    *at = jlaw_read_word_(*at, word, sizeof word);
    if (strcmp(word, keys[i].name)) return "a keyword is missing, unknown or out of order";
    *at = jlaw_read_number_(*at, &number);
    if (!*at || !(number >= keys[i].lower && number <= keys[i].upper))
      return "a parameter is not a number or out of bounds";
    const int integer = (int) (keys[i].is_integer ? number : 0.0);
    if (keys[i].is_integer) memcpy(to, &integer, sizeof integer);
    else memcpy(to, &number, sizeof number);
  }
  return NULL;
}

/* Parse the text of a table file; NULL, or the reason for a failure */
static const char *jlaw_parse_(const char *at, jlaw_law *law, size_t length)
{
  char word[sizeof law->fingerprint];
  at = jlaw_read_word_(at, word, sizeof word);
  if (strcmp(word, "fingerprint")) return "its fingerprint is missing";
  at = jlaw_read_word_(at, law->fingerprint, sizeof law->fingerprint - sizeof JLAW_STORAGE);
  strcat(law->fingerprint, JLAW_STORAGE);
  const char *error = jlaw_parse_scalars_(&at, law);
  if (error) return error;
  const size_t blocks = (size_t) (law->facets + JLAW_FACET_LANES - 1) / JLAW_FACET_LANES;
  const char *words[4] = {"facet", "depth", "curve", "energy"};
  const size_t sizes[4] = {blocks * JLAW_COLUMNS * JLAW_FACET_LANES,
                           blocks * (size_t) law->cells * JLAW_ROWS * JLAW_FACET_LANES,
                           4 * (size_t) law->pieces, 4 * (size_t) law->pieces};
  const size_t total = sizes[0] + sizes[1] + sizes[2] + sizes[3];
  if (total > length / 2) return "its sizes are inconsistent";
  double *to = law->memory = (double *) malloc(total * sizeof *law->memory);
  if (!to) return "no memory is left for it";
  for (int i = 0; i < 4; i++) {
    at = jlaw_read_word_(at, word, sizeof word);
    if (strcmp(word, words[i])) return "a table is missing, too short or too long";
    for (size_t n = 0; n < sizes[i]; n++, to++)
      if (!(at = jlaw_read_number_(at, to))) return "a table has an entry that is not a number";
  }
  law->facet = law->memory, law->depth = law->facet + sizes[0];
  law->curve = law->depth + sizes[1], law->energy = law->curve + sizes[2];
  for (size_t n = 0; n < sizes[0]; n++) { /* column A and all later columns are >= 0 */
    const size_t column = n / JLAW_FACET_LANES % JLAW_COLUMNS;
    if ((column >= JLAW_A && !(law->facet[n] >= 0.0))
        || (column == JLAW_MIRROR && !(law->facet[n] < law->facets)))
      return "a facet is out of bounds";
  }
  for (int f = 0; f < law->facets;) {
    const double ring = jlaw_facet_value_(law, f, JLAW_RING_SIZE);
    if (!(ring >= 1.0 && ring <= (double) JLAW_MAX_AZIMUTHS && ring <= law->facets - f))
      return "the number of facets of an inclination is out of bounds";
    f += (int) ring;
  }
  return *jlaw_skip_blanks_(at) ? "there is text after the last table" : NULL;
}

/* Check version and checksum of a table file, then parse it; NULL, or the reason for a failure */
static const char *jlaw_parse_file_(char *bytes, size_t length, jlaw_law *law)
{
  static const char magic[] = "jointlaw tables ";
  const char *at = bytes + sizeof magic - 1;
  double version;
  if (strncmp(bytes, magic, sizeof magic - 1)) return "it is not a table file of jointlaw";
  at = jlaw_read_number_(at, &version);
  if (!at || version != JLAW_TABLE_FORMAT)
    return "it has another format than this jointlaw.h; export law and header again, together";
  char *end = bytes + length, word[20];
  while (end > bytes && end[-1] <= ' ' && end[-1] >= 0) end--;
  while (end > bytes && end[-1] != '\n') end--; /* to the last line */
  const char *sum = jlaw_read_word_(jlaw_read_word_(end, word, sizeof word), word, sizeof word);
  if (strncmp(end, "sum ", 4) || strspn(word, "0123456789abcdef") != 16 || word[16]
      || *jlaw_skip_blanks_(sum))
    return "it is truncated: copy the complete file again";
  if (strtoull(word, NULL, 16) != jlaw_checksum_(bytes, end))
    return "it is damaged: its checksum is wrong; export it again";
  *end = 0;
  return jlaw_parse_(at, law, length);
}

jlaw_law *jlaw_read(const char *file, char *message, size_t size)
{
  jlaw_message_ text = {message, size, 0};
  size_t length = 0;
  const char *error = "it cannot be read";
  char *bytes = jlaw_read_bytes_(file, &length);
  jlaw_law *law = (jlaw_law *) calloc(1, sizeof *law);
  if (bytes && law) error = jlaw_parse_file_(bytes, length, law);
  free(bytes);
  if (!error) return law;
  jlaw_free(law);
  jlaw_append_(&text, file);
  jlaw_append_(&text, ": ");
  jlaw_append_(&text, error);
  return NULL;
}

void jlaw_free(jlaw_law *law)
{
  if (law) free(law->memory);
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
