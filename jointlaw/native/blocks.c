/* blocks.c: one step of rigid blocks, around the law's: see blocks.h */
#include "batch.h"
#include "blocks.h"
#include "export.h"

#define LOW 0.03489949670250097  /* sine of 2 degrees: up to there an edge lies on another */
#define HIGH 0.08715574274765817 /* of 5: from there on it does not */
#define TIE 1e-9                 /* sine of an angle that is none but for rounding */
#define EVEN 1e-10               /* m: the same of a length */
#define LEVEL 1e-6               /* sine of a tilt that is none, past the limit of a range */
#define ROUNDING 1e-10           /* m: corners stay until their depth is wrong by this */
#define ROUNDS 8                 /* most edges that a corner goes on by in a step */

/* ------------------------------------------------------------------------- vectors */

static inline jl_vector vector(double x, double y)
{
  const jl_vector v = {x, y};
  return v;
}
static inline jl_vector plus(jl_vector p, jl_vector q) { return vector(p.x + q.x, p.y + q.y); }
static inline jl_vector minus(jl_vector p, jl_vector q) { return vector(p.x - q.x, p.y - q.y); }
static inline jl_vector times(double s, jl_vector p) { return vector(s * p.x, s * p.y); }
static inline double dot(jl_vector p, jl_vector q) { return p.x * q.x + p.y * q.y; }
static inline double cross(jl_vector p, jl_vector q) { return p.x * q.y - p.y * q.x; }
/* p turned by the angle of the unit vector q, and turned back */
static inline jl_vector turn(jl_vector p, jl_vector q)
{
  return vector(p.x * q.x - p.y * q.y, p.x * q.y + p.y * q.x);
}
static inline jl_vector against(jl_vector p, jl_vector q) { return vector(dot(q, p), cross(q, p)); }
static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

/* ------------------------------------------------------------- a corner over an edge */

static inline jl_vector centre(const jl_world *w, long long block)
{
  return vector(w->motion[block], w->motion[w->blocks + block]);
}

/* Velocity of the point p of a block */
static inline jl_vector velocity_at(const jl_world *w, long long block, jl_vector p)
{
  const long long n = w->blocks;
  const jl_vector arm = minus(p, centre(w, block));
  const double spin = w->motion[5 * n + block];
  return vector(w->motion[3 * n + block] - spin * arm.y, w->motion[4 * n + block] + spin * arm.x);
}

/* |x| without the kink, within `soft` of 0; its derivative */
static inline double soft_size(double x, double soft, double *slope)
{
  const double size = fabs(x), part = smaller(size / soft, 1.0);
  *slope = (double) ((x > 0.0) - (x < 0.0)) * part * (4.0 - 3.0 * part);
  return size * part * (2.0 - part);
}

/* Length of joint at a corner that stands on an edge (m): none at the end of the edge, where blocks
 * meet in a point; its derivative by x, the place of the corner along the edge (m) */
static double stood_on(const jl_world *w, double x, double whole_edge, double *slope)
{
  const double reach = smaller(w->soft, 0.5 * whole_edge), left = whole_edge - x;
  const double part = larger(smaller(smaller(x, left) / reach, 1.0), 0.0);
  *slope = w->corner_length * 6.0 * part * (1.0 - part) / (x < left ? reach : -reach);
  return w->corner_length * part * part * (3.0 - 2.0 * part);
}

/* 0 for an edge that lies on the other, 1 for one that does not; derivative by its tilt (1/rad) */
static inline double raised(double sine, double cosine, double *bend)
{
  double part = (fabs(sine) - LOW) / (HIGH - LOW);
  part = smaller(larger(part, cosine <= 0.0 ? 1.0 : 0.0), 1.0);
  *bend = 6.0 / (HIGH - LOW) * part * (1.0 - part) * cosine;
  return part * part * (3.0 - 2.0 * part);
}

/* Contact i at the motion of the blocks. Vectors are in the frame of the edge, whose block is on the
 * left; side 0 of the corner goes ahead, towards the end of the edge, side 1 towards its start. */
static void place_contact(const jl_world *w, long long i)
{
  static const double ahead[2] = {1.0, -1.0};
  const long long corner = w->corner[i], edge = w->edge[i], k = w->contacts;
  const long long x = w->block[corner], y = w->block[edge];
  const double sign = x > y ? 1.0 : -1.0, soft = w->soft, whole_edge = w->side[edge];
  const jl_vector at = w->placed[corner], way = w->turned[edge];
  const jl_vector here = against(minus(at, w->placed[edge]), way);
  const long long sides[2] = {w->before[corner], corner};
  const long long behind[2] = {w->before[edge], w->after[edge]};
  const jl_vector rest[2] = {vector(whole_edge - here.x, -here.y), vector(-here.x, -here.y)};
  jl_vector side[2], both[2], mean[2], left[2], part[2];
  double gone[2], bend[2], held[2], lies[2], stands[2], twist[2], rise[2];
  for (int s = 0; s < 2; s++) {
    side[s] = times(-ahead[s], against(w->turned[sides[s]], way));
    both[s] = vector(ahead[s] + side[s].x, side[s].y);
    mean[s] = times(1.0 / larger(sqrt(dot(both[s], both[s])), 1e-9), both[s]);
    left[s] = against(rest[s], mean[s]);
    rise[s] = -side[s].y;
  }
  for (int s = 0; s < 2; s++) {
    /* Overlap of the side with the edge, along the mean of both so that blocks may trade roles: it
     * runs from the corner, or what lies behind it if that comes later, to the end of the edge or
     * of the side, whichever comes first. */
    const jl_vector whole = against(times(w->side[sides[s]], side[s]), mean[s]);
    const jl_vector back = turn(left[1 - s], against(mean[1 - s], mean[s]));
    double slope, rate;
    const double size = soft_size(left[s].x - whole.x, soft, &slope);
    const double step = soft_size(back.x, soft, &rate);
    const double overlap = 0.5 * (left[s].x + whole.x - size - back.x - step);
    const double by_edge = 0.5 - 0.5 * slope, by_end = -0.5 - 0.5 * rate;
    twist[s] = 0.5 * (by_edge * (left[s].y + whole.y) + by_end * back.y - whole.y);
    part[s] = times(-(by_edge + by_end), mean[s]);
    gone[s] = raised(rise[s], ahead[s] * side[s].x, &bend[s]);
    held[s] = larger(overlap, 0.0);
    lies[s] = overlap > EVEN ? 0.5 * (1.0 - gone[s]) : 0.0;
    stands[s] = rise[s] > 0.0 ? gone[s] : 0.0;
  }
  double turning = 0.0, along;
  const double stood = stood_on(w, here.x, whole_edge, &along);
  jl_vector pull = vector(stands[0] * stands[1] * along, 0.0);
  for (int s = 0; s < 2; s++) {
    const double up = (double) ((rise[s] > 0.0) - (rise[s] < 0.0));
    const double by_tilt = stood * (up > 0.0) * stands[1 - s] - 0.5 * held[s] * up;
    turning += lies[s] * twist[s] - ahead[s] * bend[s] * by_tilt;
    pull = plus(pull, times(lies[s], part[s]));
    w->rise[s * k + i] = rise[s];
    w->carried[s * k + i] = lies[s] * held[s];
    /* Behind a corner its edge ends at another corner. Of what follows there, a side of this corner
     * or the next edge of the other block, the one that is turned less is next; the limit is where
     * both are equally deep. The raised end of an edge on an edge has its side next. Drawn joints
     * are parallel but for rounding, which must not choose: they count as parallel. */
    const jl_vector beyond = times(ahead[s], against(w->way[behind[s]], w->way[edge]));
    const int own = ahead[s] * cross(side[s], beyond) <= TIE || rise[1 - s] < -TIE;
    const jl_vector toward = own ? both[s] : vector(ahead[s] + beyond.x, beyond.y);
    w->own[s * k + i] = (unsigned char) own;
    w->inside[s * k + i] = -dot(rest[1 - s], toward) * (own ? fabs(rise[s]) + LEVEL : 1.0);
  }
  w->length[i] = w->carried[i] + w->carried[k + i] + stood * stands[0] * stands[1];
  w->pull[i] = times(sign, turn(pull, way));
  w->twist[i] = sign * turning;
  w->at[i] = at;
  w->normal[i] = vector(sign * way.y, -sign * way.x);
  w->closure[i] = here.y;
  w->a[i] = x < y ? x : y;
  w->b[i] = x < y ? y : x;
  const jl_vector v = minus(velocity_at(w, w->b[i], at), velocity_at(w, w->a[i], at));
  w->opening[i] = dot(v, w->normal[i]);
  w->sliding[i] = -cross(w->normal[i], v);
}

/* Corners of all blocks, and the ways of their edges, at the motion of the blocks */
static void place_corners(const jl_world *w)
{
  jl_vector unit = vector(1.0, 0.0);
  for (long long c = 0, last = -1; c < w->corners; c++) {
    const long long block = w->block[c];
    if (block != last) {
      const double angle = w->motion[2 * w->blocks + block];
      unit = vector(cos(angle), sin(angle));
      last = block;
    }
    w->placed[c] = plus(centre(w, block), turn(w->local[c], unit));
    w->turned[c] = turn(w->way[c], unit);
  }
}

/* All contacts at the motion of the blocks, each where it is */
OUT void jl_blocks_place(jl_world *w)
{
  place_corners(w);
  for (long long i = 0; i < w->contacts; i++) place_contact(w, i);
}

/* Side of the nearer limit of the corner's range; the contact that comes next there: its corner and
 * edge, and whether the corner at the end of the edge takes over */
static int following(const jl_world *w, long long i, long long *corner, long long *edge)
{
  const long long k = w->contacts;
  const int s = w->inside[k + i] < w->inside[i];
  const int trade = w->own[s * k + i];
  const long long c = w->corner[i], e = w->edge[i];
  *corner = trade ? (s ? w->after[e] : e) : c;
  *edge = trade ? (s ? c : w->before[c]) : (s ? w->after[e] : w->before[e]);
  return trade;
}

/* The contacts that come next at the limits of ranges: corners and edges (k,) */
OUT void jl_blocks_following(const jl_world *w, long long *corner, long long *edge)
{
  for (long long i = 0; i < w->contacts; i++) following(w, i, corner + i, edge + i);
}

static int leaves(const jl_world *w, long long i)
{
  return w->inside[i] < -ROUNDING || w->inside[w->contacts + i] < -ROUNDING;
}

static int is_double(const jl_world *w, long long i)
{
  for (long long j = 0; j < w->contacts; j++)
    if (j != i && w->corner[j] == w->corner[i] && w->edge[j] == w->edge[i]) return 1;
  return 0;
}

/* All contacts at the motion of the blocks, each at the corner and edge where it is by then. Where
 * something new may be next to one, its blocks become urgent. */
OUT void jl_blocks_follow(jl_world *w)
{
  long long left = 0;
  place_corners(w);
  for (long long i = 0; i < w->contacts; i++) {
    place_contact(w, i);
    w->was[i] = w->length[i];
    if (leaves(w, i)) w->out[left++] = i;
  }
  w->moved = left;
  for (int round = 0; round < ROUNDS && left; round++) {
    long long still = 0;
    for (long long j = 0; j < left; j++) {
      const long long i = w->out[j];
      if (!following(w, i, w->corner + i, w->edge + i)) w->urgent[w->a[i]] = w->urgent[w->b[i]] = 1;
      place_contact(w, i);
    }
    for (long long j = 0; j < left; j++)
      if (is_double(w, w->out[j])) w->urgent[w->a[w->out[j]]] = w->urgent[w->b[w->out[j]]] = 1;
    for (long long j = 0; j < left; j++)
      if (leaves(w, w->out[j])) w->out[still++] = w->out[j];
    left = still;
  }
}

/* Of a corner above the line of an edge */
static double height(const jl_world *w, long long corner, long long edge)
{
  return -cross(w->turned[edge], minus(w->placed[corner], w->placed[edge]));
}

/* Of pairs (p, 2) of blocks: corners over edges that are `near` or nearer and no deeper than
 * `deepest` (p,) allows, the pairs they belong to (side 1: p + pair), and how far the blocks are
 * apart (2, p), negative where they overlap. Writes at most `room` of them and returns how many. */
OUT long long jl_blocks_find(const jl_world *w, long long p, const long long *pairs,
                             const long long *start, const double *near, const double *deepest,
                             long long room, long long *corner, long long *edge, long long *pair,
                             double *apart)
{
  long long found = 0;
  place_corners(w);
  for (long long i = 0; i < 2 * p; i++) {
    const long long of = i % p, x = pairs[2 * of + (i >= p)], y = pairs[2 * of + (i < p)];
    apart[i] = -HUGE_VAL;
    for (long long e = start[y]; e < start[y + 1]; e++) {
      double least = HUGE_VAL;
      for (long long c = start[x]; c < start[x + 1]; c++) least = smaller(least, height(w, c, e));
      apart[i] = larger(apart[i], least);
    }
    for (long long c = start[x]; c < start[x + 1]; c++)
      for (long long e = start[y]; e < start[y + 1]; e++) {
        const double above = height(w, c, e);
        if (!(above < near[of] && above > -deepest[of])) continue;
        if (found < room) corner[found] = c, edge[found] = e, pair[found] = i;
        found++;
      }
  }
  return found;
}

/* ------------------------------------------------------------------------ before the law */

/* Increments of all joints, each in its place for its law; notes a contact that is too deep */
OUT void jl_blocks_press(jl_world *w, double dt)
{
  w->deep = -1;
  for (long long i = 0; i < w->contacts; i++) {
    const double closure = w->closure[i], offset = w->offset[i];
    const double most = smaller(w->deepest[w->a[i]], w->deepest[w->b[i]]);
    if (w->length[i] > 0.0 && closure > most) w->deep = i;
    double *d = w->pools[w->law[i]].d + 2 * w->place[i];
    d[0] = (closure - (closure > 0.0 || offset < 0.0 ? offset : 0.0) - w->delta[2 * i]) / w->parts;
    d[1] = w->sliding[i] * dt / (w->parts * w->reduction[1]);
  }
}

/* Move the blocks and follow the contacts; increments for the law. Notes a block that is too fast,
 * before any has moved, and whether blocks have moved so far that contacts must be looked for. */
OUT void jl_blocks_before(jl_world *w, double dt)
{
  const long long n = w->blocks;
  w->fast = -1;
  w->stale = 0;
  for (long long i = 0; i < n; i++) {
    const double *v = w->velocity + i;
    const double speed = fabs(v[0]) + fabs(v[n]) + fabs(v[2 * n]) * w->reach[i];
    if (w->mobile[i] && !(speed * dt < w->max_path * w->skin[i])) w->fast = i; /* NaN too */
  }
  if (w->fast >= 0) return;
  for (long long i = 0; i < n; i++) {
    double *m = w->motion + i, moved[3];
    if (!w->mobile[i]) continue;
    for (int j = 0; j < 3; j++) {
      m[(3 + j) * n] = w->velocity[j * n + i];
      m[j * n] += dt * m[(3 + j) * n];
      moved[j] = m[j * n] - w->renewed[j * n + i];
    }
    const double far =
        sqrt(moved[0] * moved[0] + moved[1] * moved[1]) + fabs(moved[2]) * w->reach[i];
    if (far > w->max_stale * w->skin[i]) w->stale = 1;
  }
  jl_blocks_follow(w);
  for (long long i = 0; i < n && w->moved; i++) w->stale |= w->urgent[i];
  jl_blocks_press(w, dt);
}

/* ------------------------------------------------------------------------- after the law */

/* What the law shows of each contact: traction, displacement from first touch, shares */
OUT void jl_blocks_read(jl_world *w)
{
  for (long long i = 0; i < w->contacts; i++) {
    const jl_pool *pool = w->pools + w->law[i];
    const double *F = pool->F + 2 * w->place[i];
    const double *shown = pool->shown + (JLAW_MEASURES + 2) * w->place[i];
    w->traction[2 * i] = F[0];
    w->traction[2 * i + 1] = F[1] / w->reduction[1];
    for (int r = 0; r < JLAW_MEASURES; r++) w->shares[r * w->contacts + i] = shown[r];
    if (!pool->holds) w->shares[JLAW_DAMAGE * w->contacts + i] = 1.0;
    w->delta[2 * i] = shown[JLAW_MEASURES] - w->touch[2 * i];
    w->delta[2 * i + 1] = (shown[JLAW_MEASURES + 1] - w->touch[2 * i + 1]) * w->reduction[1];
  }
}

/* Upper bound of the stiffness (Pa/m) of contact i at its normal stress of now */
static double stiffness_of(const jl_world *w, long long i)
{
  const double stress = w->traction[2 * i];
  const jl_pool *pool = w->pools + w->law[i];
  const double *x = pool->stress, *y = pool->stiffness;
  long long low = 0, high = pool->points - 1;
  if (!(stress > 0.0) && !(w->shares[JLAW_DAMAGE * w->contacts + i] < 1.0)) return 0.0;
  if (stress <= x[0]) return y[0];
  if (stress >= x[high]) return y[high];
  while (high - low > 1) {
    const long long middle = (low + high) / 2;
    if (x[middle] <= stress) low = middle;
    else high = middle;
  }
  return y[low] + (y[high] - y[low]) / (x[high] - x[low]) * (stress - x[low]);
}

/* A force at the contact, on its block b, and the opposite on a; and a couple */
static void push(const jl_world *w, double *force, long long i, jl_vector f, double couple)
{
  double *a = force + 3 * w->a[i], *b = force + 3 * w->b[i];
  a[0] -= f.x;
  a[1] -= f.y;
  a[2] += couple - cross(minus(w->at[i], centre(w, w->a[i])), f);
  b[0] += f.x;
  b[1] += f.y;
  b[2] -= couple - cross(minus(w->at[i], centre(w, w->b[i])), f);
}

/* Forces on the blocks: joints, dashpots, weight and loads, and what drives add so that their blocks
 * have their velocities after dt. Counts the joints that are stiffer than the time step is good for. */
OUT void jl_blocks_forces(jl_world *w, double dt)
{
  const long long n = w->blocks, k = w->contacts;
  double *all = w->force, *damped = all + 3 * n, *driven = damped + 3 * n;
  for (long long i = 0; i < 6 * n; i++) w->last[i] = damped[i];
  for (long long i = 0; i < 9 * n; i++) all[i] = 0.0;
  w->stiffer = 0;
  for (long long i = 0; i < k; i++) {
    const double area = w->length[i] * w->thickness, stiffness = stiffness_of(w, i) * area;
    const double stored = w->shares[JLAW_STORED * k + i] * w->thickness; /* J/m of length */
    const double press = area * w->traction[2 * i], shear = area * w->traction[2 * i + 1];
    const double damage = w->shares[JLAW_DAMAGE * k + i];
    const jl_vector normal = w->normal[i], along = vector(normal.y, -normal.x);
    w->stiffer += stiffness > w->checked[i];
    const jl_vector f = minus(times(press, normal), times(shear, along));
    push(w, all, i, minus(f, times(stored, w->pull[i])), stored * w->twist[i]);
    /* 2 sqrt(stiffness times reduced mass), each block half of a joint; a pull where a bond holds */
    const double light = w->lightness[w->a[i]] + w->lightness[w->b[i]];
    if (!(light > 0.0)) continue;
    const double critical = 2.0 * sqrt(stiffness * (0.5 / light));
    double resist = -w->dashpot_normal * critical * w->opening[i];
    if (!(damage < 1.0)) resist = larger(resist, -press);
    const double stick =
        larger(1.0 - w->shares[JLAW_SEPARATED * k + i] - w->shares[JLAW_SLIPPING * k + i],
               1.0 - damage);
    const double drag = -w->dashpot_shear * critical * stick * w->sliding[i];
    push(w, damped, i, plus(times(resist, normal), times(drag, along)), 0.0);
  }
  for (long long i = 0; i < n; i++)
    for (int j = 0; j < 3; j++) {
      const long long at = 3 * i + j;
      if (!w->mobile[i]) all[at] = damped[at] = 0.0;
      else all[at] = (all[at] + damped[at]) + (w->gravity[at] + w->loads[at]);
    }
  for (long long i = 0; i < w->driven; i++) {
    const long long at = 3 * w->rows[i] + w->axes[i];
    const double lacking = w->aim[i] - w->motion[(3 + w->axes[i]) * n + w->rows[i]];
    driven[at] = w->inertia[at] * lacking / dt - all[at];
    all[at] += driven[at];
  }
}

/* Add a step to the energies: dem_demo/dynamics/energy.py says how */
static void book(jl_world *w, double dt)
{
  const long long n = w->blocks, k = w->contacts;
  enum { KINETIC, POTENTIAL, STORED, FRICTION, DASHPOTS, DROPPED, WORK, TURNED };
  double *e = w->energy, kinetic = 0.0, power[2] = {0.0, 0.0}, fallen = 0.0, pushed = 0.0,
         turned_over = 0.0, stored = 0.0, friction = 0.0;
  for (long long i = 0; i < n; i++) {
    double fall = 0.0, load = 0.0;
    if (!w->mobile[i]) continue;
    for (int j = 0; j < 3; j++) {
      const long long at = 3 * i + j;
      const double v = w->motion[(3 + j) * n + i];
      kinetic += v * (w->inertia[at] * v + dt * w->force[at]);
      fall += w->gravity[at] * v;
      load += w->loads[at] * v;
      for (int p = 0; p < 2; p++)
        power[p] += (w->last[3 * p * n + at] + w->force[3 * (p + 1) * n + at]) * v;
    }
    fallen += dt * fall;
    pushed += dt * load;
    turned_over += fabs(dt * fall) + fabs(dt * load);
  }
  for (long long i = 0; i < k; i++) {
    /* a joint loses its traction at the end of the step, which acts on the area of then */
    const double area = w->area[i] = w->length[i] * w->thickness;
    const double lost = w->shares[JLAW_DISSIPATED * k + i];
    stored += area * w->shares[JLAW_STORED * k + i];
    friction += area * (lost - w->lost[i]);
    w->lost[i] = lost;
  }
  e[KINETIC] = 0.5 * kinetic;
  e[POTENTIAL] -= fallen;
  e[STORED] = stored;
  e[FRICTION] += friction;
  e[DASHPOTS] -= 0.5 * dt * power[0];
  e[WORK] += 0.5 * dt * power[1] + pushed;
  e[TURNED] += turned_over + fabs(0.5 * dt * power[1]);
}

/* Forces from what the law says, energies, and the velocities to go on with */
OUT void jl_blocks_after(jl_world *w, double dt)
{
  const long long n = w->blocks;
  jl_blocks_read(w);
  jl_blocks_forces(w, dt);
  book(w, dt);
  for (long long i = 0; i < w->contacts; i++) /* where a corner has opened it touches anew next */
    if (w->closure[i] <= 0.0 && w->offset[i] > 0.0) w->offset[i] = 0.0;
  for (long long i = 0; i < n; i++)
    for (int j = 0; j < 3 && w->mobile[i]; j++)
      w->velocity[j * n + i] += dt * w->force[3 * i + j] / w->inertia[3 * i + j];
}
