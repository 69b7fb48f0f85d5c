/* processor.c: vector width of this processor. Compiled for the oldest processor of its kind. */
#include "export.h"
#if defined(__x86_64__)
#include <cpuid.h>
#endif

/* Doubles in the widest vector of this processor and operating system: 8, 4 or 2, for x86-64-v4, -v3
 * and all others. Read from cpuid, because __builtin_cpu_supports always returns 0 under zig. */
OUT int jlaw_lanes(void)
{
#if defined(__x86_64__)
  const unsigned avx = 1u << 12 | 1u << 22 | 3u << 27 | 1u << 29; /* FMA MOVBE OSXSAVE AVX F16C */
  const unsigned lzcnt = 1u << 5, avx2 = 1u << 3 | 1u << 5 | 1u << 8;           /* BMI1 AVX2 BMI2 */
  const unsigned avx512 = 1u << 16 | 1u << 17 | 1u << 28 | 1u << 30 | 1u << 31; /* F DQ CD BW VL */
  unsigned a, b, c, d, saved;
  if (!__get_cpuid(0x80000001, &a, &b, &c, &d) || !(c & lzcnt)) return 2;
  if (!__get_cpuid(1, &a, &b, &c, &d) || (c & avx) != avx) return 2;
  __asm__("xgetbv" : "=a"(saved), "=d"(d) : "c"(0)); /* registers that the system saves */
  if (!__get_cpuid_count(7, 0, &a, &b, &c, &d) || (b & avx2) != avx2 || (saved & 6) != 6) return 2;
  return (b & avx512) == avx512 && (saved & 0xe6) == 0xe6 ? 8 : 4;
#else
  return 2;
#endif
}
