/* library.c: which of the compiled texts this processor runs */
#include "batch.h"
#if defined(__x86_64__)
#include <cpuid.h>
#endif

#ifdef __cplusplus
#define IN_C extern "C"
#else
#define IN_C
#endif
#ifdef _WIN32
#define OUT IN_C __declspec(dllexport)
#else
#define OUT IN_C __attribute__((visibility("default")))
#endif

#define KINDS(X, KIND) \
  X jlaw_advance##KIND, jlaw_measure##KIND, jlaw_refresh##KIND, jlaw_stiffness##KIND
#if defined(__x86_64__)
KINDS(extern jlaw_call, _8);
KINDS(extern jlaw_call, _4);
KINDS(extern jlaw_call, _8_alone);
KINDS(extern jlaw_call, _4_alone);
#endif
KINDS(extern jlaw_call, _2);
KINDS(extern jlaw_call, _2_alone);

/* Lanes of vectors that this processor and its system have, at most: 8, 4 or 2. Read from cpuid:
 * under zig __builtin_cpu_supports always says no. */
OUT int jlaw_lanes(void)
{
#if defined(__x86_64__)
  const unsigned avx = 3u << 27 | 1u << 12; /* OSXSAVE, AVX; FMA */
  const unsigned avx2 = 1u << 5,
                 avx512 = 1u << 16 | 1u << 17 | 1u << 30 | 1u << 31; /* F DQ BW VL */
  unsigned a, b, c, d, saved;
  if (!__get_cpuid(1, &a, &b, &c, &d) || (c & avx) != avx) return 2;
  __asm__("xgetbv" : "=a"(saved), "=d"(d) : "c"(0)); /* registers that the system keeps */
  if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || !(b & avx2) || (saved & 6) != 6) return 2;
  return (b & avx512) == avx512 && (saved & 0xe6) == 0xe6 ? 8 : 4;
#else
  return 2;
#endif
}

/* Call number `what` of advance, measure, refresh and stiffness, for the joints of a batch that no other thread
 * takes: every thread that calls takes the next b->grain of them, whole blocks, until none are left */
OUT int jlaw_run(jlaw_batch *b, int what)
{
  static jlaw_call *const calls[][4] = {
      {KINDS(, _2)}, {KINDS(, _2_alone)},
#if defined(__x86_64__)
      {KINDS(, _4)}, {KINDS(, _4_alone)}, {KINDS(, _8)}, {KINDS(, _8_alone)},
#endif
  };
  jlaw_call *const call = calls[2 * (b->lanes == 8 ? 2 : b->lanes == 4) + b->alone][what];
  const long long n = b->n, grain = b->grain;
  int failed = 0;
  for (long long at; !failed && (at = __atomic_fetch_add(&b->taken, grain, __ATOMIC_RELAXED)) < n;)
    failed = call(b, (long) at, (long) (n - at < grain ? n : at + grain));
  return failed;
}

/* Hash of the sources that this library was built from */
OUT const char *jlaw_sources(void) { return JLAW_SOURCES; }
