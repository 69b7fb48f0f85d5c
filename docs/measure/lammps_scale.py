"""pair_style jointlaw with 1e5 and 1e6 spheres: time, memory, restart on one and two processes.

    python docs/measure/lammps_scale.py FOLDER [--small]

--small: 22 000 spheres alone, for a trial.

The packing of lammps.py, settled with the law, repeated, in a periodic box that is sheared at a
rate of 50 1/s. Times are those of the pair style by LAMMPS' own count; with two processes they mean
something only while no other work is done. The last row is computed from the row before it: 1e8
contacts on 1024 processes. What a process sends in a step are position, velocity and spin of its
ghost atoms, and their force and torque back: 15 numbers each. Needs 12 GB of memory and 4 GB of
disk; ten minutes.
"""

import re

import lammps
from tables import asked, folder, table

STEPS = 20  # settled, then timed; half of it after a restart
FLOW = """
fix 1 all nve/sphere
fix v all viscous 0.02
fix flow all deform 1 xy erate 50 remap v
compute each all contact/atom
compute count all reduce sum c_each
compute joint all pair jointlaw
thermo_style custom step c_count c_joint[1] pe c_joint[2] press
thermo_modify format float %.15g norm no
timestep 2e-7
"""
STYLE = """plugin load ./jointlawplugin.so
pair_style jointlaw opening 5e-4
pair_coeff * * rock.jlaw
neighbor 0.0005 bin
"""
HEAD = "units si\natom_style sphere\nboundary p p p\ncomm_modify vel yes\nnewton on\n"
SETTLE = (
    HEAD
    + "read_data pack.data\n"
    + STYLE.replace("5e-4\n", "5e-4 damping 0.5\n")
    + """
change_box all x scale 1.03 y scale 1.03 z scale 1.03 remap
timestep 1e-6
fix 1 all nve/limit 1e-5
fix v all viscous 1.0
run 500
velocity all set 0 0 0
write_data settled.data nocoeff
"""
)
BEGIN = HEAD + "read_data settled.data\nreplicate {}\nchange_box all triclinic\n" + STYLE + FLOW
BEGIN += f"run {STEPS}\nrun {STEPS}\ninfo out log memory\n"
SAVE = f"write_restart saved\nrun {STEPS // 2}\n"
GO_ON = HEAD + "read_restart saved\n" + STYLE + FLOW + f"run {STEPS // 2}\n"
HEADS = ["spheres", "processes", "contacts", "pair style, ns per contact and step",
         "whole step, ms", "MB a process", "bytes per contact", "sent a step, MB a process",
         "restart file, MB", "after restart on 1 and 2"]  # fmt: skip


def last_row(log):
    """Numbers of the last line of thermo output."""
    rows = re.findall(r"^ +Step .*\n((?: +\d.*\n)+)", log, re.M)
    return [float(word) for word in rows[-1].splitlines()[-1].split()]


def measure(where, repeat, processes):
    """A row of the table, and what the computed row needs of it."""
    text = BEGIN.format(repeat) + (SAVE if processes == 2 else "")
    log = lammps.lammps(where, text, processes)
    timed = "Loop time of" + log.split("Loop time of")[2]
    pair, loop = lammps.times(timed, processes)
    contacts = last_row(log)[2]
    spheres = lammps.number(r"^ +(\d+) atoms$", log)
    memory = lammps.number(r"resident set size: +(\S+)", log)
    ghosts = lammps.number(r"^Nghost: +(\S+)", timed)
    row = [spheres, processes, contacts, 1e9 * processes * pair / STEPS / contacts,
           1e3 * loop / STEPS, memory, 1e6 * processes * memory / contacts,
           ghosts * 15 * 8 / 1e6]  # fmt: skip
    if processes == 1:
        return [*row, "", ""]
    size, apart = (where / "saved").stat().st_size / 1e6, []
    for again in (1, 2):
        other = last_row(lammps.lammps(where, GO_ON, again))
        apart += [max(abs(a / b - 1) for a, b in zip(other[1:], last_row(log)[1:], strict=True))]
    (where / "saved").unlink()
    return [*row, size, ", ".join(f"{difference:.0e}" for difference in apart)]


def computed(row, contacts=1e8, processes=1024):
    """The same for more contacts on a cluster, if each of its cores is as fast as one here."""
    share = contacts / processes / (row[2] / row[1])  # of a process, over that measured
    sent = row[7] * share ** (2 / 3)
    return [row[0] * contacts / row[2], processes, contacts, row[3], row[4] * share,
            row[5] * share, row[6], sent, row[8] * contacts / row[2], "computed"]  # fmt: skip


def told(cell):
    """A number with as many digits as it is worth."""
    if isinstance(cell, str):
        return cell
    return f"{cell:.0f}" if cell >= 100 else f"{cell:.2g}"


def main():
    options = asked(__doc__, folder=folder, small=False)
    lammps.prepare(options.folder)
    lammps.lammps(options.folder, SETTLE)
    rows = []
    for repeat in ["2 2 2"] if options.small else ["3 3 4", "7 7 8"]:
        rows += [measure(options.folder, repeat, processes) for processes in (1, 2)]
    rows.append(computed(rows[-1]))
    print(table(HEADS, [[told(cell) for cell in row] for row in rows]))


if __name__ == "__main__":
    main()
