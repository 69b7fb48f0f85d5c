"""Pictures of what the input scripts wrote: python pictures.py [FOLDER]; needs matplotlib.

tower.png from log.tower (lmp -in in.tower -log log.tower) and tower.dump, shear.png from
shear.txt, slope.png from slope.dump, spheres.png from spheres.dump; what is missing is left out.
The direct shear test of jointlaw is drawn beside that of LAMMPS where jointlaw is installed.
"""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.ticker import EngFormatter

METRES = EngFormatter("m")  # um, mm or m, whatever the law needs


def dump(path):
    """Column names, steps, and the rows of every frame: (frames, atoms, columns)."""
    names, steps, frames = [], [], []
    for frame in Path(path).read_text().split("ITEM: TIMESTEP\n")[1:]:
        head, body = frame.split("ITEM: ATOMS ")
        first, body = body.split("\n", 1)
        names = first.split()
        steps.append(int(head.split("\n", 1)[0]))
        frames.append(np.array(body.split(), float).reshape(-1, len(names)))
    return names, steps, np.array(frames)


def thermo(path):
    """The last table of a log: a column by name."""
    names, rows, last = [], [], {}
    for line in Path(path).read_text().splitlines():
        words = line.split()
        if words[:1] == ["Step"]:
            names, rows = words, []
        elif words[:3] == ["Loop", "time", "of"]:
            last = dict(zip(names, np.array(rows).T, strict=True))
        elif words and len(words) == len(names) and words[0].isdigit():
            rows.append([float(word) for word in words])
    return last


def tower(folder):
    """The slabs before and after, their slip, and where the energy went."""
    table = thermo(folder / "log.tower")
    if not table:
        print(f"{folder / 'log.tower'} holds no finished run: no tower.png")
        return None
    _, _, frames = dump(folder / "tower.dump")
    fig, (left, middle, right) = plt.subplots(1, 3, figsize=(13, 4), layout="constrained")
    start = frames[0, :, 2:]
    moved = frames[-1, :, 2:] - start
    magnified = 0.05 / max(np.abs(moved - moved[frames[0, :, 1] == 1].mean(axis=0)).max(), 1e-12)
    magnified = 10.0 ** np.floor(np.log10(magnified))
    front = start[:, 1] < start[:, 1].min() + 0.01
    colours = frames[0, :, 1]
    left.scatter(*start[front][:, [0, 2]].T, s=60, c="0.85", marker="s")
    shown = (start + magnified * moved)[front]
    left.scatter(shown[:, 0], shown[:, 2], s=40, c=colours[front], cmap="viridis", marker="s")
    left.set(title=f"at the end, displacement x {magnified:g}", xlabel="x (m)", ylabel="z (m)")
    left.set_aspect("equal")
    middle.plot(table["v_t"], table["v_top"], label="slip of the top slab")
    middle.plot(table["v_t"], table["v_rise"] - table["v_rise"][0], label="its rise")
    middle.plot(table["v_t"], table["v_bx"], ":", c="0.5", label="motion of the base")
    middle.set(xlabel="time (s)", ylabel="displacement", title="against the base")
    middle.yaxis.set_major_formatter(METRES)
    middle.legend()
    parts = {
        "friction": table["c_joint[2]"],
        "damping": table["c_joint[3]"],
        "stored": table["PotEng"],
        "motion": table["c_ke"] + table["c_spin"],
    }
    right.stackplot(table["v_t"], [part - part[0] for part in parts.values()], labels=parts)
    right.plot(table["v_t"], table["v_work"] + table["v_fallen"], "k--", label="work done on it")
    right.set(xlabel="time (s)", ylabel="J", title="energy")
    right.legend()
    return fig


def shear(folder):
    """Shear stress and rise over slip, with the direct shear test of jointlaw."""
    slip, rise, normal, stress = np.loadtxt(folder / "shear.txt", skiprows=1).T
    fig, (top, bottom) = plt.subplots(2, 1, figsize=(6, 6), sharex=True, layout="constrained")
    top.plot(slip, stress / normal[0], lw=3, c="tab:orange", label="LAMMPS, 16 joints")
    bottom.plot(slip, rise, lw=3, c="tab:orange")
    try:
        import jointlaw as jl
    except ImportError:
        print("jointlaw is not installed here: shear.png shows LAMMPS alone")
    else:
        law = jl.JointLaw.from_toml(folder / "law.toml")
        test = jl.direct_shear(law.joint(), slip[-1], normal[0], steps=800)
        top.plot(test.shear, test.shear_stress / normal[0], "k", lw=1, label="jointlaw")
        bottom.plot(test.shear, test.closure[0] - test.closure, "k", lw=1)
        away = np.abs(stress - np.interp(slip, test.shear, test.shear_stress)).max()
        print(f"shear stress: {away / stress.max():.2e} of the largest between LAMMPS and jointlaw")
    top.set(ylabel="shear stress / normal stress")
    top.legend()
    bottom.set(xlabel="slip", ylabel="rise")
    for axis in (bottom.xaxis, bottom.yaxis):
        axis.set_major_formatter(METRES)
    return fig


def slope(folder):
    """The columns at the end, displacement in colour."""
    _, steps, frames = dump(folder / "slope.dump")
    start, last = frames[0], frames[-1]
    x, z = start[:, 2], start[:, 3]
    moved = last[:, 2:4] - start[:, 2:4]
    size = np.hypot(*moved.T)
    magnified = 10.0 ** np.floor(np.log10(1.5 / max(size.max(), 1e-12)))
    fig, axes = plt.subplots(figsize=(9, 6), layout="constrained")
    axes.scatter(x, z, s=12, c="0.85")
    shown = np.stack([x, z], axis=1) + magnified * moved
    points = axes.scatter(*shown.T, s=12, c=size, cmap="magma_r")
    fig.colorbar(points, label="displacement", format=METRES)
    axes.set(xlabel="down the dip: to the left (m)", ylabel="across the base (m)")
    axes.set_title(f"after {steps[-1]} steps, displacement x {magnified:g}; grey: before")
    axes.set_aspect("equal")
    return fig


def spheres(folder):
    """Closure, spin and forces of two spheres that part."""
    names, steps, frames = dump(folder / "spheres.dump")
    value = {name: frames[:, :, k] for k, name in enumerate(names)}
    closure = 0.02 - (value["x"][:, 1] - value["x"][:, 0])
    fig, axes = plt.subplots(3, 1, figsize=(6, 6), sharex=True, layout="constrained")
    axes[0].plot(steps, closure)
    axes[0].set(ylabel="closure")
    axes[0].yaxis.set_major_formatter(METRES)
    axes[1].plot(steps, value["omegaz"], label=["left sphere", "right sphere"])
    axes[1].set(ylabel="spin (rad/s)")
    axes[1].legend()
    axes[2].plot(steps, value["fx"][:, 1], label="normal")
    axes[2].plot(steps, value["fy"][:, 1], label="shear")
    axes[2].set(xlabel="step", ylabel="force (N)")
    axes[2].legend()
    return fig


def main():
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    needs = {tower: "log.tower", shear: "shear.txt", slope: "slope.dump", spheres: "spheres.dump"}
    for picture, file in needs.items():
        if (folder / file).exists():
            fig = picture(folder)
            if fig:
                fig.savefig(folder / f"{picture.__name__}.png", dpi=110)
                print(f"wrote {folder / picture.__name__}.png")


if __name__ == "__main__":
    main()
