/* A library of a wheel, called from C: `library LAW.jlaw LIBRARY JOINTS < increments > F and C`.
 *
 * Increments (steps, joints, dim); for each step F (joints, dim) and C (joints, dim, dim); all are
 * doubles. The first joint is also advanced by the header, which must give the same.
 */
#define JOINTLAW_IMPLEMENTATION
#include "jointlaw.h"
#include <dlfcn.h>
#include <string.h>

typedef struct { /* as in batch.h */
  const jlaw_law *law;
  double *state;
  const double *d;
  double *F, *C;
  const long long *index;
  long long n, taken, grain;
  int rows, alone, lanes, ledger, keep;
} batch;
typedef int run(batch *b, int what);

int main(int argc, char **argv)
{
  char message[JLAW_MESSAGE];
  jlaw_law *law = argc == 4 ? jlaw_read(argv[1], message, sizeof message) : NULL;
  if (!law) return 1;
  void *library = dlopen(argv[2], RTLD_NOW);
  if (!library) return fputs(dlerror(), stderr), 2;
  run *const advance = (run *) dlsym(library, "jlaw_run");
  const size_t n = (size_t) atoi(argv[3]), dim = (size_t) jlaw_dim(law);
  const size_t rows = (size_t) jlaw_state_size(law), size = n * dim;
  double *state = calloc((n + 7) / 8 * 8 * rows, sizeof *state), *first = calloc(rows, sizeof *first);
  double *d = calloc(size, sizeof *d), *F = calloc(size, sizeof *F), *C = calloc(size * dim, sizeof *C);
  batch b = {law, state, d, F, C, NULL, (long long) n, 0, 8, (int) rows, 0, 2, 1, 1};
  while (fread(d, sizeof *d, size, stdin) == size) {
    double f[3], c[9];
    b.taken = 0;
    if (advance(&b, 0)) return 3;
    if (jlaw_update(law, first, first, d, f, c, message, sizeof message)) return 4;
    if (memcmp(f, F, dim * sizeof *f) || memcmp(c, C, dim * dim * sizeof *c)) return 5;
    fwrite(F, sizeof *F, size, stdout);
    fwrite(C, sizeof *C, size * dim, stdout);
  }
  return 0;
}
