/* blocks.h: rigid blocks in two dimensions between which the law acts; docs/blocks.md describes it.
 * Python owns all arrays and keeps them in place (dem_demo/compiled.py has the same structures);
 * nothing here allocates or keeps anything. n blocks, c corners, k contacts; SI units; two numbers
 * of a vector lie side by side. */
#ifndef JLAW_BLOCKS_H
#define JLAW_BLOCKS_H

typedef struct {
  double x, y;
} jl_vector;

typedef struct {                    /* the joints of one law, by their places in its batch */
  double *d;                        /* (places, 2): increments that its next step takes, m */
  const double *F;                  /* (places, 2): tractions after it, Pa */
  const double *shown;              /* (places, JLAW_MEASURES + 2): what batch.h says */
  const double *stress, *stiffness; /* (points,): its virgin curve, Pa and Pa/m */
  long long points, holds;          /* holds: whether joints hold tension until they are damaged */
} jl_pool;

typedef struct {
  long long blocks, corners, contacts, driven;
  double thickness, corner_length, soft; /* m; see dem_demo/contact/geometry.py */
  double parts;                          /* steps of the law per time step */
  double dashpot_normal, dashpot_shear;  /* shares of critical damping */
  double max_path, max_stale; /* shares of a skin that a block may move: in a step, unseen */

  double *motion;       /* (6, n): x, y, turn and the velocities that led there */
  double *velocity;     /* (3, n): those to go on with */
  double *renewed;      /* (3, n): where each block was when contacts were looked for */
  double *force, *last; /* (3, n, 3): all, dashpots, drives; (2, n, 3): last dashpots and drives */
  const double *inertia, *gravity, *loads;          /* (n, 3) */
  const double *lightness, *reach, *skin, *deepest; /* (n,): 1/kg of what gives way; m */
  const unsigned char *mobile;                      /* (n,) */
  unsigned char *urgent; /* (n,): blocks whose contacts must be looked for */

  const jl_vector *local, *way;            /* (c,): corners from the centroid; ways of the edges */
  const double *side;                      /* (c,): lengths of the edges */
  const long long *block, *before, *after; /* (c,): of each corner: block, corners next to it */
  jl_vector *placed, *turned;              /* (c,): corners and ways of edges now */

  long long *corner, *edge;      /* (k,): which corner is over which edge */
  long long *a, *b;              /* (k,): their blocks, a < b */
  jl_vector *at, *normal, *pull; /* (k,) as dem_demo/contact/geometry.py describes them */
  double *closure, *length, *twist, *opening, *sliding;
  double *rise, *carried, *inside; /* (2, k) */
  unsigned char *own;              /* (2, k) */
  double *was;                     /* (k,): length before a corner went on to another edge */
  double *offset;                  /* (k,): closure offset; below zero at any depth */
  long long *out;                  /* (k,): work */

  const jl_pool *pools;
  const long long *law, *place; /* (k,): pool of each contact, and place there */
  const double *touch;          /* (k, 2): where its joint first touches, m */
  const double *reduction;      /* (2,): 1 and the F of a strength reduction */
  double *traction, *delta;     /* (k, 2) */
  double *shares;               /* (JLAW_MEASURES, k): what the law shows of each contact */
  double *area, *lost;          /* (k,): of the last step: m2, J/m2 */
  double *checked;              /* (k,): N/m for which the time step is good */

  const long long *rows, *axes; /* (driven,): blocks and motions that drives move */
  const double *aim;            /* (driven,): velocities that they are to have */
  double *energy;               /* (8,): as dem_demo/dynamics/energy.py has them */

  long long fast, deep; /* block that moves too fast, contact that is too deep; -1 for none */
  long long moved, stale, stiffer; /* contacts that went on; whether to look; joints to check */
} jl_world;
#endif
