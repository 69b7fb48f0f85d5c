"""Command line: run a scene, check a scene file, resume a saved state."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import jointlaw as jl
from jointlaw.support.files import replace_file, write_json

from . import ablate
from .compare import compare, critical_tilts
from .interfaces import Refused
from .outcome import sentence
from .run import run, steps_to
from .scene import load, names
from .simulation import Simulation
from .tables import SceneError

DEFAULT = "tilt"
TEMPLATE = Path(__file__).parent / "template.toml"

ABOUT = """\
Rigid rock blocks in 2-D whose every contact force comes from a joint law.

  python -m dem_demo [SCENE] --out DIR     run a scene: a name or a TOML file
  python -m dem_demo new FILE              write a commented scene of a jointed rock to start from
  python -m dem_demo ablate SCENE --out DIR
                                           run it without each of its ingredients in turn
  python -m dem_demo check FILE            check a scene file without running it
  python -m dem_demo compare SCENE [--seeds 1 2 3] [--until T]
                                           every rock of a scene alone, with plain Coulomb as well
  python -m dem_demo resume STATE --out DIR [--until T] [--step DT]
                                           go on from DIR/state or DIR/refused
"""


def main(arguments: list[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    verbs = {
        "new": _new, "check": _check, "resume": _resume, "compare": _compare, "ablate": _ablate,
    }  # fmt: skip
    try:
        return verbs[words[0]](words[1:]) if words and words[0] in verbs else _run(words)
    except (SceneError, Refused, jl.PathError, ValueError, OSError) as error:
        print(f"dem_demo: {error}", file=sys.stderr)
        return 2


def _run(words: list[str]) -> int:
    parser = argparse.ArgumentParser(
        "python -m dem_demo",
        description=ABOUT,
        epilog=f"scenes: {', '.join(names())}\nexample: python -m dem_demo tilt --out out/tilt",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scene", nargs="?", default=DEFAULT, help=f"default {DEFAULT}")
    _outputs(parser)
    given = parser.parse_args(words)
    return _go(Simulation(load(given.scene)), given)


def _resume(words: list[str]) -> int:
    parser = argparse.ArgumentParser(
        "python -m dem_demo resume",
        description="Go on from a saved state; without --step bit for bit as if never stopped.",
        epilog="example: python -m dem_demo resume out/tilt/state --until 45 --out out/longer",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("state", type=Path, help="folder that a run left: DIR/state, DIR/refused")
    _outputs(parser)
    parser.add_argument("--step", type=float, help="another time step (s)")
    given = parser.parse_args(words)
    return _go(Simulation.load(given.state, given.step), given)


def _ablate(words: list[str]) -> int:
    parser = argparse.ArgumentParser(
        "python -m dem_demo ablate",
        description="Run a scene without each of its ingredients in turn: what it changes in the "
        "outcome (differences against the whole scene) and in the time (ratios).",
        epilog=f"scenes: {', '.join(names())}\n"
        "example: python -m dem_demo ablate shear-box --out out/ablation",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scene", help="a name or a TOML file")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the results")
    parser.add_argument("--until", type=float, help="model time to stop at (s)")
    given = parser.parse_args(words)
    given.out.mkdir(parents=True, exist_ok=True)  # a folder that cannot be is known before the work
    rows = ablate.ablate(load(given.scene), given.until)
    ablate.write(rows, given.out)
    print(ablate.table(rows))
    print(f"results in {given.out}: ablation.csv, ablation.md, summary.json")
    return 0


def _new(words: list[str]) -> int:
    parser = argparse.ArgumentParser(
        "python -m dem_demo new",
        description="Write a commented scene of a rock slope cut by joint sets, ready to run.",
        epilog="example: python -m dem_demo new my-slope.toml",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", type=Path)
    file = parser.parse_args(words).file
    if file.exists():
        raise ValueError(f"{file} exists: give another name")
    replace_file(file, TEMPLATE.read_bytes())
    print(f"{file} written; next: python -m dem_demo check {file}")
    return 0


def _check(words: list[str]) -> int:
    parser = argparse.ArgumentParser(
        "python -m dem_demo check",
        description="Read a scene file, seat its blocks, find its time step; run nothing.",
        epilog="example: python -m dem_demo check my-scene.toml",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file")
    scene = load(Path(parser.parse_args(words).file))
    _announce(Simulation(scene))
    print("the scene is valid")
    return 0


def _compare(words: list[str]) -> int:
    parser = argparse.ArgumentParser(
        "python -m dem_demo compare",
        description="Run every rock of a scene alone, cut with several seeds, with its own laws "
        "and with plain Coulomb friction of its asperities. What moves 1 m has failed and stops.",
        epilog="example: python -m dem_demo compare slope --seeds 1 2 3 --until 10",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scene", help="a name or a TOML file")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], help="default 1 2 3")
    parser.add_argument("--until", type=float, help="model time to stop at (s)")
    parser.add_argument(
        "--critical",
        action="store_true",
        help="find the tilt that the rock just bears; run nothing",
    )
    parser.add_argument("--tilt", type=float, default=0.0, help="degrees: turn gravity towards +x")
    parser.add_argument("--out", type=Path, help="a JSON file for the numbers")
    given = parser.parse_args(words)
    scene = load(given.scene)
    if not scene.rocks:
        raise ValueError(f"{given.scene} has no [[rock]] to compare")
    if given.out:
        given.out.parent.mkdir(parents=True, exist_ok=True)
    rows, scene_is = [], (scene.text, str(given.scene), given.seeds)
    if given.critical:
        for row in critical_tilts(*scene_is):
            rows.append(row)
            angle = row["critical_tilt"]
            told = "beyond 60 degrees" if angle is None else f"{angle:+.1f} degrees"
            print(f"seed {row['seed']}, {row['law']:7s}  {row['rock']}: {told}", flush=True)
    else:
        end = given.until if given.until is not None else scene.run.end
        for row in compare(*scene_is, end, given.tilt):
            rows.append(row)
            print(f"seed {row['seed']}, {row['law']:7s} {row['time_s']:6.2f} s  {sentence(row)}"
                  f", books to {row['largest_energy_error']:.1e}", flush=True)  # fmt: skip
            if row["refused"]:
                print(f"    stopped: {row['refused']}")
    if given.out:
        write_json(given.out, rows)
    return 0


def _outputs(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for the results")
    parser.add_argument("--until", type=float, help="model time to stop at (s)")
    parser.add_argument("--no-pictures", action="store_true", help="tables only")


def _announce(sim: Simulation, until: float | None = None) -> None:
    steps = steps_to(sim, until)
    free = sum(1 for block in sim.scene.blocks if not block.fixed)
    print(f"{sim.scene.title}: {free} moving blocks, {sim.joints.n} law points in reach")
    print(
        f"time step {sim.dt:.3g} s, limit {sim.step_limit:.3g} s (safety factor "
        f"{sim.step_limit / sim.dt:.2f}), {steps} steps"
    )
    for rock in sim.scene.rocks:
        print(
            f"rock {rock.name!r}: {len(rock.free)} blocks that can move, "
            f"{len(rock.blocks) - len(rock.free)} fixed; {rock.slivers}"
        )
    if not sim.balanced:
        print("not all blocks can be held where they are drawn: those that cannot move from step 0")


def _go(sim: Simulation, given: argparse.Namespace) -> int:
    _announce(sim, given.until)
    _, summary = run(sim, given.out, given.until, not given.no_pictures)
    for slip in summary["slip"]:
        predicted = slip["predicted_angle"]
        alone = "nothing" if predicted is None else f"{predicted:.2f} degrees"
        if slip["slipped_before"]:
            print(f"{slip['block']}: had slipped before this run")
        elif slip["slip_angle"] is None:
            print(f"{slip['block']}: no slip (the law alone says {alone})")
        else:
            print(
                f"{slip['block']}: slipped at {slip['slip_angle']:.2f} degrees, "
                f"the law alone says {alone}"
            )
    for rock in summary["rocks"]:
        print(sentence(rock))
    print(
        f"energy balanced to {summary['largest_energy_error']:.1e}, smallest safety factor "
        f"{summary['safety_factor']:.2f}; results in {given.out}"
    )
    return 0
