/* library.c: which of the compiled texts this processor runs */
#include "batch.h"

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

#define KINDS(X, KIND) X jlaw_advance##KIND, jlaw_measure##KIND, jlaw_refresh##KIND
#if defined(__x86_64__)
KINDS(extern jlaw_call, _8);
KINDS(extern jlaw_call, _4);
KINDS(extern jlaw_call, _8_alone);
KINDS(extern jlaw_call, _4_alone);
#endif
KINDS(extern jlaw_call, _2);
KINDS(extern jlaw_call, _2_alone);

/* Lanes of vectors that this processor has, at most: 8, 4 or 2 */
OUT int jlaw_lanes(void)
{
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")
      && __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl"))
    return 8;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return 4;
#endif
  return 2;
}

/* Call number `what` of advance, measure and refresh, for joints first to last - 1 of a batch whose
 * states lie in blocks, or alone, by vectors of so many lanes */
OUT int jlaw_run(const jlaw_batch *b, long long first, long long last, int what, int alone,
                 int lanes)
{
  static jlaw_call *const calls[][3] = {
      {KINDS(, _2)}, {KINDS(, _2_alone)},
#if defined(__x86_64__)
      {KINDS(, _4)}, {KINDS(, _4_alone)}, {KINDS(, _8)}, {KINDS(, _8_alone)},
#endif
  };
  const int level = lanes == 8 ? 2 : lanes == 4;
  return calls[2 * level + alone][what](b, (long) first, (long) last);
}

/* Hash of the sources that this library was built from */
OUT const char *jlaw_sources(void) { return JLAW_SOURCES; }
