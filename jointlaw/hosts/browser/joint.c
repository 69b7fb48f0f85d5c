/* joint.c: the law as WebAssembly, for the page "A joint in your browser". It is compiled from
 * jointlaw.h with one lane, so results are bitwise identical. `python builder/wasm.py` rebuilds
 * joint.wasm; run it after a change of this file or of the files of the law. */
#define JOINTLAW_IMPLEMENTATION
#define JOINTLAW_SCALAR
#define JOINTLAW_NO_FILES
#include "jointlaw.h"

#define EXPORT(name) __attribute__((export_name(#name)))

extern unsigned char __heap_base;
static jlaw_law law;

/* Address to which the page copies the bytes of export.py: numbers of the law, then its tables */
EXPORT(bytes) unsigned char *bytes(void) { return &__heap_base + (16 - (size_t) &__heap_base % 16); }

/* Load the law from these bytes. Returns the first free address after them. */
EXPORT(load_law) const double *load_law(void)
{
  const size_t head = offsetof(jlaw_law, facet);
  memcpy(&law, bytes(), head);
  const size_t blocks = (size_t) (law.facets + JLAW_FACET_LANES - 1) / JLAW_FACET_LANES;
  law.facet = (const double *) (bytes() + head);
  law.depth = law.facet + blocks * JLAW_COLUMNS * JLAW_FACET_LANES;
  law.curve = law.depth + blocks * (size_t) law.cells * JLAW_ROWS * JLAW_FACET_LANES;
  law.energy = law.curve + 4 * law.pieces;
  return law.energy + 4 * law.pieces;
}

EXPORT(state_size) int state_size(void) { return jlaw_state_size(&law); }
EXPORT(facet_count) int facet_count(void) { return law.facets; }
EXPORT(cell_count) int cell_count(void) { return law.cells; }
EXPORT(stored) double stored(const double *s) { return jlaw_stored_energy(&law, s); }
EXPORT(dissipated) double dissipated(const double *s) { return jlaw_dissipated_energy(&law, s); }
EXPORT(closure_at) double closure_at(double stress) { return jlaw_closure(&law, stress); }

/* jlaw_update from s0 to s1 in space: F (3) and C (3, 3); returns 0, or -1 and a message. Elements of
 * elements.h would increase the file size. */
EXPORT(update) int update(const double *s0, double *s1, const double *d, double *F, char *message)
{
  const jl_states n = {s1, 1, 0};
  int state_is_invalid;
  if (!jlaw_step_is_valid_(&law, s0, d, &state_is_invalid))
    return jlaw_report_invalid_(&law, s0, d, state_is_invalid, message, JLAW_MESSAGE);
  memcpy(s1, s0, (size_t) jl_state_rows(&law) * sizeof *s1);
  if (law.interlock_decays) jl_step_general_decaying_C(&law, n, d, F, F + 3, 1, 0, NULL);
  else jl_step_general_C(&law, n, d, F, F + 3, 1, 0, NULL);
  return 0;
}

/* State of each facet for the pictures: normal (3), load A Phi (Pa), sliding fraction of its friction
 * capacity, and for each cell the gap (m) at its start and its shear force over its friction limit */
EXPORT(evaluate_facets) void evaluate_facets(double *s, double *out)
{
  const jl_states n = {s, 1, 0};
  const int M = law.facets, D = law.cells;
  for (int at = 0; at < M; at++) {
    const double *f = jl_facet_table(&law, at), *cell = jl_cell_table(&law, at);
    double limited_G = 0.0, *row = out + at * (5 + 2 * D);
    jl_facet_step o;
    jl_evaluate_facets(&law, n, at, &o);
    const double force = o.y1 > o.z1 ? jl_max(o.f1 - o.fz1, 0.0) : 0.0;
    for (int i = 0; i < 3; i++) row[i] = jl_column(f, JLAW_N + i);
    for (int i = 0; i < D; i++, cell += JLAW_ROWS * JLAW_FACET_LANES) {
      double G, kappa;
      const int slider = jl_slider_row(&law) + at * D + i;
      jl_evaluate_cell(cell, o.y1, o.f1, o.k1, o.z1, o.fz1, o.kz1, law.yields, &G, &kappa);
      const double q = jl_sqrt(s[slider] * s[slider] + s[slider + M * D] * s[slider + M * D]);
      const double limit =
          o.strength * (G * (1.0 - JLAW_FRICTION_TOLERANCE) - JLAW_ROUNDING_TOLERANCE * o.f1);
      if (G > 0.0 && q >= limit) limited_G += G;
      row[5 + 2 * i] = jl_column(f, JLAW_COS_THETA) * (jl_column(cell, JLAW_ZETA_START) - o.y1);
      row[6 + 2 * i] = G > 0.0 ? (q >= limit ? 1.0 : q / (o.strength * G)) : 0.0;
    }
    row[3] = jl_column(f, JLAW_A) * force;
    row[4] = force > 0.0 ? jl_min(limited_G / force, 1.0) : 0.0;
  }
}
