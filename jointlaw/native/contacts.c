/* contacts.c: geometry of the contacts of many bodies, for adapters of particle codes.
 *
 * The functions compute the formulas of `Joints` in hosts/yade/files/yade_joint.py in the same order
 * of operations, so they give the same bits as numpy: there is the explanation of the formulas. A
 * loop over contacts has no branches, so that compilers vectorise it. This file is compiled for
 * every vector width: -DKIND=_8 and the like is the suffix of its functions.
 */
#include "contacts.h"
#include "export.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

#define GLUE2(a, b) a##b
#define GLUE(a, b) GLUE2(a, b)
#define NAME(x) GLUE(x, KIND)

enum { CONTACTS_PER_TILE = 256 /* whose forces are on the stack */ };
static const double MIN_SQUARED_SINE = 0.25; /* of the angle between reference and normal */

typedef struct {
  double x, y, z;
} vector;

typedef struct {
  double w;
  vector u;
} quaternion;

#define HERE static inline __attribute__((always_inline))
HERE vector make(double x, double y, double z)
{
  const vector v = {x, y, z};
  return v;
}
HERE vector plus(vector a, vector b) { return make(a.x + b.x, a.y + b.y, a.z + b.z); }
HERE vector minus(vector a, vector b) { return make(a.x - b.x, a.y - b.y, a.z - b.z); }
HERE vector times(vector a, double s) { return make(a.x * s, a.y * s, a.z * s); }
HERE vector over(vector a, double s) { return make(a.x / s, a.y / s, a.z / s); }
HERE double dot(vector a, vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
HERE vector cross(vector a, vector b)
{
  return make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
HERE vector unit(vector a) { return over(a, sqrt(dot(a, a))); }
HERE vector project(vector a, vector n) { return minus(a, times(n, dot(a, n))); }
HERE vector rotate(quaternion q, vector v)
{
  const vector t = times(cross(q.u, v), 2.0);
  return plus(plus(v, times(t, q.w)), cross(q.u, t));
}
HERE vector choose(int first, vector a, vector b)
{
  return make(first ? a.x : b.x, first ? a.y : b.y, first ? a.z : b.z);
}

/* Vector k of an array (3, n), and of an array (n, 3) */
HERE vector column(const double *a, long long n, long long k)
{
  return make(a[k], a[n + k], a[2 * n + k]);
}
HERE void set_column(double *a, long long n, long long k, vector v)
{
  a[k] = v.x;
  a[n + k] = v.y;
  a[2 * n + k] = v.z;
}
HERE vector row(const double *a, long long k) { return make(a[3 * k], a[3 * k + 1], a[3 * k + 2]); }
HERE void set_row(double *a, long long k, vector v)
{
  a[3 * k] = v.x;
  a[3 * k + 1] = v.y;
  a[3 * k + 2] = v.z;
}
HERE quaternion orientation(const double *q, long long k)
{
  const quaternion result = {q[4 * k], {q[4 * k + 1], q[4 * k + 2], q[4 * k + 3]}};
  return result;
}

/* Displacements and rotation vectors of all bodies in the step */
static void move_bodies(const jlaw_contacts *c)
{
  double *__restrict displacement = c->motion, *__restrict turn = c->motion + 3 * c->bodies;
  for (long long i = 0; i < 3 * c->bodies; i++) displacement[i] = c->x[i] - c->x0[i];
  for (long long k = 0; k < c->bodies; k++) {
    const quaternion q = orientation(c->q, k), old = orientation(c->q0, k);
    const vector u = plus(minus(times(q.u, old.w), times(old.u, q.w)), cross(old.u, q.u));
    set_row(turn, k, over(times(u, 2.0), q.w * old.w + dot(q.u, old.u)));
  }
}

/* Normal, overlap, contact points, and axis 2 before it is normalised */
static void find_frames(const jlaw_contacts *c)
{
  const long long n = c->n;
  const double *__restrict x = c->x, *__restrict q = c->q, *__restrict axis = c->axis;
  const double *__restrict R1 = c->R1, *__restrict R2 = c->R2, *__restrict plane = c->plane;
  const double *__restrict both_spheres = c->both_spheres;
  double *__restrict normal = c->normal, *__restrict overlap = c->overlap;
  double *__restrict c1 = c->c1, *__restrict c2 = c->c2, *__restrict t2 = c->t2;
  const long long *__restrict b1 = c->b1, *__restrict b2 = c->b2;
  if (plane) {
    for (long long k = 0; k < n; k++) {
      const vector r = minus(row(x, b2[k]), row(x, b1[k]));
      const vector m = rotate(orientation(q, b1[k]), column(plane, n, k));
      const vector point = times(r, R1[k] / (R1[k] + R2[k]));
      set_column(normal, n, k, m);
      overlap[k] = -dot(r, m);
      set_column(c1, n, k, point);
      set_column(c2, n, k, minus(point, r));
    }
  } else {
    for (long long k = 0; k < n; k++) {
      const int spheres = both_spheres[k] != 0.0;
      const vector r = minus(row(x, b2[k]), row(x, b1[k]));
      const double length = sqrt(dot(r, r)), un = R1[k] + R2[k] - length;
      const vector m = over(r, length), point = times(m, R1[k] - un / 2.0);
      set_column(normal, n, k, choose(spheres, m, column(normal, n, k)));
      overlap[k] = spheres ? un : overlap[k];
      set_column(c1, n, k, choose(spheres, point, column(c1, n, k)));
      set_column(c2, n, k, choose(spheres, minus(point, r), column(c2, n, k)));
    }
  }
  for (long long k = 0; k < n; k++) {
    const vector m = column(normal, n, k);
    set_column(t2, n, k, project(rotate(orientation(q, b1[k]), column(axis, n, k)), m));
  }
}

/* Replace the reference of axis 2 of contacts that rolled until it is within 30 degrees of the
 * normal: the last axis 2 continues */
static void replace_steep_axes(const jlaw_contacts *c)
{
  const long long n = c->n;
  for (long long k = 0; k < n; k++) {
    const vector t2 = column(c->t2, n, k);
    if (!(dot(t2, t2) < MIN_SQUARED_SINE)) continue;
    const vector next = unit(project(column(c->t0, n, k), column(c->normal, n, k)));
    const quaternion q = orientation(c->q, c->b1[k]);
    const quaternion inverse = {q.w, {-q.u.x, -q.u.y, -q.u.z}};
    set_column(c->t2, n, k, next);
    set_column(c->axis, n, k, rotate(inverse, next));
  }
}

/* Frames of all contacts after a step, and increments of their displacements in the mean frame */
IN_C void NAME(jlaw_contact_motion)(const jlaw_contacts *c);
void NAME(jlaw_contact_motion)(const jlaw_contacts *c)
{
  const long long n = c->n;
  move_bodies(c);
  find_frames(c);
  replace_steep_axes(c);
  const double *__restrict displacement = c->motion, *__restrict turn = c->motion + 3 * c->bodies;
  const double *__restrict normal = c->normal, *__restrict overlap = c->overlap;
  const double *__restrict n0 = c->n0, *__restrict t0 = c->t0, *__restrict c10 = c->c10;
  const double *__restrict c20 = c->c20, *__restrict c1 = c->c1, *__restrict c2 = c->c2;
  const double *__restrict zero_overlap = c->zero_overlap, *__restrict closure0 = c->closure0;
  double *__restrict t2 = c->t2, *__restrict closure = c->closure, *__restrict d = c->d;
  double *__restrict approach = c->approach;
  const long long *__restrict b1 = c->b1, *__restrict b2 = c->b2;
  for (long long k = 0; k < n; k++) {
    const vector m = column(normal, n, k), t = unit(column(t2, n, k));
    const vector by_turn1 = cross(row(turn, b1[k]), plus(column(c1, n, k), column(c10, n, k)));
    const vector by_turn2 = cross(row(turn, b2[k]), plus(column(c2, n, k), column(c20, n, k)));
    const vector du = plus(minus(row(displacement, b1[k]), row(displacement, b2[k])),
                           over(minus(by_turn1, by_turn2), 2.0));
    const vector middle = unit(plus(m, column(n0, n, k)));
    const vector across = unit(plus(t, column(t0, n, k)));
    set_column(t2, n, k, t);
    closure[k] = overlap[k] - zero_overlap[k];
    set_row(d, k, make(closure[k] - closure0[k], dot(du, across), dot(du, cross(middle, across))));
    approach[k] = dot(du, m);
  }
}

/* Forces and torques on all bodies by the tractions F */
IN_C void NAME(jlaw_contact_forces)(const jlaw_contacts *c);
void NAME(jlaw_contact_forces)(const jlaw_contacts *c)
{
  const long long n = c->n;
  const size_t size = 3 * (size_t) c->bodies * sizeof *c->force;
  double *force2 = c->motion, *torque2 = c->motion + 3 * c->bodies; /* of bodies 2 */
  memset(c->force, 0, size);
  memset(c->torque, 0, size);
  memset(c->motion, 0, 2 * size);
  for (long long first = 0; first < n; first += CONTACTS_PER_TILE) {
    const long long count = n - first < CONTACTS_PER_TILE ? n - first : CONTACTS_PER_TILE;
    double force[3 * CONTACTS_PER_TILE], moment1[3 * CONTACTS_PER_TILE];
    double moment2[3 * CONTACTS_PER_TILE];
    for (long long i = 0; i < count; i++) {
      const long long k = first + i;
      const vector m = column(c->normal, n, k), t = column(c->t2, n, k), F = row(c->F, k);
      const vector traction = plus(plus(times(m, F.x), times(t, F.y)), times(cross(m, t), F.z));
      set_row(force, i, times(traction, -c->area[k]));
    }
    for (long long i = 0; c->added && i < 3 * count; i++)
      force[i] = force[i] + c->added[3 * first + i];
    for (long long i = 0; i < count; i++) {
      const vector f = row(force, i);
      set_row(moment1, i, cross(column(c->c1, n, first + i), f));
      set_row(moment2, i, cross(f, column(c->c2, n, first + i)));
    }
    for (long long i = 0; i < count; i++) {
      const long long b1 = c->b1[first + i], b2 = c->b2[first + i];
      set_row(c->force, b1, plus(row(c->force, b1), row(force, i)));
      set_row(force2, b2, plus(row(force2, b2), row(force, i)));
      set_row(c->torque, b1, plus(row(c->torque, b1), row(moment1, i)));
      set_row(torque2, b2, plus(row(torque2, b2), row(moment2, i)));
    }
  }
  for (long long i = 0; i < 3 * c->bodies; i++) {
    c->force[i] = c->force[i] - force2[i];
    c->torque[i] = c->torque[i] + torque2[i];
  }
}
