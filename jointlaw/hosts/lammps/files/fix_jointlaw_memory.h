// The memory of all joints, in the atoms that own them. pair_style jointlaw makes this fix.
// It goes with its atoms to other processors, through sorting and into restart files. MIT licence.
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

inline double from_whole(int64_t n) { double x; memcpy(&x, &n, sizeof x); return x; }
inline int64_t to_whole(double x) { int64_t n; memcpy(&n, &x, sizeof n); return n; }

// The joints of one atom: `size` numbers each, side by side from the beginning of a cache line
class OwnJoints {
 public:
  int n = 0;
  tagint tag = 0;    // of the atom, as last seen by the pair style

  OwnJoints() = default;
  OwnJoints(const OwnJoints &) = delete;
  OwnJoints(OwnJoints &&other) noexcept { swap(other); }
  ~OwnJoints() { free(numbers); }
  void swap(OwnJoints &other)
  {
    std::swap(n, other.n);
    std::swap(tag, other.tag);
    std::swap(room, other.room);
    std::swap(numbers, other.numbers);
  }
  double *at(int joint, int size) const { return numbers + static_cast<size_t>(joint) * size; }
  void resize(int joints, int size)    // new numbers are zero
  {
    const size_t old = static_cast<size_t>(n) * size, wanted = static_cast<size_t>(joints) * size;
    if (wanted > room) {
      const size_t more = (wanted + 7) / 8 * 8;
      auto moved = static_cast<double *>(aligned_alloc(64, more * sizeof(double)));
      if (!moved) throw std::bad_alloc();
      if (old) memcpy(moved, numbers, old * sizeof(double));
      free(numbers);
      numbers = moved;
      room = more;
    }
    if (wanted > old) memset(numbers + old, 0, (wanted - old) * sizeof(double));
    n = joints;
  }
  void drop(int joint, int size)    // the last joint takes its place
  {
    if (--n > joint) memcpy(at(joint, size), at(n, size), size * sizeof(double));
  }
  size_t bytes() const { return room * sizeof(double); }

 private:
  size_t room = 0;
  double *numbers = nullptr;
};

class FixJointlawMemory : public Fix {
 public:
  std::vector<OwnJoints> of;
  int size = 0;    // numbers of one joint
  // What no joint holds any more, on this processor: dissipated by joints that ended, by damping;
  // stored in joints that were given up (less what came with joints made closed); their number
  enum { ENDED, DAMPING, GIVEN_UP, COUNT, SUMS };
  double sums[SUMS] = {0.0, 0.0, 0.0, 0.0};
  uint64_t laws = 0;    // a sum over the laws of all pairs of types; 0: not known
  std::function<void()> after_run;

  FixJointlawMemory(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg)
  {
    if (narg != 4) error->all(FLERR, "fix jointlaw/memory: pair_style jointlaw makes it itself");
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

  bigint joints() const    // of all processors
  {
    bigint mine = 0, all = 0;
    for (int i = 0; i < atom->nlocal; i++) mine += of[i].n;
    MPI_Allreduce(&mine, &all, 1, MPI_LMP_BIGINT, MPI_SUM, world);
    return all;
  }

  double given_up() const    // how many, on all processors
  {
    double all = 0.0;
    MPI_Allreduce(&sums[COUNT], &all, 1, MPI_DOUBLE, MPI_SUM, world);
    return all;
  }

  // maxexchange must hold at any moment: atoms also move between runs, as write_restart begins
  void longest(int joints) { maxexchange = std::max(maxexchange, 2 + joints * size); }

  // Whether an atom has another ID than when it was last seen: partners are known by IDs
  bool renumbered()
  {
    int mine = 0, any = 0;
    for (int i = 0; i < atom->nlocal; i++) {
      mine = mine || (of[i].tag && of[i].tag != atom->tag[i]);
      of[i].tag = atom->tag[i];
    }
    MPI_Allreduce(&mine, &any, 1, MPI_INT, MPI_MAX, world);
    return any;
  }

  void grow_arrays(int nmax) override
  {
    if (static_cast<int>(of.size()) < nmax) of.resize(nmax);
  }
  void copy_arrays(int i, int j, int) override { of[j].swap(of[i]); }    // i is overwritten next
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
    if (m) memcpy(buf + 2, of[i].at(0, size), m * sizeof(double));
    return static_cast<int>(m) + 2;
  }
  int unpack_exchange(int i, double *buf) override
  {
    const int n = static_cast<int>(buf[0]);
    of[i].resize(0, size);
    of[i].resize(n, size);
    of[i].tag = static_cast<tagint>(buf[1]);
    if (n) memcpy(of[i].at(0, size), buf + 2, static_cast<size_t>(n) * size * sizeof(double));
    longest(n);
    return 2 + n * size;
  }
  int size_restart(int i) override { return 4 + of[i].n * size; }
  int maxsize_restart() override    // the first processor writes it for all
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
    else set_arrays(nlocal);    // of other laws: the pair style compares their sums and refuses
  }
  void write_restart(FILE *file) override
  {
    double all[SUMS + 1];
    MPI_Reduce(sums, all, SUMS, MPI_DOUBLE, MPI_SUM, 0, world);
    all[SUMS] = from_whole(static_cast<int64_t>(laws));
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
    laws = static_cast<uint64_t>(to_whole(all[SUMS]));
  }
  double memory_usage() override
  {
    double bytes = of.size() * sizeof(OwnJoints);
    for (const auto &own : of) bytes += own.bytes();
    return bytes;
  }
};

}    // namespace LAMMPS_NS
#endif
