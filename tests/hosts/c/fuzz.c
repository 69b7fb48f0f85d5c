/* Hostile steps and hostile table files, for builds with sanitizers.
 *
 *     fuzz steps FILE.jlaw SIZE COUNT SEED     random steps of all kinds and sizes, SIZE in m
 *     fuzz files FILE.jlaw SCRATCH COUNT SEED  COUNT damaged copies: a message, or the right law
 *     fuzz threads FILE.jlaw                   two threads on one law
 */
#define _GNU_SOURCE
#define JOINTLAW_IMPLEMENTATION
#include "jointlaw.h"
#include <pthread.h>

static unsigned long long seed_;
static char message[JLAW_MESSAGE];

static unsigned long long bits(void) /* xorshift64* */
{
  seed_ ^= seed_ >> 12, seed_ ^= seed_ << 25, seed_ ^= seed_ >> 27;
  return seed_ * 2685821657736338717ULL;
}
static double uniform(double low, double high)
{
  return low + (high - low) * (double) (bits() >> 11) / 9007199254740992.0;
}
static int pick(int n) { return (int) (bits() >> 33) % n; }

static int wrong(const char *what, long at)
{
  printf("%s at %ld; last message: %s\n", what, at, message);
  return 1;
}
static int finite_all(const double *x, int n)
{
  int all = 1;
  for (int i = 0; i < n; i++) all = all && fabs(x[i]) <= DBL_MAX;
  return all;
}

/* An increment as in the suite of extremes: of all kinds and sizes */
static void increment(double *d, int dim, const double *s, double size)
{
  static const double bad[] = {NAN, INFINITY, -INFINITY, 1e308, -1e308, DBL_MAX, 1e160};
  const int kind = pick(40);
  const double scale = size * pow(10.0, uniform(-4.0, 0.5));
  for (int i = 0; i < dim; i++) {
    d[i] = uniform(-2.0, 2.0) * scale;
    if (kind < 5) d[i] = i ? 0.0 : d[i];           /* pure closure */
    else if (kind < 10) d[i] = i ? d[i] : 0.0;     /* pure shear */
    else if (kind < 15) d[i] *= 1e-290 / size;
    else if (kind < 20) d[i] *= 1e-10;
    else if (kind < 22) d[i] = 0.0;
    else if (kind < 24) d[i] *= 1e4;
    else if (kind < 27) d[i] = i ? 0.0 : -s[0];    /* the very point of contact */
  }
  if (kind == 27) d[pick(dim)] = bad[pick(7)];
}

static int steps(const jlaw_law *law, double size, long count)
{
  const int dim = jlaw_dim(law), rows = jlaw_state_size(law);
  double *s = (double *) calloc(3 * (size_t) rows, sizeof *s), *next = s + rows, *kept = next + rows;
  const size_t bytes = (size_t) rows * sizeof *s;
  double d[3], F[3], C[9], shares[3];
  long refused = 0;
  for (long k = 0; k < count; k++) {
    if (k % 64 == 0) { /* a new joint, closed a little */
      memset(s, 0, bytes);
      for (int i = 0; i < dim; i++) d[i] = i ? 0.0 : size;
      const int no = jlaw_update(law, s, s, d, F, NULL, message, sizeof message);
#ifndef JOINTLAW_FLOAT_SLIDERS /* forces of extreme laws may not fit into a float: s stays virgin */
      if (no) return wrong("refused", k);
#else
      (void) no;
#endif
    }
    increment(d, dim, s, size);
    memcpy(next, s, bytes), memcpy(kept, s, bytes);
    const int damage = pick(400) == 0;
    if (damage) s[pick(rows)] = pick(2) ? NAN : -INFINITY;
    double *to = pick(2) ? s : next;
    F[0] = 4711.0;
    const int no = jlaw_update(law, s, to, d, F, pick(2) ? C : NULL, message, sizeof message);
    if (damage && !no) return wrong("a damaged state passed", k);
    if (no) {
      refused++;
      if (F[0] != 4711.0 || memcmp(next, kept, bytes)) return wrong("a refused step wrote", k);
      if (!damage && memcmp(s, kept, bytes)) return wrong("a refused step moved the joint", k);
      if (strlen(message) < 20) return wrong("a refused step has no message", k);
      memcpy(s, kept, bytes);
      continue;
    }
    if (to != s) memcpy(s, next, bytes);
    double same[3];
    jlaw_traction(law, s, same);
    for (int i = 0; i < dim; i++)
      if (same[i] != F[i]) return wrong("the traction of a state differs from its step", k);
    if (!finite_all(s, rows) || !finite_all(F, dim)) return wrong("not finite", k);
    if (jlaw_dissipated_energy(law, s) < jlaw_dissipated_energy(law, kept)) return wrong("friction made energy", k);
    if (!(jlaw_stored_energy(law, s) >= 0.0) || jlaw_stored_energy(law, s) > DBL_MAX) return wrong("stored", k);
    jlaw_contact_fractions(law, s, shares);
    for (int i = 0; i < 3; i++)
      if (!(shares[i] >= 0.0 && shares[i] <= 1.0 + 1e-12)) return wrong("shares", k);
    if (pick(50) == 0) jlaw_swap_bodies(law, s);
    if (pick(50) == 0) jlaw_rotate(law, s, uniform(-4.0, 4.0));
    if (!finite_all(s, rows)) return wrong("turned state is not finite", k);
  }
  printf("%ld steps, %ld refused\n", count, refused);
  free(s);
  return 0;
}

static double one_step(const jlaw_law *law, double closure)
{
  double d[3] = {closure, 0.3 * closure, -0.2 * closure}, F[3] = {0.0, 0.0, 0.0};
  double *s = (double *) calloc((size_t) jlaw_state_size(law), sizeof *s);
  jlaw_update(law, s, s, d, F, NULL, message, sizeof message);
  free(s);
  return F[0];
}

static void put(const char *file, const char *bytes, size_t n)
{
  FILE *f = fopen(file, "wb");
  fwrite(bytes, 1, n, f);
  fclose(f);
}

/* Writes the right sum under damaged text: what a hostile author would do */
static size_t sign(char *copy, size_t n)
{
  while (n > 0 && strncmp(copy + n, "\nsum ", 5)) n--;
  const unsigned long long sum = jlaw_checksum_(copy, copy + n + 1);
  return n + 1 + (size_t) sprintf(copy + n + 1, "sum %016llx\n", sum);
}

static int files(const char *file, const char *scratch, long count)
{
  size_t length;
  char *right = jlaw_read_bytes_(file, &length), *copy = (char *) malloc(length + 100);
  jlaw_law *law = jlaw_read(file, message, sizeof message), *other;
  const double closure = 1e-3 * fmin(law->max_effective_closure, 1e-3), F = one_step(law, closure);
  long passed = 0, signed_passed = 0;
  for (long k = 0; k < count; k++) {
    size_t n = length, at = (size_t) bits() % length;
    const size_t head = length < 4000 ? length : 4000;
    memcpy(copy, right, length);
    copy[n] = 0;
    if (pick(2)) at = (size_t) bits() % head; /* where the keywords are */
    switch (pick(5)) {
      case 0: copy[at] = (char) (copy[at] ^ (1 << pick(8))); break; /* a flipped bit */
      case 1: copy[at] = (char) pick(256); break;
      case 2: n = at; break; /* cut */
      case 3: memmove(copy + at, copy + at + 1, n - at - 1), n--; break;
      default: memmove(copy + at + 1, copy + at, n - at), n++, copy[at] = (char) ('0' + pick(10));
    }
    const int hostile = pick(3) == 0;
    copy[n] = 0;
    if (hostile) n = sign(copy, n);
    put(scratch, copy, n);
    message[0] = 0;
    other = jlaw_read(scratch, message, sizeof message);
    if (!other && strlen(message) < 10) return wrong("no message", k);
    if (other && !hostile) {
      passed++;
      if (one_step(other, closure) != F || strcmp(jlaw_fingerprint(other), jlaw_fingerprint(law)))
        return wrong("a damaged file passed as another law", k);
    }
    if (other && hostile) { /* anything but a crash */
      signed_passed++;
      one_step(other, closure);
      jlaw_closure(other, 1e6);
    }
    jlaw_free(other);
  }
  printf("%ld files, %ld still right, %ld with a forged sum\n", count, passed, signed_passed);
  jlaw_free(law);
  free(copy);
  free(right);
  return 0;
}

static void *work(void *law)
{
  double d[3] = {1e-8, 1e-8, 0.0}, F[3], C[9], shares[3];
  char text[JLAW_MESSAGE];
  double *s = (double *) calloc((size_t) jlaw_state_size((jlaw_law *) law), sizeof *s);
  for (int k = 0; k < 20000; k++) {
    d[0] = k % 3 ? 1e-8 : -2e-8, d[1] = k % 100 < 50 ? 1e-8 : -1e-8;
    if (k % 7 == 0) d[0] = NAN;
    jlaw_update((jlaw_law *) law, s, s, d, F, k % 2 ? C : NULL, text, sizeof text);
    if (k % 50 == 0) jlaw_contact_fractions((jlaw_law *) law, s, shares);
  }
  return s;
}

static int threads(jlaw_law *law)
{
  pthread_t one, two;
  void *a, *b;
  pthread_create(&one, NULL, work, law);
  pthread_create(&two, NULL, work, law);
  pthread_join(one, &a);
  pthread_join(two, &b);
  const int same = !memcmp(a, b, (size_t) jlaw_state_size(law) * sizeof(double));
  free(a);
  free(b);
  puts(same ? "two threads, one law, the same states" : "two threads differ");
  return !same;
}

int main(int count, char **words)
{
  setvbuf(stdout, NULL, _IONBF, 0);
  if (count < 3) return 2;
  if (count > 5) seed_ = (strtoull(words[5], NULL, 10) + 1) * 0x9E3779B97F4A7C15ULL;
  if (!strcmp(words[1], "files")) return files(words[2], words[3], atol(words[4]));
  jlaw_law *law = jlaw_read(words[2], message, sizeof message);
  if (!law) return wrong("not read", 0);
  const int code = !strcmp(words[1], "threads") ? threads(law) : steps(law, atof(words[3]), atol(words[4]));
  jlaw_free(law);
  return code;
}
