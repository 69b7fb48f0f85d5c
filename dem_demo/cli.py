"""Command line: run a scene, check a scene file, resume a saved state, study a scene."""

import argparse
import sys
import time
from contextlib import suppress
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from jointlaw import JointLaw, PathError, direct_shear
from jointlaw.support.files import write_json
from jointlaw.support.pyplot import FORMATS

from .dynamics.simulation import Simulation
from .output.folder import ABLATION, STRENGTH, require_free
from .output.monitors import friction_angle
from .output.record import named, sentence, sentences, told
from .output.run import run, steps_to
from .scene import TEMPLATE, SceneError, load, shipped
from .studies import ablate, compare, strength

VERSION = 3  # of strength.json
FAILING = 3.0  # s: most that a failing rock is run for
TRIED, PATIENCE = 100, 1.0  # steps, and s, by which the time of a run is estimated
MOBILISED = 0.9  # share of friction that a bond should wait for
INTERRUPTED = 130  # exit code after Ctrl-C, as shells have it

ABOUT = """\
Rigid rock blocks in 2-D whose every contact force comes from a joint law.

  python -m dem_demo [SCENE] --out DIR     run a scene: a name or a TOML file
  python -m dem_demo new FILE              write a commented scene of a jointed rock to start from
  python -m dem_demo check FILE            read a scene, find its equilibrium and time step
  python -m dem_demo ablate SCENE --out DIR
                                           run it without each of its ingredients in turn
  python -m dem_demo compare SCENE [--seeds 1 2 3] [--until T]
                                           every rock of a scene alone, with its own laws and with
                                           Coulomb of the same strength, until a block has moved by
                                           the usual size of a block
  python -m dem_demo strength-reduction SCENE --out DIR
                                           factor of safety of each rock (the strength of all
                                           joints divided by it), its critical tilt, and how it
                                           fails with 2 % less strength
  python -m dem_demo resume DIR --out NEW [--until T] [--step DT]
                                           go on from DIR, where a run left its state
"""
OPTIONS = {
    "scene": {"nargs": "?", "default": "tilt", "help": "a name or a TOML file (default tilt)"},
    "file": {"type": Path},
    "state": {"type": Path, "help": "folder of a run, or the state in it"},
    "--out": {"type": Path, "default": Path("out"), "help": "folder for the results"},
    "--force": {"action": "store_true", "help": "replace another run in that folder"},
    "--until": {"type": float, "help": "model time to stop at (s)"},
    "--step": {"type": float, "help": "another time step (s)"},
    "--no-pictures": {
        "action": "store_const",
        "const": None,
        "dest": "format",
        "default": FORMATS[0],
        "help": "tables only",
    },
    "--format": {"choices": FORMATS, "default": FORMATS[0], "help": "of pictures (default png)"},
    "--vtk": {"action": "store_true", "help": "also VTK files for ParaView, in DIR/vtk (meshio)"},
    "--seeds": {"type": int, "nargs": "+", "default": [1, 2, 3], "help": "default 1 2 3"},
}


def main(arguments: list[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    verb = words.pop(0) if words and words[0] in COMMANDS else "run"
    command, *options = COMMANDS[verb]
    parser = argparse.ArgumentParser(
        f"python -m dem_demo {verb}".removesuffix(" run"),
        description=ABOUT,
        epilog=f"scenes: {', '.join(shipped())}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    for option in options:
        parser.add_argument(option, **OPTIONS[option])
    try:
        given = parser.parse_args(words)
        if getattr(given, "force", None) is False:
            require_free(given.out)
        command(given)
    except KeyboardInterrupt as stop:
        print(f"dem_demo: {str(stop) or 'interrupted'}", file=sys.stderr)
        return INTERRUPTED
    except (SceneError, PathError, ValueError, OSError) as error:
        print(f"dem_demo: {error}", file=sys.stderr)
        return 2
    return 0


def _run(given: argparse.Namespace) -> None:
    """Run a scene, or a saved state, to its end."""
    if given.vtk and not find_spec("meshio"):
        raise ValueError("--vtk needs meshio: pip install meshio")
    sim = (Simulation.load(given.state, given.step) if "state" in given
           else Simulation(load(given.scene)))  # fmt: skip
    _announce(sim, given.until)
    dt = sim.dt
    record, summary = run(sim, given.out, given.until, given.format, given.vtk)
    if begun := summary["stages_begun_s"]:
        said = ("not yet" if time is None else f"from {time:.3g} s" for time in begun)
        print(f"stages of the excavation: {', '.join(said)}")
    for line in sentences(record):
        print(line)
    if sim.dt < dt:
        print(f"the time step was halved to {sim.dt:.3g} s as joints closed or blocks fell")
    print(
        f"energy balanced to {summary['largest_energy_error']:.1e}, smallest margin of the time "
        f"step {summary['time_step_margin']:.2f}; results in {given.out}"
    )


def _announce(sim: Simulation, until: float | None = None) -> None:
    steps, dt, limit = steps_to(sim, until), sim.dt, sim.limit.current
    print(
        f"{sim.scene.title}: {sum(not block.fixed for block in sim.scene.blocks)} moving blocks, "
        f"{sim.joints.n} law points in reach"
    )
    why = (
        f"; fraction {dt / limit:.2g}, because {sim.fraction_reason}" if sim.fraction_reason else ""
    )
    print(
        f"time step {dt:.3g} s, limit {limit:.3g} s (margin {limit / dt:.2f}{why}), {steps} steps"
    )
    if seconds := _pace(sim) * steps:
        size = (seconds >= 100) + (seconds >= 6000)
        print(f"about {seconds / 60**size:.2g} {('s', 'min', 'hours')[size]} without pictures, "
              "by its first steps")  # fmt: skip
    for rock in sim.scene.rocks:
        print(f"rock {rock.name!r}: {len(rock.free)} blocks that can move, "
              f"{len(rock.blocks) - len(rock.free)} fixed", *rock.messages, sep="\n  ")  # fmt: skip
    if sim.unstable.any() and sim.scene.run.settle and not sim.time:
        print(f"{sim.unstable.sum()} blocks cannot be held and move from the first step: "
              f"{told(named(sim.scene, sim.unstable))}")  # fmt: skip


def _pace(sim: Simulation) -> float:
    """Time (s) of a step, by the first ones of a copy; 0 where these are refused."""
    copy, steps, started = Simulation(sim.scene, saved=sim.state()), 0, time.perf_counter()
    with suppress(SceneError):
        while steps < TRIED and time.perf_counter() < started + PATIENCE:
            copy.step()
            steps += 1
        return (time.perf_counter() - started) / steps
    return 0.0


def _new(given: argparse.Namespace) -> None:
    with given.file.open("xb") as file:  # OSError where it exists
        file.write(TEMPLATE.read_bytes())
    print(f"{given.file} written; next: python -m dem_demo check {given.file}")


def _check(given: argparse.Namespace) -> None:
    sim = Simulation(load(given.scene))
    _announce(sim)
    for (name, law), rows in zip(sim.scene.laws.items(), sim.joints.rows_by_law, strict=True):
        pressed = sim.joints.traction[rows, 0].max(initial=0.0)
        if isinstance(law, JointLaw):
            _warn_of_range(name, law, float(pressed))
            if law.bond and law.bond.cohesion and pressed > 0.0:
                _warn_of_bond(name, law, float(pressed))
    print("the scene is valid")


def _warn_of_range(name: str, law: JointLaw, largest: float) -> None:
    """Say what to write where a law has its cells for far more than this normal stress (Pa)."""
    made = float(law.normal_stress(law.closure_range * law.resolution.lowest))
    if law.tables.asperities.cells > 1 and 0.0 < largest < 0.1 * made:
        print(
            f"law {name!r}: its joints bear {largest:.2g} Pa at most, but its depth cells are for "
            f"{made:.2g} Pa, so that tractions err by up to 20 % (docs/accuracy.md). In "
            f"[laws.{name}] write closure_range = {law.closure(2.0 * largest):.2g}, in m, the "
            "closure at twice that stress; or save sliders by depth = 1 in its resolution"
        )


def _warn_of_bond(name: str, law: JointLaw, stress: float) -> None:
    """Say where a bond breaks before the asperities have slid as far as their friction needs."""
    bare, slip = replace(law, bond=None), law.bond.cohesion / law.bond.shear_stiffness
    borne = direct_shear(bare.joint(), to=[slip], normal=stress, steps=20).shear_stress[-1]
    share = borne / (stress * np.tan(np.radians(friction_angle(bare, stress))))
    if share < MOBILISED:
        print(
            f"law {name!r}: its bond breaks after {slip:.2g} m of shear, where the asperities bear "
            f"{share:.0%} of their friction at {stress:.2g} Pa: the two strengths do not add up. "
            'For cohesion that friction adds to, take kind = "coulomb" with cohesion and tension'
        )


def _ablate(given: argparse.Namespace) -> None:
    given.out.mkdir(parents=True, exist_ok=True)  # a folder that cannot be is known before the work
    print(ablate.write(ablate.ablate(load(given.scene), given.until), given.out))
    print(f"results in {given.out}: {ABLATION}")


def _compare(given: argparse.Namespace) -> None:
    scene = load(given.scene)
    if not scene.rocks:
        raise ValueError(f"{given.scene} has no [[rock]] to compare")
    for row in compare.compare(scene, given.seeds, given.until):
        for name, law in row["laws"].items():
            peak, left = np.degrees(np.arctan([law.friction, law.residual_friction or 0.0]))
            print(f"law {name!r} as Coulomb: {peak:.1f} degrees at the peak, {left:.1f} after "
                  f"{1e3 * law.weakening:.2g} mm")  # fmt: skip
        print(f"seed {row['seed']}, {row['law']:7s} after {row['time_s']:.3g} s, "
              f"{sentence(row)} {row['refused']}", flush=True)  # fmt: skip


def _reduce(given: argparse.Namespace) -> None:
    scene, rows = load(given.scene), []
    if any(isinstance(law, JointLaw) and law.slope_wear < np.inf for law in scene.laws.values()):
        print("slope_wear has no effect on these numbers: they are too high")
    given.out.mkdir(parents=True, exist_ok=True)
    if given.force:
        (given.out / strength.FILE).unlink(missing_ok=True)
    until = min(scene.run.end, FAILING) if given.until is None else given.until
    texts = {
        "factor_of_safety": "factor of safety",
        "factor_without": "factor of safety without those",
        "critical_tilt": "critical tilt in degrees",
    }
    tell = partial(print, flush=True)
    try:
        for row in strength.strength_reduction(scene, until, given.out, given.format, tell):
            said = (
                f"no {text}" if row[key] is None else f"{text} {row[key]:.3g}"
                for key, text in texts.items()
                if key in row
            )
            print(f"{row['rock']}: {', '.join(said)}", flush=True)
            rows.append(row)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            f"interrupted; {given.out / strength.FILE} has all finished trials: the same command "
            "goes on"
        ) from None
    write_json(given.out / STRENGTH, {"version": VERSION, "rows": rows})
    print(f"{STRENGTH} and pictures of the failure in {given.out}")


RUN = "--out", "--force", "--until", "--no-pictures", "--format", "--vtk"
COMMANDS = {
    "run": (_run, "scene", *RUN),
    "resume": (_run, "state", *RUN, "--step"),
    "new": (_new, "file"),
    "check": (_check, "scene"),
    "ablate": (_ablate, "scene", "--out", "--force", "--until"),
    "compare": (_compare, "scene", "--seeds", "--until"),
    "strength-reduction": (_reduce, "scene", "--out", "--force", "--until", "--format"),
}
