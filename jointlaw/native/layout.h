/* Made from layout.py by `python -m jointlaw.native`; change it there. */
#define JLAW_FORMAT 4 /* of table files */
enum {
  JLAW_LANES = 4, /* facets side by side in a block of the tables */
  JLAW_AZIMUTHS = 512, /* most */
  JLAW_M = 0, /* m = n/c1: y = m . (closure, offset) */
  JLAW_S = 3, /* in-facet direction s */
  JLAW_T = 6, /* in-facet direction t */
  JLAW_N = 9, /* normal n */
  JLAW_E = 12, /* unit vector of the azimuth */
  JLAW_STEEP = 14, /* tan(theta) */
  JLAW_COSINE = 15, /* c1 */
  JLAW_A = 16, /* A */
  JLAW_STIFF = 17, /* A/c1 */
  JLAW_STRENGTH = 18, /* mu lam A */
  JLAW_COMPLIANCE = 19, /* c1/(2 A lam): from |q|^2/kappa to energy */
  JLAW_POTENTIAL = 20, /* A c1 */
  JLAW_SHARE = 21, /* of all orientations */
  JLAW_YIELD = 22, /* y_p = d_y/c1 */
  JLAW_MIRROR = 23, /* the facet mirrored along axis 2 */
  JLAW_RING = 24, /* facets of this inclination, one after the other */
  JLAW_LATE = 25, /* unsheared joint: share, depth, share, depth of what yielding takes off */
  JLAW_COLUMNS = 29, /* of a facet */
  JLAW_LOW = 0, /* zeta at its begin */
  JLAW_FORCE = 1, /* Phi there */
  JLAW_SLOPE = 2, /* Phi' there */
  JLAW_HIGH = 3, /* zeta at its end */
  JLAW_G = 4, /* G there */
  JLAW_KAPPA = 5, /* kappa there */
  JLAW_ROWS = 6 /* of a depth cell */
};
#define JLAW_UNDERFLOW 1e-140
#define JLAW_TINY 1e-290
#define JLAW_FAINT 1e-150
#define JLAW_NEAR 1e-05
#define JLAW_LIMIT 1e-09
#define JLAW_ROUNDED 1e-12
#define JLAW_FAR 100.0
struct jlaw_law {
  int dim; /* components of a displacement */
  int facets; /* M */
  int cells; /* D, depth cells of a facet */
  int pieces; /* of the virgin curve */
  int yields; /* whether asperities yield */
  int fades; /* whether slopes fade with the distance from mate */
  int wears; /* whether slopes wear */
  int bonded; /* whether there is a bond */
  double soft; /* 1/lam */
  double mu; /* friction of asperities */
  double mating_length; /* m; infinite: the largest float */
  double slope_wear; /* J/m2; infinite: the largest float */
  double slope_residual; /* share of the slopes that never wears */
  double first_touch; /* m: closure at which an unmated joint touches */
  double eta; /* exponent of the virgin curve */
  double scale; /* V of the virgin curve, m^(1/2) */
  double rise; /* p: the curve is tabulated over w^p */
  double bond_normal; /* Pa/m: stiffness of the bond */
  double bond_shear; /* Pa/m */
  double opening_begin; /* 1/m: one over the opening where it begins to break */
  double slip_begin; /* 1/m: the same of slip */
  double opening_end; /* 1/m: where nothing of it is left */
  double slip_end; /* 1/m */
  double closure_factor; /* normal stress over Phi */
  double stiffness_factor; /* bound of |C| over Phi' */
  double bending_factor; /* what slopes that fade add to it, over Phi */
  double largest_reach; /* m: bound of |y| */
  double stretch; /* bound of |y| over that of the displacement */
  double farthest; /* m: largest closure that a stress is looked for in */
  const double *facet; /* (blocks, JLAW_COLUMNS, JLAW_LANES), zeros beyond the last facet */
  const double *depth; /* (blocks, cells, JLAW_ROWS, JLAW_LANES) */
  const double *curve; /* (pieces, 4): S of the virgin curve */
  const double *energy; /* (pieces, 4): T */
  double *own; /* what jlaw_free frees */
  char fingerprint[80];
};
/* Each number of a table file: its name, 1 if it is whole, its bounds */
#define JLAW_NUMBERS(X) \
  X(dim, 1, 1, 3) \
  X(facets, 1, 1, 1e6) \
  X(cells, 1, 1, 1e6) \
  X(pieces, 1, 1, 1e6) \
  X(yields, 1, 0, 1) \
  X(fades, 1, 0, 1) \
  X(wears, 1, 0, 1) \
  X(bonded, 1, 0, 1) \
  X(soft, 0, 0, DBL_MAX) \
  X(mu, 0, 0, DBL_MAX) \
  X(mating_length, 0, DBL_MIN, DBL_MAX) \
  X(slope_wear, 0, DBL_MIN, DBL_MAX) \
  X(slope_residual, 0, 0, 1) \
  X(first_touch, 0, -DBL_MAX, 0) \
  X(eta, 0, 0, DBL_MAX) \
  X(scale, 0, DBL_MIN, DBL_MAX) \
  X(rise, 0, 0, DBL_MAX) \
  X(bond_normal, 0, 0, DBL_MAX) \
  X(bond_shear, 0, 0, DBL_MAX) \
  X(opening_begin, 0, 0, DBL_MAX) \
  X(slip_begin, 0, 0, DBL_MAX) \
  X(opening_end, 0, 0, DBL_MAX) \
  X(slip_end, 0, 0, DBL_MAX) \
  X(closure_factor, 0, 0, DBL_MAX) \
  X(stiffness_factor, 0, 0, DBL_MAX) \
  X(bending_factor, 0, 0, DBL_MAX) \
  X(largest_reach, 0, 0, DBL_MAX) \
  X(stretch, 0, 1, DBL_MAX) \
  X(farthest, 0, 0, DBL_MAX)
