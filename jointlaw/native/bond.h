/* bond.h: the bond beside the asperities of one joint; symbols of kernels/bond.py */

typedef struct { /* displacement, damage; what the bond adds to traction, tangent and loss */
  double delta[3], damage, F[3], C[9], lost;
} jl_bonded;

/* 1 where opening and slip, squared, are the strength at this damage; p2: 1/half-axis, squared */
JL_IN double jl_beyond(const jlaw_law *law, double opening2, double slip2, double damage,
                       double p2[2])
{
  const double p = law->opening_begin - damage * (law->opening_begin - law->opening_end);
  const double q = law->slip_begin - damage * (law->slip_begin - law->slip_end);
  p2[0] = p * p, p2[1] = q * q;
  return opening2 * p2[0] + slip2 * p2[1];
}

/* Damage that opening and slip ask for: the smaller root of the quadratic; half the slope there */
JL_IN double jl_damage_at(const jlaw_law *law, double opening2, double slip2, double *slope)
{
  const double begin0 = law->opening_begin, soft0 = begin0 - law->opening_end;
  const double begin1 = law->slip_begin, soft1 = begin1 - law->slip_end;
  const double turn = begin1 * law->opening_end - begin0 * law->slip_end;
  const double inside =
      opening2 * (soft0 * soft0) + slip2 * (soft1 * soft1) - opening2 * slip2 * (turn * turn);
  double p2[2];
  const double over = jl_beyond(law, opening2, slip2, 0.0, p2) - 1.0;
  *slope = sqrt(inside > 0.0 ? inside : 0.0);
  if (!(over > 0.0)) return 0.0;
  if (!(jl_beyond(law, opening2, slip2, 1.0, p2) < 1.0)) return 1.0;
  const double found = over / (opening2 * (begin0 * soft0) + slip2 * (begin1 * soft1) + *slope);
  return found < 1.0 ? found : 1.0;
}

/* A bond that has moved to b->delta, with its damage before; returns its stored energy */
JL_IN double jl_hold(const jlaw_law *law, jl_bonded *b)
{
  const double K[2] = {law->bond_normal, law->bond_shear}, old = b->damage;
  const double u[3] = {b->delta[0] < 0.0 ? b->delta[0] : 0.0, b->delta[1], b->delta[2]};
  const double opening2 = u[0] * u[0], slip2 = u[1] * u[1] + u[2] * u[2];
  const double jl_psi = 0.5 * (K[0] * opening2 + K[1] * slip2);
  double p2[2], slope;
  const double found = jl_damage_at(law, opening2, slip2, &slope);
  const double now = b->damage = found > old ? found : old;
  const int softens = found > old && now < 1.0;
  const double first = jl_beyond(law, opening2, slip2, old, p2);
  const double there = jl_beyond(law, opening2, slip2, now, p2), last = softens ? 1.0 : there;
  b->lost = found > old ? (now - old) * jl_psi / sqrt(first * last) : 0.0;
  for (int i = 0; i < 3; i++) {
    b->F[i] = (1.0 - now) * K[i > 0] * u[i];
    for (int j = 0; j < 3; j++)
      b->C[3 * i + j] = softens ? -(K[i > 0] * u[i]) * (u[j] * p2[j > 0] / slope) : 0.0;
    if (i || u[0] < 0.0) b->C[4 * i] += (1.0 - now) * K[i > 0];
  }
  return (1.0 - now) * jl_psi;
}

/* The bond in a state after a step: adds what it bears, where F is given; returns its stored energy.
 * Its damage is in this row of the state. */
JL_IN jl_of_joint jl_step_bond(const jlaw_law *law, jl_numbers n, int row, jl_of_joint F[3],
                               jl_of_joint C[9], int tangent, int ledger)
{
  const int dim = law->dim;
  jl_of_joint stored = jl_each_joint(0.0);
  for (int l = 0; l < JL_JOINTS; l++) {
    double *s = n.s + l;
    jl_bonded b = {{0.0}, s[(size_t) row * n.stride], {0.0}, {0.0}, 0.0};
    for (int i = 0; i < dim; i++) b.delta[i] = s[(size_t) i * n.stride];
    JL_JOINT(stored, l) = jl_hold(law, &b);
    if (!F) continue;
    s[(size_t) row * n.stride] = b.damage;
    if (ledger) s[(size_t) dim * n.stride] += b.lost;
    for (int i = 0; i < dim; i++) JL_JOINT(F[i], l) += b.F[i];
    for (int i = 0; tangent && i < dim * dim; i++) JL_JOINT(C[i], l) += b.C[i / dim * 3 + i % dim];
  }
  return stored;
}
