"""Command line: run a scene, check a scene file, resume a saved state."""

import argparse
import sys
from importlib.util import find_spec
from pathlib import Path

import jointlaw as jl
from jointlaw.support.files import replace_file, require_free, write_json
from jointlaw.support.progress import explained
from jointlaw.support.pyplot import FORMATS

from .dynamics.simulation import Simulation
from .errors import Refused, SceneError
from .output.interrupt import STATUS
from .output.outcome import sentence
from .output.run import run, steps_to
from .scene import TEMPLATE, Scene, load, names
from .studies import ablate, compare, strength

DEFAULT = "tilt"
VERSION = 1  # of the files that compare and strength-reduction write
FAILING = 3.0  # s: most that a failing rock is run for
MANY = 1e6  # steps: minutes for a few blocks, hours for a rock
# Times on one core of a common computer, in s: of the initial equilibrium per moving block to the
# power 1.5 (blocks of two joint sets), of a step, and of a step per law point
SEATING, STEP, STEP_PER_POINT = 1.9e-3, 6e-4, 2.5e-6
LONG = 2.0  # s: waits that are told before
EQUILIBRIA, VARIANTS = 10, 20  # of a bisection; runs of an ablation
WAIT = "the first run after an installation also compiles the law, once"

ABOUT = """\
Rigid rock blocks in 2-D whose every contact force comes from a joint law.

  python -m dem_demo [SCENE] --out DIR     run a scene: a name or a TOML file
  python -m dem_demo new FILE              write a commented scene of a jointed rock to start from
  python -m dem_demo ablate SCENE --out DIR
                                           run it without each of its ingredients in turn
  python -m dem_demo check FILE            check a scene file without running it
  python -m dem_demo compare SCENE [--seeds 1 2 3] [--until T]
                                           every rock of a scene alone, with plain Coulomb as well
  python -m dem_demo strength-reduction SCENE --out DIR
                                           how much weaker its joints may be, and the critical tilt
  python -m dem_demo resume STATE --out DIR [--until T] [--step DT]
                                           go on from DIR/state or DIR/refused
"""
OPTIONS = {  # the first word is what a user types
    "scene": {"help": "a name or a TOML file"},
    "scene or default": {"nargs": "?", "default": DEFAULT, "help": f"default {DEFAULT}"},
    "file": {"type": Path},
    "state": {"type": Path, "help": "folder that a run left: DIR/state, DIR/refused"},
    "--out": {"type": Path, "default": Path("out"), "help": "folder for the results"},
    "--force": {"action": "store_true", "help": "replace another run in that folder"},
    "--out of numbers": {"type": Path, "help": "a JSON file for the numbers"},
    "--until": {"type": float, "help": "model time to stop at (s)"},
    "--leave-out": {"nargs": "+", "default": [], "metavar": "NAME",
                    "help": "variants not to run, as \"resolution reference\""},
    "--step": {"type": float, "help": "another time step (s)"},
    "--no-pictures": {"action": "store_true", "help": "tables only"},
    "--format": {"choices": FORMATS, "default": FORMATS[0], "help": "of pictures (default png)"},
    "--vtk": {"action": "store_true", "help": "also VTK files for ParaView, in DIR/vtk (meshio)"},
    "--seeds": {"type": int, "nargs": "+", "default": [1, 2, 3], "help": "default 1 2 3"},
    "--critical": {
        "action": "store_true", "help": "find the tilt that the rock just bears; run nothing",
    },
    "--tilt": {"type": float, "default": 0.0, "help": "degrees: turn gravity towards +x"},
}  # fmt: skip
Words = list[str]


def main(arguments: Words | None = None) -> int:
    """Entry point; returns the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    verb = words.pop(0) if words and words[0] and words[0] in COMMANDS else ""
    command, *about = COMMANDS[verb]
    try:
        given = _parse(words, verb, *about)
        if getattr(given, "force", None) is False:
            require_free(given.out)
        with explained(f"dem_demo is at work; {WAIT}"):
            command(given)
    except KeyboardInterrupt as stop:
        print(f"dem_demo: {str(stop) or 'interrupted; nothing is written'}", file=sys.stderr)
        return STATUS
    except (SceneError, Refused, jl.PathError, ValueError, OSError) as error:
        print(f"dem_demo: {error}", file=sys.stderr)
        return 2
    return 0


def _parse(words: Words, verb: str, about: str, example: str, *options: str) -> argparse.Namespace:
    """The words of a command, which knows these of OPTIONS."""
    has_scene = any(option.startswith("scene") for option in options)
    known = f"scenes: {', '.join(names())}\n" if has_scene else ""
    parser = argparse.ArgumentParser(
        f"python -m dem_demo {verb}".rstrip(),
        description=about,
        epilog=f"{known}example: python -m dem_demo {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    for option in options:
        parser.add_argument(option.split()[0], **OPTIONS[option])
    return parser.parse_args(words)


def _run(given: argparse.Namespace) -> None:
    _go(_seated(given.scene), given)


def _resume(given: argparse.Namespace) -> None:
    _go(Simulation.load(given.state, given.step), given)


def _ablate(given: argparse.Namespace) -> None:
    given.out.mkdir(parents=True, exist_ok=True)  # a folder that cannot be is known before the work
    seconds = _seconds(_seated(given.scene), given.until)
    print(f"about {VARIANTS} runs, each of about {_duration(seconds)}", flush=True)
    rows = ablate.ablate(load(given.scene), given.until, given.leave_out)
    ablate.write(rows, given.out)
    print(ablate.table(rows))
    print(f"results in {given.out}: ablation.csv, ablation.md, summary.json")


def _new(given: argparse.Namespace) -> None:
    if given.file.exists():
        raise ValueError(f"{given.file} exists: give another name")
    replace_file(given.file, TEMPLATE.read_bytes())
    print(f"{given.file} written; next: python -m dem_demo check {given.file}")


def _check(given: argparse.Namespace) -> None:
    _announce(_seated(given.scene))
    print("the scene is valid")


def _compare(given: argparse.Namespace) -> None:
    scene = load(given.scene)
    if not scene.rocks:
        raise ValueError(f"{given.scene} has no [[rock]] to compare")
    if given.critical and (given.until is not None or given.tilt):
        raise ValueError("--critical runs no scene: leave out --until and --tilt")
    if given.out:
        given.out.parent.mkdir(parents=True, exist_ok=True)
    cases = 2 * len(given.seeds) * len(scene.rocks)
    if given.critical:
        print(f"{cases} cases, each of about {EQUILIBRIA} equilibria", flush=True)
    else:
        seconds = _seconds(_seated(given.scene), given.until) / len(scene.rocks)
        print(f"{cases} runs, each of at most about {_duration(seconds)}", flush=True)
    rows = list(_compared(scene, given))
    if given.out:
        write_json(given.out, {"version": VERSION, "rows": rows})


def _compared(scene: Scene, given: argparse.Namespace):
    """Rows of a comparison, each told when it is known."""
    what = scene, given.seeds
    if given.critical:
        for row in compare.critical_tilts(*what):
            angle = row["critical_tilt"]
            told = "beyond 60 degrees" if angle is None else f"{angle:+.1f} degrees"
            print(f"seed {row['seed']}, {row['law']:7s}  {row['rock']}: {told}", flush=True)
            yield row
        return
    end = scene.run.end if given.until is None else given.until
    for row in compare.compare(*what, end, given.tilt):
        print(f"seed {row['seed']}, {row['law']:7s} {row['time_s']:6.2f} s  {sentence(row)}"
              f", energy balanced to {row['largest_energy_error']:.1e}", flush=True)  # fmt: skip
        if row["refused"]:
            print(f"    stopped: {row['refused']}")
        yield row


def _seated(name: str) -> Simulation:
    """A scene at step 0; what of it is likely a slip, and long waits, are told before."""
    scene = load(name)
    for doubt in scene.doubts:
        print(f"warning: {doubt}", file=sys.stderr)
    free = sum(not block.fixed for block in scene.blocks)
    wait = SEATING * free**1.5
    if scene.run.seat and wait > LONG:
        print(f"{free} moving blocks: the initial equilibrium takes about {wait:.0f} s", flush=True)
    return Simulation(scene)


def _seconds(sim: Simulation, until: float | None) -> float:
    """Time (s) that a run takes, without its pictures."""
    return steps_to(sim, until) * (STEP + STEP_PER_POINT * sim.joints.n)


def _duration(seconds: float) -> str:
    """A time to wait, on a core of its own."""
    if seconds < 100:
        return f"{seconds:.2g} s"
    return f"{seconds / 60:.2g} min" if seconds < 6000 else f"{seconds / 3600:.2g} h"


def _reduce(given: argparse.Namespace) -> None:
    scene = load(given.scene)
    given.out.mkdir(parents=True, exist_ok=True)
    until = min(scene.run.end, FAILING) if given.until is None else given.until
    print(
        "factor F: with the friction of all asperities divided by F the joints just carry the rock"
    )
    print("critical tilt: gravity may turn by so much, towards +x, until they no longer do")
    free = [len(rock.free) for rock in scene.rocks] or [sum(not b.fixed for b in scene.blocks)]
    wait = EQUILIBRIA * 2 * SEATING * sum(n**1.5 for n in free)
    print(f"about {_duration(wait)}, and for each picture a run of up to {until:g} s", flush=True)
    rows = []
    for row in strength.strength_reduction(scene, until, given.out, given.format):
        factor, tilt = row["factor"], row["critical_tilt"]
        told = "no F between 1/64 and 64" if factor is None else f"F = {factor:.3g}"
        angle = "beyond 60 degrees" if tilt is None else f"{tilt:+.3g} degrees"
        print(f"{row['rock']}: {told}, critical tilt {angle}", flush=True)
        rows.append(row)
    write_json(given.out / "strength.json", {"version": VERSION, "rows": rows})
    print(f"strength.json and pictures of the failure in {given.out}")


def _announce(sim: Simulation, until: float | None = None) -> None:
    steps, dt, limit = steps_to(sim, until), sim.now.dt, sim.now.limit.now
    free = sum(1 for block in sim.scene.blocks if not block.fixed)
    print(f"{sim.scene.title}: {free} moving blocks, {sim.joints.n} law points in reach")
    print(f"time step {dt:.3g} s, limit {limit:.3g} s (margin {limit / dt:.2f}), {steps} steps")
    if steps > MANY:
        print(
            f"warning: {steps:.2g} steps take about {_duration(_seconds(sim, until))}; is run.end "
            f"= {sim.scene.run.end:g} s meant?", file=sys.stderr,
        )  # fmt: skip
    elif (seconds := _seconds(sim, until)) > LONG:
        print(f"the steps take about {_duration(seconds)}", flush=True)
    for rock in sim.scene.rocks:
        print(
            f"rock {rock.name!r}: {len(rock.free)} blocks that can move, "
            f"{len(rock.blocks) - len(rock.free)} fixed; {rock.slivers}"
        )
    if not sim.balanced:
        print("some blocks have no static equilibrium and move from the first step")


def _go(sim: Simulation, given: argparse.Namespace) -> None:
    if given.vtk and not find_spec("meshio"):
        raise ValueError("--vtk needs meshio: pip install meshio")
    _announce(sim, given.until)
    pictures = not given.no_pictures
    _, summary = run(sim, given.out, given.until, pictures, given.format, given.vtk)
    for slip in summary["slip"]:
        print(_slip(slip))
    for rock in summary["rocks"]:
        print(sentence(rock))
    print(
        f"energy balanced to {summary['largest_energy_error']:.1e}, smallest margin of the time "
        f"step {summary['time_step_margin']:.2f}; results in {given.out}"
    )


def _slip(slip: dict) -> str:
    predicted, angle = slip["predicted_angle"], slip["slip_angle"]
    alone = "nothing" if predicted is None else f"{predicted:.2f} degrees"
    if slip["slipped_before"]:
        return f"{slip['block']}: had slipped before this run"
    if angle is None:
        return f"{slip['block']}: no slip (the law alone says {alone})"
    return f"{slip['block']}: slipped at {angle:.2f} degrees, the law alone says {alone}"


COMMANDS = {  # what each does, and for its help: about, example, OPTIONS
    "": (
        _run, ABOUT, "tilt --out out/tilt",
        "scene or default", "--out", "--force", "--until", "--no-pictures", "--format", "--vtk",
    ),
    "new": (
        _new, "Write a commented scene of a rock slope cut by joint sets, ready to run.",
        "new my-slope.toml", "file",
    ),
    "ablate": (
        _ablate,
        "Run a scene without each of its ingredients in turn: what it changes in the outcome "
        "(differences against the whole scene) and in the time (ratios).",
        "ablate shear-box --out out/ablation", "scene", "--out", "--force", "--until",
        "--leave-out",
    ),
    "check": (
        _check,
        "Read a scene file, find its initial equilibrium and its time step; run nothing.",
        "check my-scene.toml", "scene",
    ),
    "compare": (
        _compare,
        "Run every rock of a scene alone, cut with several seeds, with its own laws and with plain "
        "Coulomb friction of its asperities. A rock stops, as failed, "
        "once a block has moved by the usual size of its blocks.",
        "compare slope --seeds 1 2 3 --until 10",
        "scene", "--seeds", "--until", "--critical", "--tilt", "--out of numbers",
    ),
    "strength-reduction": (
        _reduce,
        "Find the factor F by which the friction of all asperities is to be divided for each rock "
        "of a scene to just hold, and its critical tilt, each to 1 %, by its static equilibrium; "
        "then run it with 2 % less friction and draw how it fails.",
        "strength-reduction slope --out out/strength", "scene", "--out", "--force", "--until",
        "--format",
    ),
    "resume": (
        _resume,
        "Go on from a saved state; without --step the blocks move as if never stopped.",
        "resume out/tilt/state --until 45 --out out/longer",
        "state", "--out", "--force", "--until", "--no-pictures", "--format", "--vtk", "--step",
    ),
}  # fmt: skip
