/* A library of a wheel, called from C: `library LAW.jlaw LIBRARY JOINTS < increments > F and C`.
 *
 * Increments (steps, joints, dim); for each step F (joints, dim) and C (joints, dim, dim); all are
 * doubles. The first joint is also advanced by the header, which must give the same.
 */
#define JOINTLAW_IMPLEMENTATION
#include "jointlaw.h"
#include "batch.h"
#include <dlfcn.h>
#include <string.h>

typedef int run(jlaw_batch *b, int what);

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
  jlaw_batch b = {0};
  b.law = law, b.state = state, b.d = d, b.F = F, b.C = C;
  b.n = (long long) n, b.chunk = JLAW_JOINTS_PER_BLOCK, b.rows = (int) rows, b.lanes = 2;
  b.track_dissipation = b.commit = 1;
  while (fread(d, sizeof *d, size, stdin) == size) {
    double f[3], c[9];
    b.next = 0;
    if (advance(&b, 0)) return 3;
    if (jlaw_update(law, first, first, d, f, c, message, sizeof message)) return 4;
    if (memcmp(f, F, dim * sizeof *f) || memcmp(c, C, dim * dim * sizeof *c)) return 5;
    fwrite(F, sizeof *F, size, stdout);
    fwrite(C, sizeof *C, size * dim, stdout);
  }
  return 0;
}
