/* contacts.h: arguments of the geometry of contacts, for adapters of particle codes; the structure
 * `ContactCall` of contacts.py is the same.
 *
 * Arrays of vectors over contacts are (3, n): component by component. Body 1 and body 2 of a contact
 * are rows of the arrays over bodies. Quaternions have their real part first. */
#ifndef JLAW_CONTACTS_H
#define JLAW_CONTACTS_H

typedef struct {
  long long n, bodies;
  /* bodies: positions (bodies, 3) and orientations (bodies, 4) before and after a step */
  const double *x0, *x, *q0, *q;
  double *motion;           /* (2, bodies, 3): memory for displacements and rotation vectors */
  const long long *b1, *b2; /* (n,): bodies of a contact */
  /* (n,): radii, contact area, overlap of zero closure, 1 for two spheres and 0 for other shapes,
   * closure before the step */
  const double *R1, *R2, *area, *zero_overlap, *both_spheres, *closure0;
  /* (3, n), before the step: normal, axis 2, contact point relative to the centres of the bodies */
  const double *n0, *t0, *c10, *c20;
  const double *plane; /* (3, n): normal of a flat joint in the axes of body 1, or NULL */
  double *axis;        /* (3, n): axis 2 in the axes of body 1 */
  /* after the step; normal, overlap and contact point of other shapes than spheres are inputs */
  double *normal, *overlap, *c1, *c2; /* (3, n), (n,), (3, n), (3, n) */
  double *t2, *closure;               /* (3, n), (n,) */
  double *d;                          /* (n, 3): increments of the displacement for the law */
  double *approach;                   /* (n,): displacement of body 1 along the normal */
  const double *F;                    /* (n, 3): tractions */
  const double *added;                /* (n, 3): forces on body 1 added to them, or NULL */
  double *force, *torque;             /* (bodies, 3): sums over contacts */
} jlaw_contacts;

#endif
