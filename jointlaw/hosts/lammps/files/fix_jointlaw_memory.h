// fix jointlaw/memory: the history variables of all joints. pair_style jointlaw creates this fix.
//
// A pair style has no storage per contact, and a neighbour list is rebuilt every few steps, so the
// state of a joint is stored with an atom, its owner. Why a fix, and why of this form:
//
// - LAMMPS moves atoms between processes, sorts them in memory and writes them to restart files. A fix
//   takes part in all three by callbacks (Atom::GROW, Atom::RESTART; pack_exchange, copy_arrays,
//   pack_restart). The joints of an atom therefore always are on the process that owns the atom.
// - Each joint has one owner, so each state exists once. Ghost atoms carry no states, and no
//   communication of states is needed in a step; newton on returns the force on the partner.
// - The number of joints of an atom varies, and states are large (0.5 to 6 kB). One allocation per
//   atom grows with it and is kept when joints end; sorting swaps pointers instead of copying. It is
//   aligned to cache lines, because the pair style prefetches states of the next atom.
// - A partner is identified by its atom ID (or its molecule ID), which is valid on every process and
//   after a restart; an index of an atom is not. Commands that renumber atoms are detected, and so are
//   new atoms, which may have the ID of a deleted atom (`renumbered`).
// - LAMMPS allocates buffers for migration in advance. `maxexchange` must cover the atom with most
//   joints at any moment, since atoms also migrate between runs (`reserve_exchange`).
// - Integers are stored in the doubles of a state by their bits, since IDs may exceed 2^53.
// - A restart file also holds a hash of the laws: a state fits only the law that wrote it.
// MIT licence.
#ifndef JOINTLAW_MEMORY_H
#define JOINTLAW_MEMORY_H
#include "atom.h"
#include "comm.h"
#include "error.h"
#include "fix.h"
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <new>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

inline double from_integer(int64_t n) { double x; memcpy(&x, &n, sizeof x); return x; }
inline int64_t to_integer(double x) { int64_t n; memcpy(&n, &x, sizeof n); return n; }

// The joints of one atom: `size` doubles each, contiguous, from the start of a cache line
class AtomJoints {
 public:
  int n = 0;
  tagint tag = 0;    // ID of the atom in the last step

  AtomJoints() = default;
  AtomJoints(const AtomJoints &) = delete;
  AtomJoints(AtomJoints &&other) noexcept { swap(other); }
  ~AtomJoints() { free(data_); }
  void swap(AtomJoints &other)
  {
    std::swap(n, other.n);
    std::swap(tag, other.tag);
    std::swap(capacity, other.capacity);
    std::swap(data_, other.data_);
  }
  double *joint(int index, int size) const { return data_ + static_cast<size_t>(index) * size; }
  void resize(int joints, int size)    // new entries are zero
  {
    const size_t old_size = static_cast<size_t>(n) * size;
    const size_t new_size = static_cast<size_t>(joints) * size;
    if (new_size > capacity) {
      const size_t rounded = (new_size + 7) / 8 * 8;    // whole cache lines
      auto buffer = static_cast<double *>(aligned_alloc(64, rounded * sizeof(double)));
      if (!buffer) throw std::bad_alloc();
      if (old_size) memcpy(buffer, data_, old_size * sizeof(double));
      free(data_);
      data_ = buffer;
      capacity = rounded;
    }
    if (new_size > old_size) memset(data_ + old_size, 0, (new_size - old_size) * sizeof(double));
    n = joints;
  }
  void remove(int index, int size)    // the last joint moves to this index
  {
    if (--n > index) memcpy(joint(index, size), joint(n, size), size * sizeof(double));
  }
  size_t bytes() const { return capacity * sizeof(double); }

 private:
  size_t capacity = 0;
  double *data_ = nullptr;
};

class FixJointlawMemory : public Fix {
 public:
  std::vector<AtomJoints> of;
  int size = 0;    // doubles of one joint
  // Sums that outlive joints, on this process: energy dissipated by ended joints and by damping;
  // stored energy of joints deleted under load, minus energy of joints created closed; their number
  enum { ENDED_DISSIPATION, DAMPING_DISSIPATION, DELETED_ENERGY, DELETED_COUNT, SUMS };
  double sums[SUMS] = {0.0, 0.0, 0.0, 0.0};
  uint64_t laws = 0;    // hash of the laws of all pairs of types; 0: unknown
  std::function<void()> after_run;

  FixJointlawMemory(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg)
  {
    if (narg != 4) error->all(FLERR, "fix jointlaw/memory: pair_style jointlaw creates this fix itself");
    size = utils::inumeric(FLERR, arg[3], false, lmp);
    restart_global = restart_peratom = 1;
    create_attribute = 1;
    maxexchange_dynamic = 1;
    maxexchange = 2;
    stores_ids = 1;
    FixJointlawMemory::grow_arrays(atom->nmax);
    atom->add_callback(Atom::GROW);
    atom->add_callback(Atom::RESTART);
  }
  ~FixJointlawMemory() override
  {
    atom->delete_callback(id, Atom::GROW);
    atom->delete_callback(id, Atom::RESTART);
  }
  int setmask() override { return FixConst::POST_RUN; }
  void post_run() override { if (after_run) after_run(); }

  bigint joints() const    // on all processes
  {
    bigint mine = 0, all = 0;
    for (int i = 0; i < atom->nlocal; i++) mine += of[i].n;
    MPI_Allreduce(&mine, &all, 1, MPI_LMP_BIGINT, MPI_SUM, world);
    return all;
  }

  double deleted_under_load() const    // number of joints, on all processes
  {
    double all = 0.0;
    MPI_Allreduce(&sums[DELETED_COUNT], &all, 1, MPI_DOUBLE, MPI_SUM, world);
    return all;
  }

  // Atoms also migrate between runs, for example when write_restart starts
  void reserve_exchange(int joints) { maxexchange = std::max(maxexchange, 2 + joints * size); }

  // Whether an atom has another ID than at the last call. `appeared`: the IDs of atoms on all processes
  // that are new since then, if there are joints whose partners they might replace
  bool renumbered(std::vector<tagint> &appeared)
  {
    int mine[3] = {0, 0, 0}, any[3];    // other IDs, new atoms, joints
    std::vector<tagint> new_here;
    for (int i = 0; i < atom->nlocal; i++) {
      mine[0] = mine[0] || (of[i].tag && of[i].tag != atom->tag[i]);
      mine[2] = mine[2] || of[i].n;
      if (!of[i].tag) new_here.push_back(atom->tag[i]);
      of[i].tag = atom->tag[i];
    }
    mine[1] = !new_here.empty();
    MPI_Allreduce(mine, any, 3, MPI_INT, MPI_MAX, world);
    appeared.clear();
    if (any[1] && any[2]) gather(new_here, appeared);
    return any[0];
  }

  void grow_arrays(int nmax) override
  {
    if (static_cast<int>(of.size()) < nmax) of.resize(nmax);
  }
  void copy_arrays(int i, int j, int) override { of[j].swap(of[i]); }    // LAMMPS overwrites i next
  void set_arrays(int i) override
  {
    of[i].resize(0, size);
    of[i].tag = 0;
  }
  int pack_exchange(int i, double *buf) override
  {
    const size_t m = static_cast<size_t>(of[i].n) * size;
    buf[0] = of[i].n;
    buf[1] = of[i].tag;
    if (m) memcpy(buf + 2, of[i].joint(0, size), m * sizeof(double));
    return static_cast<int>(m) + 2;
  }
  int unpack_exchange(int i, double *buf) override
  {
    const int n = static_cast<int>(buf[0]);
    of[i].resize(0, size);
    of[i].resize(n, size);
    of[i].tag = static_cast<tagint>(buf[1]);
    if (n) memcpy(of[i].joint(0, size), buf + 2, static_cast<size_t>(n) * size * sizeof(double));
    reserve_exchange(n);
    return 2 + n * size;
  }
  int size_restart(int i) override { return 4 + of[i].n * size; }
  int maxsize_restart() override    // process 0 writes the file for all
  {
    int mine = 0, most = 0;
    for (int i = 0; i < atom->nlocal; i++) mine = std::max(mine, size_restart(i));
    MPI_Allreduce(&mine, &most, 1, MPI_INT, MPI_MAX, world);
    return most;
  }
  int pack_restart(int i, double *buf) override
  {
    buf[0] = size_restart(i);
    buf[1] = size;
    pack_exchange(i, buf + 2);
    return size_restart(i);
  }
  void unpack_restart(int nlocal, int nth) override
  {
    double *data = atom->extra[nlocal];
    for (int i = 0; i < nth; i++) data += static_cast<int>(data[0]);
    if (data[1] == size) unpack_exchange(nlocal, data + 2);
    else set_arrays(nlocal);    // of other laws: the pair style compares hashes and raises an error
  }
  void write_restart(FILE *file) override
  {
    double all[SUMS + 1];
    MPI_Reduce(sums, all, SUMS, MPI_DOUBLE, MPI_SUM, 0, world);
    all[SUMS] = from_integer(static_cast<int64_t>(laws));
    const int bytes = sizeof all;
    if (comm->me) return;
    fwrite(&bytes, sizeof bytes, 1, file);
    fwrite(all, 1, bytes, file);
  }
  void restart(char *data) override
  {
    double all[SUMS + 1];
    memcpy(all, data, sizeof all);
    if (comm->me == 0) std::copy(all, all + SUMS, sums);
    laws = static_cast<uint64_t>(to_integer(all[SUMS]));
  }
  double memory_usage() override
  {
    double bytes = of.size() * sizeof(AtomJoints);
    for (const auto &own : of) bytes += own.bytes();
    return bytes;
  }

 private:
  // Append the IDs of all processes to `all`
  void gather(const std::vector<tagint> &mine, std::vector<tagint> &all)
  {
    int n = static_cast<int>(mine.size());
    std::vector<int> counts(comm->nprocs), starts(comm->nprocs + 1, 0);
    MPI_Allgather(&n, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
    for (int p = 0; p < comm->nprocs; p++) starts[p + 1] = starts[p] + counts[p];
    all.resize(starts[comm->nprocs]);
    MPI_Allgatherv(mine.data(), n, MPI_LMP_TAGINT, all.data(), counts.data(), starts.data(),
                   MPI_LMP_TAGINT, world);
  }
};

}    // namespace LAMMPS_NS
#endif
