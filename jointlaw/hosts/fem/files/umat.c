/* granite as a UMAT for interface and cohesive elements. DSTRAN is the increment of opening and slip
 * (m), opening and tension positive. NTENS 2 or 3: normal, then one or two shear components. NTENS 6
 * (interface elements of Kratos: xx yy zz xy yz xz): component 3 is the normal, 6 the shear along axis
 * 2, 5 the shear along axis 3; a host that counts xz before yz, such as Abaqus, exchanges these axes.
 * PROPS(1), if it is above 0, is the fraction of the displacement jump that the element passes: 0.5 in
 * Kratos, whose elements also take half of the stress. STATEV holds STATE numbers (jointlaw_fem.h),
 * zeros at the start. An invalid step requests a shorter one (PNEWDT) and returns NaN, which stops a
 * host that does not read PNEWDT. */
#include "jointlaw_fem.h"
#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
__attribute__((visibility("default")))
#endif
void umat_(double *stress, double *statev, double *ddsdde, double *sse, double *spd, double *scd,
           double *rpl, double *ddsddt, double *drplde, double *drpldt, const double *stran,
           const double *dstran, const double *time, const double *dtime, const double *temp,
           const double *dtemp, const double *predef, const double *dpred, const char *cmname,
           const int *ndi, const int *nshr, const int *ntens, const int *nstatv,
           const double *props, const int *nprops, const double *coords, const double *drot,
           double *pnewdt)
{
  char message[JLAW_MESSAGE] = "";
  const int n = *ntens, wide = n == 6, dim = wide ? DIM : n;
  const int at[3] = {wide ? 2 : 0, wide ? 5 : 1, wide ? 4 : 2};
  const double fraction = *nprops > 0 && props[0] > 0.0 ? props[0] : 1.0;
  double s1[STATE], T[3], C[9], du[3] = {0.0, 0.0, 0.0};
  if (dim < 2 || dim > DIM)
    snprintf(message, sizeof message, "NTENS = %d, but this joint needs 2 to %d, or 6", n, DIM);
  else if (*nstatv != STATE)
    snprintf(message, sizeof message, "NSTATV = %d, but must be %d", *nstatv, STATE);
  for (int i = 0; !message[0] && i < dim; i++) du[i] = dstran[at[i]] / fraction;
  if (message[0] || jlf_advance(statev, s1, du, T, C, message)) {
    fprintf(stderr, "granite: %s\n", message);
    if (pnewdt) *pnewdt = 0.25;
    for (int i = 0; i < n; i++) stress[i] = NAN;
    return;
  }
  memcpy(statev, s1, sizeof s1);
  for (int i = 0; i < n * n; i++) ddsdde[i] = 0.0;
  for (int i = 0; i < dim; i++) stress[at[i]] = T[i] / fraction;
  for (int i = 0; i < dim * dim; i++) /* column-major order */
    ddsdde[at[i / dim] + n * at[i % dim]] = C[DIM * (i / dim) + i % dim] / (fraction * fraction);
  *sse = jlaw_stored_energy(&JOINT, s1);
  *spd = jlaw_dissipated_energy(&JOINT, s1);
}
