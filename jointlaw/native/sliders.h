/* sliders.h: how the forces of the sliders are stored in a state: as double or as float.
 *
 * q_s and q_t of a cell are two doubles of a state, or, with JLAW_FLOAT_SLIDERS, two floats in the
 * place of one double: q_s in its low and q_t in its high 32 bits. All arithmetic is in double.
 *
 * A step adds to q an increment that may be far below the resolution of a float. Rounding to the
 * nearest float would lose such increments, and a joint that is sheared slowly would never be loaded.
 * Forces are therefore rounded at random (stochastic rounding): up with a probability equal to the
 * fraction of the interval between two floats, so that the expected value is exact. The random
 * number is a hash of the displacement after the step, of the number of the cell and of the force
 * before the step. Thus
 *
 *   - results are reproducible, and the same for one joint, many joints, threads and vectors;
 *   - a repeated cycle has other roundings in each repetition, because q differs by roundings;
 *   - a force that is a float stays as it is: a zero increment is neutral. To this end a slider slips
 *     only beyond the friction limit and the largest rounding, JLAW_FLOAT_LIMIT_TOLERANCE.
 *
 * The error of q is the sum of independent roundings. A step that adds a part p of the interval h
 * between two floats has the variance p (1 - p) h^2: after n steps the error is at most sqrt(n) h/2,
 * and, however many steps it takes, at most the square root of h times the path of q.
 * kernels/float_sliders.py has the same functions in numpy. */
#ifdef JLAW_FLOAT_SLIDERS
#define JL_NUMBERS_PER_SLIDER 1
#define JL_FRICTION_TOLERANCE JLAW_FLOAT_FRICTION_TOLERANCE
#define JL_LIMIT_FACTOR (1.0 + JLAW_FLOAT_LIMIT_TOLERANCE)

#if JL_W == 1
typedef unsigned long long jl_bits;
typedef unsigned int jl_half_bits;
typedef float jl_float;
JL_INLINE jl_bits jl_to_bits(double x)
{
  union {
    double x;
    jl_bits bits;
  } both;
  both.x = x;
  return both.bits;
}
JL_INLINE double jl_from_bits(jl_bits bits)
{
  union {
    double x;
    jl_bits bits;
  } both;
  both.bits = bits;
  return both.x;
}
JL_INLINE jl_bits jl_float_to_bits(double x) /* a double that is a float */
{
  union {
    float x;
    jl_half_bits bits;
  } both;
  both.x = (float) x;
  return both.bits;
}
JL_INLINE double jl_float_from_bits(jl_bits bits) /* the low half */
{
  union {
    float x;
    jl_half_bits bits;
  } both;
  both.bits = (jl_half_bits) bits;
  return both.x;
}
#else
typedef unsigned long long jl_bits __attribute__((vector_size(8 * JL_W)));
typedef unsigned int jl_half_bits __attribute__((vector_size(4 * JL_W)));
typedef float jl_float __attribute__((vector_size(4 * JL_W)));
#define jl_to_bits(x) ((jl_bits) (x))
#define jl_from_bits(bits) ((jl_real) (bits))
JL_INLINE jl_bits jl_float_to_bits(jl_real x)
{
  return __builtin_convertvector((jl_half_bits) __builtin_convertvector(x, jl_float), jl_bits);
}
JL_INLINE jl_real jl_float_from_bits(jl_bits bits)
{
  return __builtin_convertvector((jl_float) __builtin_convertvector(bits, jl_half_bits), jl_real);
}
#endif
#ifdef JLAW_FACET_VECTORS
typedef unsigned long long jl_joint_bits;
JL_INLINE jl_joint_bits jl_joint_to_bits(double x)
{
  union {
    double x;
    jl_joint_bits bits;
  } both;
  both.x = x;
  return both.bits;
}
#else
typedef jl_bits jl_joint_bits;
#define jl_joint_to_bits(x) jl_to_bits(x)
#endif

#define JL_MIX_1 0x9E3779B97F4A7C15ULL /* odd, with well distributed bits */
#define JL_MIX_2 0xBF58476D1CE4E5B9ULL
#define JL_MIX_3 0x94D049BB133111EBULL
#define JL_DROPPED_BITS 29 /* of the 52 bits of a double that a float does not have */
#define JL_DROPPED_MASK ((1ULL << JL_DROPPED_BITS) - 1)

/* Hash of the displacement `to` (dim) after a step */
JL_INLINE jl_joint_bits jl_rounding_key(const jl_joint_real to[3], int dim)
{
  jl_joint_bits key = jl_joint_to_bits(jl_broadcast_joint(0.0)); /* zeros */
  for (int i = 0; i < dim; i++) {
    key = (key ^ jl_joint_to_bits(to[i])) * JL_MIX_1;
    key = key ^ (key >> 31);
  }
  key = key * JL_MIX_2;
  return key ^ (key >> 32);
}

/* Random bits for the slider of a cell with the forces (qs, qt) before the step. index: of the cell,
 * `spacing` from lane to lane if the lanes are facets */
JL_INLINE jl_bits jl_rounding_noise(jl_joint_bits key, int index, int spacing, jl_real qs, jl_real qt)
{
  jl_bits cell = jl_to_bits(jl_broadcast(0.0));
#ifdef JLAW_FACET_VECTORS
  for (int l = 0; l < JL_W; l++)
    cell[l] = key + (unsigned long long) (index + l * spacing) * JL_MIX_2;
#else
  (void) spacing;
  cell = key + (unsigned long long) index * JL_MIX_2;
#endif
  cell = cell ^ (jl_to_bits(qs) >> JL_DROPPED_BITS) ^ jl_to_bits(qt);
  cell = (cell ^ (cell >> 32)) * JL_MIX_3;
  return cell ^ (cell >> JL_DROPPED_BITS);
}

/* Round to a float, away from zero with the probability of the dropped bits; noise: random bits, of
 * which the lowest 29 are read. Numbers below the smallest normal float become zero. */
JL_INLINE jl_real jl_round_to_float(jl_real x, jl_bits noise)
{
  const jl_bits bits = (jl_to_bits(x) + (noise & JL_DROPPED_MASK)) & ~JL_DROPPED_MASK;
  const jl_real rounded = jl_from_bits(bits);
  return jl_select_or_zero(jl_abs(rounded) >= JLAW_MIN_FLOAT, rounded);
}

/* Round the forces of sliders to floats */
JL_INLINE void jl_round_sliders(jl_bits noise, jl_real *qs, jl_real *qt)
{
  *qs = jl_round_to_float(*qs, noise);
  *qt = jl_round_to_float(*qt, noise >> (64 - JL_DROPPED_BITS));
}

/* Load or store q_s and q_t of the cell of each of `count` facets: `row` of the first facet, `spacing`
 * rows from facet to facet; as jl_load and jl_store. sliders: of a joint, the rows between q_s and
 * q_t of doubles. Stored forces must have been rounded. */
JL_INLINE void jl_load_sliders(jl_states n, int row, int sliders, int spacing, int count,
                               jl_real *qs, jl_real *qt)
{
  (void) sliders;
  const jl_bits pair = jl_to_bits(jl_load(n, row, spacing, count));
  *qs = jl_float_from_bits(pair);
  *qt = jl_float_from_bits(pair >> 32);
}
JL_INLINE void jl_store_sliders(jl_states n, int row, int sliders, int spacing, int count,
                                jl_real qs, jl_real qt)
{
  (void) sliders;
  const jl_bits pair = jl_float_to_bits(qs) | (jl_float_to_bits(qt) << 32);
  jl_store(n, row, spacing, count, jl_from_bits(pair));
}

#else
#define JL_NUMBERS_PER_SLIDER 2
#define JL_FRICTION_TOLERANCE JLAW_FRICTION_TOLERANCE
#define JL_LIMIT_FACTOR 1.0

JL_INLINE void jl_load_sliders(jl_states n, int row, int sliders, int spacing, int count,
                               jl_real *qs, jl_real *qt)
{
  *qs = jl_load(n, row, spacing, count);
  *qt = jl_load(n, row + sliders, spacing, count);
}
JL_INLINE void jl_store_sliders(jl_states n, int row, int sliders, int spacing, int count,
                                jl_real qs, jl_real qt)
{
  jl_store(n, row, spacing, count, qs);
  jl_store(n, row + sliders, spacing, count, qt);
}
#endif
