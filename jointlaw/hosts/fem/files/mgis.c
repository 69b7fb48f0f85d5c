/* granite as two behaviours of MGIS. They implement the generic interface of MFront, without MFront:
 *
 * granite        a cohesive zone: from opening and slip (m) to traction (Pa)
 * granite_layer  a thin layer of solid elements in place of the joint: from strain to stress. The
 *                normal is z in space and y in a plane, axis 2 of the joint is x. Material
 *                properties: Thickness of the layer (m), and YoungModulus (Pa) and PoissonRatio
 *                of its elastic response in the plane of the joint. */
#include "jointlaw_fem.h"

typedef struct { /* arguments of a behaviour, as MGIS passes them since 1.2.2 */
  char *message; /* 512 bytes, or NULL */
  double dt, *K, *rdt, *speed_of_sound;
  const double *gradients0, *forces0, *density0, *properties0, *state0, *stored0, *dissipated0,
      *external0;
  const double *gradients;
  double *forces;
  const double *density, *properties;
  double *state, *stored, *dissipated;
  const double *external;
} jlf_view;

enum { PREDICTION = -1, FORCES, TANGENT }; /* requests of K[0] */

static int jlf_request(const jlf_view *v)
{
  return v->K[0] < -0.5 ? PREDICTION : v->K[0] > 0.5 ? TANGENT : FORCES;
}

static int jlf_fail(const jlf_view *v, const char *reason)
{
  if (v->message) snprintf(v->message, 512, "granite: %s", reason);
  fprintf(stderr, "granite: %s\n", reason); /* OpenGeoSys does not show the message */
  if (v->rdt) *v->rdt = 0.25; /* of the time step, for the next trial */
  return -1;
}

/* Advance the joint by du (m), or by zero for a prediction, the tangent of the present state */
static int jlf_step(const jlf_view *v, const double du[3], double *s1, double *T, double *C)
{
  static const double zero[3] = {0.0, 0.0, 0.0};
  char reason[JLAW_MESSAGE];
  const int request = jlf_request(v);
  if (v->K[0] > 50.0) return jlf_fail(v, "K[0] > 50 requests the speed of sound, which a joint does not have");
  if (jlf_advance(v->state0, s1, request == PREDICTION ? zero : du, T, request ? C : NULL, reason))
    return jlf_fail(v, reason);
  return 0;
}

/* Write the new state, and the energies (J/m2) divided by a thickness; returns 1, success */
static int jlf_write_state(const jlf_view *v, const double *s1, double thickness, double elastic)
{
  memcpy(v->state, s1, STATE * sizeof *s1);
  if (v->stored) *v->stored = jlaw_stored_energy(&JOINT, s1) / thickness + elastic;
  if (v->dissipated) *v->dissipated = jlaw_dissipated_energy(&JOINT, s1) / thickness;
  return 1;
}

static int jlf_cohesive(const jlf_view *v, int dim)
{
  double du[3] = {0.0, 0.0, 0.0}, s1[STATE], T[3], C[9];
  const int request = jlf_request(v);
  for (int i = 0; i < dim; i++) du[i] = v->gradients[i] - v->gradients0[i];
  if (jlf_step(v, du, s1, T, C)) return -1;
  for (int i = 0; request && i < dim * dim; i++) v->K[i] = C[DIM * (i / dim) + i % dim];
  if (request == PREDICTION) return 1;
  memcpy(v->forces, T, (size_t) dim * sizeof *T);
  return jlf_write_state(v, s1, 1.0, 0.0);
}

/* Strains are xx yy zz xy xz yz, in a plane the first four, with shear components times sqrt 2; slip is
 * twice the thickness times the shear strain. In the plane of the joint (components x and b) the layer
 * is elastic, in plane stress, in parallel with the joint. */
static int jlf_layer(const jlf_view *v, int dim)
{
  const double root = 1.4142135623730951, *e = v->gradients, *p = v->properties;
  const double h = p[0], E = p[1], nu = p[2], P = E / (1.0 - nu * nu), G2 = E / (1.0 + nu);
  const int space = dim == 3, size = space ? 6 : 4, b = space ? 1 : 2;
  const int at[3] = {space ? 2 : 1, space ? 4 : 3, 5}; /* opening and shears */
  const double by[3] = {h, h * root, h * root}, to[3] = {1.0, root, root};
  double du[3] = {0.0, 0.0, 0.0}, s1[STATE], T[3], C[9], *s = v->forces, *K = v->K, size_of_stress = 0.0;
  const int request = jlf_request(v);
  if (!(h > 0.0 && h <= DBL_MAX && E >= 0.0 && P <= DBL_MAX && fabs(nu) <= 0.5))
    return jlf_fail(v, "Thickness must be > 0, YoungModulus >= 0, PoissonRatio from -0.5 to 0.5");
  for (int i = 0; i < size; i++) size_of_stress += (1.0 + P) * fabs(e[i]);
  if (!(size_of_stress <= DBL_MAX))
    return jlf_fail(v, "the strain is not finite; the state is unchanged");
  for (int i = 0; i < dim; i++) du[i] = by[i] * (e[at[i]] - v->gradients0[at[i]]);
  if (jlf_step(v, du, s1, T, C)) return -1;
  for (int i = 0; request && i < size * size; i++) K[i] = 0.0;
  for (int i = 0; request && i < dim * dim; i++)
    K[size * at[i / dim] + at[i % dim]] = to[i / dim] * C[DIM * (i / dim) + i % dim] * by[i % dim];
  if (request) {
    K[0] = K[size * b + b] = P;
    K[b] = K[size * b] = P * nu;
    if (space) K[size * 3 + 3] = G2;
  }
  if (request == PREDICTION) return 1;
  for (int i = 0; i < dim; i++) s[at[i]] = to[i] * T[i];
  s[0] = P * (e[0] + nu * e[b]);
  s[b] = P * (e[b] + nu * e[0]);
  if (space) s[3] = G2 * e[3];
  return jlf_write_state(v, s1, h, 0.5 * (s[0] * e[0] + s[b] * e[b] + (space ? s[3] * e[3] : 0.0)));
}

/* Symbols that MGIS reads from the library of a behaviour */
#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif
#define NUMBER(B, name, value) EXPORT unsigned short B##_##name = value;
#define TEXT(B, name, value) EXPORT const char *B##_##name = value;
#define TYPES(B, name, ...) EXPORT int B##_##name##Types[] = {__VA_ARGS__};
#define LIST(B, name, ...) EXPORT const char *B##_##name[] = {__VA_ARGS__};
#define HYPOTHESIS(B, name, run, dim) \
  EXPORT int B##_##name(jlf_view *v); \
  int B##_##name(jlf_view *v) { return run(v, dim); }

#define BEHAVIOUR(B, kind, kinematic, gradient, force, type) \
  TEXT(B, mfront_ept, #B) TEXT(B, mfront_interface, "Generic") TEXT(B, tfel_version, "4.2.0") \
  TEXT(B, src, "mgis.c") TEXT(B, author, "jointlaw") TEXT(B, date, "") TEXT(B, build_id, "") \
  TEXT(B, validator, "") TEXT(B, unit_system, "SI") \
  NUMBER(B, mfront_mkt, 1) NUMBER(B, api_version, 1) \
  NUMBER(B, BehaviourType, kind) NUMBER(B, BehaviourKinematic, kinematic) \
  NUMBER(B, SymmetryType, 0) NUMBER(B, ElasticSymmetryType, 0) \
  NUMBER(B, requiresStiffnessTensor, 0) \
  NUMBER(B, requiresThermalExpansionCoefficientTensor, 0) \
  NUMBER(B, ComputesInternalEnergy, 1) NUMBER(B, ComputesDissipatedEnergy, 1) \
  NUMBER(B, TemperatureRemovedFromExternalStateVariables, 1) \
  NUMBER(B, nGradients, 1) LIST(B, Gradients, gradient) TYPES(B, Gradients, type) \
  NUMBER(B, nThermodynamicForces, 1) LIST(B, ThermodynamicForces, force) \
  TYPES(B, ThermodynamicForces, type) \
  NUMBER(B, nTangentOperatorBlocks, 2) LIST(B, TangentOperatorBlocks, force, gradient) \
  NUMBER(B, nInternalStateVariables, STATE) LIST(B, InternalStateVariables, NAMES) \
  EXPORT int B##_InternalStateVariablesTypes[STATE] = {0}; \
  NUMBER(B, nExternalStateVariables, 0) LIST(B, ExternalStateVariables, NULL) \
  TYPES(B, ExternalStateVariables, 0) \
  NUMBER(B, nParameters, 0) LIST(B, Parameters, NULL) TYPES(B, Parameters, 0) \
  NUMBER(B, nInitializeFunctions, 0) NUMBER(B, nPostProcessings, 0)

BEHAVIOUR(granite, 3, 2, "OpeningDisplacement", "CohesiveForce", 2)
NUMBER(granite, nMaterialProperties, 0)
HYPOTHESIS(granite, PlaneStrain, jlf_cohesive, 2)
HYPOTHESIS(granite, PlaneStress, jlf_cohesive, 2)
HYPOTHESIS(granite, GeneralisedPlaneStrain, jlf_cohesive, 2)
HYPOTHESIS(granite, Axisymmetrical, jlf_cohesive, 2)

BEHAVIOUR(granite_layer, 1, 1, "Strain", "Stress", 1)
NUMBER(granite_layer, nMaterialProperties, 3)
LIST(granite_layer, MaterialProperties, "Thickness", "YoungModulus", "PoissonRatio")
HYPOTHESIS(granite_layer, PlaneStrain, jlf_layer, 2)
HYPOTHESIS(granite_layer, GeneralisedPlaneStrain, jlf_layer, 2)
HYPOTHESIS(granite_layer, Axisymmetrical, jlf_layer, 2)

#if DIM == 3 /* not for a law with a plane */
HYPOTHESIS(granite, Tridimensional, jlf_cohesive, 3)
HYPOTHESIS(granite_layer, Tridimensional, jlf_layer, 3)
#endif
