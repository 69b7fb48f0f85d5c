"""The command line of the block demo: run, validate and study scenes."""

import argparse
import contextlib
import shutil
import sys
import textwrap
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from jointlaw import JointLaw, PathError, direct_shear
from jointlaw.cli.command import Command, Option, option
from jointlaw.cli.main import (
    EXIT_INTERRUPTED,
    EXIT_INVALID_INPUT,
    EXIT_OUTPUT_CLOSED,
    Parser,
    discard_output,
)
from jointlaw.support.checks import remedy
from jointlaw.support.files import SUMMARY, write_json
from jointlaw.support.pyplot import FORMATS
from jointlaw.support.version import __version__

from .dynamics.blocks import drawn_overlaps, floating_blocks
from .dynamics.relaxation import MAX_ITERATIONS, Verdict
from .dynamics.simulation import Simulation
from .output.folder import ABLATION, STRENGTH, TRIALS, require_free
from .output.monitors import friction_angle
from .output.pictures import Pictures
from .output.record import (
    MAX_LISTED_BLOCKS,
    RunRecord,
    format_blocks,
    format_outcome,
    list_blocks,
    report_lines,
)
from .output.run import run, steps_to
from .scene import TEMPLATE, Scene, SceneError, shipped
from .scene.laws import law_warnings
from .space import Equilibrium, SpaceScene, SpaceSimulation, Statics, load, load_simulation
from .space import output as space_output
from .space.loads import floating_blocks as floating_blocks_in_space
from .space.pictures import MISSING, has_pyvista
from .space.strength import strength_reduction as space_strength_reduction
from .studies import ablate, compare, strength
from .studies.limit_analysis import format_bound, limit_factor

STRENGTH_VERSION = 5
FAILURE_RUN_TIME = 3.0  # s: longest run to failure of a strength reduction
TRIAL_STEPS = 100  # most steps, and
TRIAL_TIME = 1.0  # s, by which the time of a run is estimated
MOBILISED_FRICTION = 0.9  # fraction of peak friction that should be mobilised when a bond breaks
LOW_STRESS = 0.1  # of the stress at the closure range: below it tractions are inaccurate
BOUND_OF = {  # keys of a row of strength reduction
    "factor_of_safety": "limit_analysis",
    "factor_without_excluded": "limit_without_excluded",
}
ABOUT = """\
Rigid rock blocks in two and three dimensions. Every contact force comes from a rock-joint law.

`python -m dem_demo SCENE` runs a scene of the package by name, or a TOML file.
"""
EXAMPLES = """\
examples:
  python -m dem_demo tilt --out out/tilt
  python -m dem_demo new my-slope.toml
  python -m dem_demo run --help
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status: 0, 2 for invalid input or a run that stopped with
    an error, 130 after Ctrl-C, 141 if the reader of the output has ended."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        options = _parse(words)
        if getattr(options, "force", None) is False:
            require_free(options.out)
        options.run(options)
        sys.stdout.flush()
    except BrokenPipeError:
        discard_output()
        return EXIT_OUTPUT_CLOSED
    except KeyboardInterrupt as stop:
        print(f"dem_demo: {str(stop) or 'interrupted'}", file=sys.stderr)
        return EXIT_INTERRUPTED
    except (SceneError, PathError, ValueError, OSError) as error:
        print(f"dem_demo: {error}", file=sys.stderr)
        return EXIT_INVALID_INPUT
    return 0


def _parse(words: list[str]) -> argparse.Namespace:
    """Parse the command line. Raises ValueError with one line for the user."""
    parser = Parser(
        prog="python -m dem_demo",
        description=ABOUT,
        epilog=f"{_scene_list()}\n\n{EXAMPLES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=lambda options: parser.print_help())
    parser.add_argument("--version", action="version", version=f"dem_demo {__version__}")
    parsers = parser.add_subparsers(dest="command", metavar="COMMAND", title="commands")
    for command in COMMANDS:
        subparser = parsers.add_parser(
            command.name,
            help=command.purpose,
            description=command.purpose[0].upper() + command.purpose[1:] + ".",
            epilog=f"example:\n  {command.example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        subparser.set_defaults(run=command.run)
        for names, settings in command.options:
            subparser.add_argument(*names, **settings)
    if words and words[0] not in {*parsers.choices, "-h", "--help", "--version"}:
        _require_scene(words[0], list(parsers.choices))
        words = ["run", *words]
    return parser.parse_args(words)


def _require_scene(word: str, commands: list[str]) -> None:
    """Require that the first word, which is no command, is a scene, a file or an option.

    Raises ValueError with the commands and scenes that are spelled like it.
    """
    if word in shipped() or word.startswith("-") or Path(word).exists():
        return
    if Path(word).suffix:
        raise ValueError(f"no file {word!r}")
    names = [*commands, *shipped()]
    raise ValueError(f"no command or scene {word!r}: {remedy(word, names, 'give one of')}")


def _scene_list() -> str:
    """Names of the scenes of the package, in lines of the width of the help."""
    width = shutil.get_terminal_size().columns - 2
    names = ", ".join(shipped())
    return textwrap.fill(f"scenes: {names}", width, subsequent_indent="  ", break_on_hyphens=False)


@contextlib.contextmanager
def _messages_for(as_json: bool) -> Iterator[None]:
    """Print messages on the standard error stream if the standard output is JSON."""
    with contextlib.redirect_stdout(sys.stderr if as_json else sys.stdout):
        yield


def _run(options: argparse.Namespace) -> None:
    """Run a scene, or a saved state, to its end."""
    if options.vtk and not find_spec("meshio"):
        raise ValueError("--vtk needs meshio: pip install meshio")
    with _messages_for(options.json):
        if options.command == "resume":
            sim = load_simulation(options.state, options.step)
            _print_law_warnings(sim.scene)
            print(
                "the run continues with the scene of its saved state: changes of the scene file "
                "since then have no effect"
            )
            _run_simulation(options, sim)
        elif isinstance(scene := _load_scene(options.scene), SpaceScene):
            if scene.run is None:
                _run_in_space(options, scene)
            else:
                _run_simulation(options, SpaceSimulation(scene))
        else:
            _run_simulation(options, Simulation(scene))
        print(f"results in {options.out}")
    if options.json:
        print((options.out / SUMMARY).read_text(encoding="utf-8"), end="")


def _load_scene(source: str) -> Scene | SpaceScene:
    """Read a scene, and print the warnings in the parameter files of its laws."""
    scene = load(source)
    _print_law_warnings(scene)
    return scene


def _print_law_warnings(scene: Scene | SpaceScene) -> None:
    """Print the warnings in the parameter files of the laws of a scene to stderr."""
    for text in law_warnings(scene.files):
        print(f"warning, {text}", file=sys.stderr)


def _run_simulation(options: argparse.Namespace, sim: Simulation) -> None:
    """Run a simulation to its end, and write its files."""
    _describe(sim, options.until, options.format is not None)
    dt = sim.dt
    vtk = options.vtk or (isinstance(sim.scene, SpaceScene) and _replaces_pictures(options))
    record, summary = run(sim, options.out, options.until, options.format, vtk)
    _report(sim, record, summary, dt)


def _load_in_plane(options: argparse.Namespace) -> Scene:
    """Read the scene of a command for the plane. Raises ValueError for a scene in space."""
    scene = _load_scene(options.scene)
    if isinstance(scene, SpaceScene):
        raise ValueError(
            f"{options.command} {options.scene}: for scenes in the plane only; check, run and "
            "strength-reduction treat blocks in space"
        )
    return scene


def _refuse_until(options: argparse.Namespace) -> None:
    """Refuse --until for statics of a scene in space. Raises ValueError."""
    if options.until is not None:
        raise ValueError(
            "--until: the blocks do not move here; leave it out, or run a scene whose [run] has an "
            "end"
        )


def _run_in_space(options: argparse.Namespace, scene: SpaceScene) -> None:
    """Find the equilibrium of a scene in space, and write its files."""
    _refuse_until(options)
    statics = Statics(scene)
    result = statics.solve()
    _describe_in_space(statics, result)
    print("the scene has no [run] with an end: the run ends with the static equilibrium")
    vtk = options.vtk or _replaces_pictures(options)
    space_output.write(statics, result, options.out, vtk, options.format)


def _replaces_pictures(options: argparse.Namespace) -> bool:
    """Whether VTK files replace pictures of blocks in space for want of pyvista; prints so."""
    if not options.format or _space_picture_format(options) or not find_spec("meshio"):
        return False
    print("VTK files are written in place of pictures")
    return True


def _space_picture_format(options: argparse.Namespace) -> str | None:
    """Format of pictures of blocks in space; None for no pictures, also where pyvista is missing,
    after a message with the remedy."""
    if options.format and not has_pyvista():
        print(MISSING)
        return None
    return options.format


def _free_blocks(count: int) -> str:
    """A number of free blocks in words."""
    return "1 free block" if count == 1 else f"{count} free blocks"


def _describe_in_space(statics: Statics, result: Equilibrium) -> None:
    """Print size, rocks and verdict of a scene in space."""
    scene = statics.scene
    contacts = f"{space_output.count_contacts(statics)} contacts"
    points = f"{len(statics.points.area)} contact points"
    count = int(statics.is_free.sum())
    print(f"{scene.title}: {_free_blocks(count)}, {contacts}, {points}")
    _print_rocks(scene)
    if statics.untouched.any():
        untouched = format_blocks(list_blocks(scene, statics.untouched))
        print(f"touch nothing, so that nothing supports them: {untouched}")
    print(f"initial state: {result.verdict.value}")
    _print_unstable(scene, result.verdict.value, result.unstable)


def _check_in_space(scene: SpaceScene) -> None:
    """Validate a scene in space, and warn of laws that do not suit the stresses of their joints."""
    statics = Statics(scene)
    result = statics.solve()
    _describe_in_space(statics, result)
    floats = floating_blocks_in_space(scene, statics.surfaces, statics.mass)
    _print_floating_blocks(scene, floats)
    _check_stages_in_space(scene)
    _check_water_tables_in_space(scene)
    for number, (name, law) in enumerate(scene.laws.items()):
        stress = result.traction[statics.law == number, 0].max(initial=0.0)
        if isinstance(law, JointLaw):
            _warn_of_closure_range(name, law, float(stress))
    print("the scene is valid")


def _check_stages_in_space(scene: SpaceScene) -> None:
    """Print the verdict after each excavation stage, on joints without history."""
    for number, stage in enumerate(scene.stages, 1):
        count = len(stage["blocks"])
        blocks = "1 block" if count == 1 else f"{count} blocks"
        begin = "at rest" if stage["start"] is None else f"at {stage['start']:g} s"
        print(
            f"after excavation stage {number} (it begins {begin}, removes {blocks} and releases "
            f"their forces in {stage['release_time']:g} s), on joints without history:"
        )
        _print_verdict_in_space(Statics(scene.after_stages(number)))


def _check_water_tables_in_space(scene: SpaceScene) -> None:
    """Print the verdict on the equilibrium with each later water table, after all stages."""
    excavated = scene.after_stages(len(scene.stages))
    for start, _ in scene.water_changes:
        print(f"with the water table of {start:g} s, on joints without history:")
        _print_verdict_in_space(Statics(excavated.with_water_at(start)))


def _print_verdict_in_space(statics: Statics) -> None:
    """Print the verdict on the equilibrium of a scene in space, with the unstable blocks."""
    result = statics.solve()
    print(f"initial state: {result.verdict.value}")
    _print_unstable(statics.scene, result.verdict.value, result.unstable)


def _report(sim: Simulation, record: RunRecord, summary: dict, initial_dt: float) -> None:
    """Print the results of a run; initial_dt (s): time step at its start."""
    if start_times := summary["stage_start_s"]:
        starts = ("not started" if time is None else f"{time:.3g} s" for time in start_times)
        print(f"excavation stages started at: {', '.join(starts)}")
    for line in report_lines(record):
        print(line)
    if sim.dt < initial_dt:
        print(
            f"the time step was halved to {sim.dt:.3g} s, because joints stiffened or blocks fell"
        )
    print(
        f"max. relative energy error {summary['max_energy_error']:.1e}, min. ratio of the "
        f"stability limit to the time step {summary['time_step_margin']:.2f}"
    )


def _describe(sim: Simulation, until: float | None = None, with_pictures: bool = True) -> None:
    """Print size, time step, estimated time, rocks and unstable blocks of a simulation."""
    scene = sim.scene
    dt = sim.dt
    limit = sim.limit.current
    steps = steps_to(sim, until)
    moving = sum(not block.fixed for block in scene.blocks)
    print(f"{scene.title}: {_free_blocks(moving)}, {sim.joints.n} contact points")
    reason = ""
    if sim.fraction_reason:
        reason = f"; fraction {dt / limit:.2g}, because {sim.fraction_reason}"
    print(
        f"time step {dt:.3g} s, stability limit {limit:.3g} s (ratio {limit / dt:.2f}{reason}), "
        f"{steps} steps"
    )
    _print_estimate(sim, steps, until, with_pictures)
    _print_rocks(scene)
    if sim.verdict and not sim.time:
        _print_verdict(sim)


def _print_rocks(scene: Scene | SpaceScene) -> None:
    """Print the numbers of blocks of each rock, and the merged and dropped slivers."""
    for rock in scene.rocks:
        fixed = len(rock.blocks) - len(rock.free)
        print(f"rock {rock.name!r}: {len(rock.free)} blocks that can move, {fixed} fixed")
        for message in rock.messages:
            print(f"  {message}")


def _print_verdict(sim: Simulation) -> None:
    """Print the verdict on the initial equilibrium, with the unstable blocks."""
    print(f"initial state: {sim.verdict}")
    _print_unstable(sim.scene, sim.verdict, sim.unstable)


def _print_unstable(scene: Scene | SpaceScene, verdict: str, unstable: np.ndarray) -> None:
    """Print the blocks (n,) without static equilibrium, if any."""
    count = int(unstable.sum())
    if not count:
        return
    blocks = format_blocks(list_blocks(scene, unstable))
    if verdict == Verdict.NOT_DECIDED.value:
        number = "1 block" if count == 1 else f"{count} blocks"
        print(
            f"the search found no equilibrium of {number}, and no steady motion that excludes one "
            f"within {MAX_ITERATIONS} iterations: {blocks}"
        )
    else:
        number = "1 block has" if count == 1 else f"{count} blocks have"
        moves = " and will move from the first step" if scene.run else ""
        print(f"{number} no static equilibrium{moves}: {blocks}")


def _print_limit_analysis(scene: Scene) -> None:
    """Print the upper bound of the factor of safety of a scene that settles."""
    try:
        print(f"factor of safety: {format_bound(limit_factor(scene))}")
    except RuntimeError as error:  # the solver decides nothing
        print(f"no bound of the factor of safety: {error}")


def _print_estimate(sim: Simulation, steps: int, until: float | None, with_pictures: bool) -> None:
    """Print the estimated time of a run, with its pictures if there are any; in space the text says
    that they are left out.

    Nothing is printed for a run without steps, or if the first steps of a copy end with an error.
    """
    step_time = _step_time(sim)
    if not step_time or not steps:
        return
    text = f"estimated {_format_duration(step_time * steps)}"
    if with_pictures and isinstance(sim.scene, SpaceScene):
        text += ", without the pictures"
    elif with_pictures:
        end = sim.scene.run.end if until is None else until
        frames = 1 + round((end - sim.time) / sim.scene.run.record)
        drawing_time = Pictures(RunRecord(sim)).estimate_time(frames)
        text += f", + {_format_duration(drawing_time)} for figures and animation"
    print(text)


def _format_duration(seconds: float) -> str:
    """Format a time (s) with two digits."""
    for factor, unit in ((3600.0, "hours"), (60.0, "min")):
        if seconds >= 100 / 60 * factor:
            return f"{seconds / factor:.2g} {unit}"
    return f"{seconds:.2g} s"


def _step_time(sim: Simulation) -> float:
    """Time (s) of a step, from the first steps of a copy; 0 where these end with an error."""
    copy = type(sim)(sim.scene, saved=sim.state())
    steps = 0
    started = time.perf_counter()
    with contextlib.suppress(SceneError):
        while steps < TRIAL_STEPS and time.perf_counter() < started + TRIAL_TIME:
            copy.step()
            steps += 1
        return (time.perf_counter() - started) / steps
    return 0.0


def _new(options: argparse.Namespace) -> None:
    """Write the template of a scene."""
    with options.file.open("xb") as file:  # OSError where it exists
        file.write(TEMPLATE.read_bytes())
    print(f"{options.file} written; next: python -m dem_demo check {options.file}")


def _check(options: argparse.Namespace) -> None:
    """Validate a scene, and warn of laws that do not suit the stresses of their joints."""
    scene = _load_scene(options.scene)
    if isinstance(scene, SpaceScene):
        _check_in_space(scene)
        return
    sim = Simulation(scene)
    _describe(sim)
    _warn_of_drawn_overlaps(sim.scene)
    _warn_of_floating_blocks(sim)
    if sim.verdict:
        _print_limit_analysis(sim.scene)
        _check_stages(sim.scene)
        _check_water_tables(sim.scene)
    for (name, law), rows in zip(sim.scene.laws.items(), sim.joints.rows_by_law, strict=True):
        stress = float(sim.joints.traction[rows, 0].max(initial=0.0))
        if isinstance(law, JointLaw):
            _warn_of_closure_range(name, law, stress)
            if law.bond and law.bond.cohesion and stress > 0.0:
                _warn_of_bond(name, law, stress)
    print("the scene is valid")


def _check_stages(scene: Scene) -> None:
    """Print a verdict for each excavation stage: does a static equilibrium exist after it?

    For each stage the blocks of it and of all earlier stages are removed, a simulation of the
    remaining scene searches for its equilibrium, and limit analysis gives an upper bound; the
    unstable blocks are listed. Joints are taken without history, as if the stages were excavated
    before the loads act. A stage whose scene is invalid is reported as not examined.
    """
    removed = [*scene.removed]
    for number, stage in enumerate(scene.stages, 1):
        removed += stage["blocks"]
        print(f"after excavation stage {number}, on joints without history:")
        excavated = replace(scene, stages=(), removed=tuple(removed))
        try:
            sim = Simulation(strength.settled(excavated))
        except (SceneError, ValueError) as error:
            print(f"not examined: {error}")
            continue
        _print_verdict(sim)
        _print_limit_analysis(excavated)


def _warn_of_drawn_overlaps(scene: Scene) -> None:
    """Print the pairs of blocks that overlap as drawn, which closes their joints."""
    overlaps = drawn_overlaps(scene)
    for first, second, depth in overlaps[:MAX_LISTED_BLOCKS]:
        print(
            f"drawing fault: blocks {first!r} and {second!r} overlap by {depth:.2g} m as drawn, "
            "which closes their joint by as much; draw them apart"
        )
    if len(overlaps) > MAX_LISTED_BLOCKS:
        print(f"drawing fault: {len(overlaps) - MAX_LISTED_BLOCKS} more pairs of blocks overlap")


def _warn_of_floating_blocks(sim: Simulation) -> None:
    """Name the blocks that the water lifts with more than their weight."""
    _print_floating_blocks(sim.scene, floating_blocks(sim.scene, sim.blocks, sim.manager))


def _print_floating_blocks(scene: Scene | SpaceScene, floats: np.ndarray) -> None:
    """Print the blocks (n,) that float, if any."""
    if floats.any():
        blocks = format_blocks(list_blocks(scene, floats))
        count = int(floats.sum())
        verb = "block floats" if count == 1 else "blocks float"
        print(f"{count} {verb}: the water lifts more than the weight; check density: {blocks}")


def _check_water_tables(scene: Scene) -> None:
    """Print the verdict on the equilibrium with each later water table, after all stages."""
    excavated = replace(scene.excavated, water=scene.water, water_changes=scene.water_changes)
    for start, _ in scene.water_changes:
        print(f"with the water table of {start:g} s, on joints without history:")
        changed = excavated.with_water_at(start)
        _print_verdict(Simulation(strength.settled(changed)))
        _print_limit_analysis(changed)


def _warn_of_closure_range(name: str, law: JointLaw, largest: float) -> None:
    """Recommend a closure range where the cells of a law are placed for far larger stresses than
    the largest normal stress (Pa) of its joints."""
    cell_stress = float(law.normal_stress(law.closure_range * law.resolution.lowest))
    if law.tables.asperities.cells > 1 and 0.0 < largest < LOW_STRESS * cell_stress:
        print(
            f"law {name!r}: its joints carry {largest:.2g} Pa at most, but its depth cells are for "
            f"{cell_stress:.2g} Pa, so that tractions err by up to 20 % (docs/accuracy.md). In "
            f"[laws.{name}] write closure_range = {law.closure(2.0 * largest):.2g}, in m, the "
            "closure at twice that stress; or save sliders by depth = 1 in its resolution"
        )


def _warn_of_bond(name: str, law: JointLaw, stress: float) -> None:
    """Warn of a bond that breaks before the friction of the asperities is mobilised at a normal
    stress (Pa)."""
    unbonded = replace(law, bond=None)
    slip = law.bond.cohesion / law.bond.shear_stiffness
    shear = direct_shear(unbonded.joint(), to=[slip], normal=stress, steps=20).shear_stress[-1]
    peak = stress * np.tan(np.radians(friction_angle(unbonded, stress)))
    if shear < MOBILISED_FRICTION * peak:
        print(
            f"law {name!r}: its bond breaks after {slip:.2g} m of shear, when only "
            f"{shear / peak:.0%} of the friction at {stress:.2g} Pa is mobilised: the strengths "
            'do not add up. For cohesion in addition to friction, use kind = "coulomb" with '
            "cohesion and tension"
        )


def _ablate(options: argparse.Namespace) -> None:
    """Run a scene without each of its ingredients in turn."""
    options.out.mkdir(parents=True, exist_ok=True)  # raises before the work if it cannot be made
    print(ablate.write(ablate.ablate(_load_in_plane(options), options.until), options.out))
    print(f"results in {options.out}: {ABLATION}")


def _compare(options: argparse.Namespace) -> None:
    """Run each rock of a scene with its own laws and with Coulomb's law."""
    scene = _load_in_plane(options)
    if not scene.rocks:
        raise ValueError(f"{options.scene} has no [[rock]] to compare")
    for row in compare.compare(scene, options.seeds, options.until):
        for name, law in row["laws"].items():
            peak, residual = np.degrees(np.arctan([law.friction, law.residual_friction or 0.0]))
            print(f"law {name!r} as Coulomb: {peak:.1f} degrees at the peak, {residual:.1f} after "
                  f"{1e3 * law.weakening:.2g} mm")  # fmt: skip
        message = f"; stopped: {row['stopped']}" if row["stopped"] else ""
        print(f"seed {row['seed']}, {row['law']:7s} after {row['time_s']:.3g} s, "
              f"{format_outcome(row)}{message}", flush=True)  # fmt: skip


def _reduce_strength(options: argparse.Namespace) -> None:
    """Compute factor of safety and critical tilt of each rock."""
    with _messages_for(options.json):
        scene = _load_scene(options.scene)
        laws = scene.laws.values()
        if any(isinstance(law, JointLaw) and law.slope_wear < np.inf for law in laws):
            print("slope_wear has no effect on factor and tilt: they are too high")
        options.out.mkdir(parents=True, exist_ok=True)
        if options.force:
            (options.out / TRIALS).unlink(missing_ok=True)
        rows = []
        try:
            for row in _strength_rows(options, scene):
                print(f"{row['rock']}: {_format_strength(row)}", flush=True)
                rows.append(row)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(
                f"interrupted; {options.out / TRIALS} has all finished trials: the same command "
                "continues"
            ) from None
        write_json(options.out / STRENGTH, {"version": STRENGTH_VERSION, "rows": rows})
        has_pictures = not isinstance(scene, SpaceScene) or has_pyvista()
        pictures = " and pictures of the failure" if has_pictures else ""
        print(f"{STRENGTH}{pictures} in {options.out}")
    if options.json:
        print((options.out / STRENGTH).read_text(encoding="utf-8"), end="")


def _strength_rows(options: argparse.Namespace, scene: Scene | SpaceScene) -> Iterator[dict]:
    """Yield the rows of a strength reduction, in the plane or in space."""
    tell = partial(print, flush=True)
    if isinstance(scene, SpaceScene):
        _refuse_until(options)
        picture_format = _space_picture_format(options)
        yield space_strength_reduction(scene, options.out, tell, picture_format)
        return
    default_end = min(scene.run.end, FAILURE_RUN_TIME)
    until = default_end if options.until is None else options.until
    yield from strength.strength_reduction(scene, until, options.out, options.format, tell)


def _format_strength(row: dict[str, Any]) -> str:
    """Format factor of safety and critical tilt for the terminal."""
    names = {
        "factor_of_safety": ("factor of safety", ""),
        "factor_without_excluded": ("factor of safety without unstable blocks", ""),
        "critical_tilt": ("critical tilt", " degrees"),
    }
    parts = []
    for key, (name, unit) in names.items():
        if key in row:
            text = f"no {name}" if row[key] is None else f"{name} {row[key]:.3g}{unit}"
            bound = BOUND_OF.get(key)
            parts.append(f"{text} ({format_bound(row[bound])})" if bound in row else text)
    return ", ".join(parts)


SCENE = option("scene", help="a scene of the package by name, or a TOML file")
OUT = option("--out", type=Path, default=Path("out"), help="folder for the results (default: out)")
FORCE = option("--force", action="store_true", help="replace another run in that folder")
UNTIL = option("--until", type=float, metavar="T", help="model time to stop at (s)")
FORMAT = option(
    "--format", choices=FORMATS, default=FORMATS[0], help=f"of pictures (default: {FORMATS[0]})"
)
JSON = option("--json", action="store_true", help="print the JSON results on the standard output")
OUTPUT: tuple[Option, ...] = (
    OUT,
    FORCE,
    UNTIL,
    option(
        "--no-pictures",
        action="store_const",
        const=None,
        dest="format",
        default=FORMATS[0],
        help="write tables only",
    ),
    FORMAT,
    option("--vtk", action="store_true", help="write VTK files for ParaView too (needs meshio)"),
    JSON,
)
COMMANDS = (
    Command(
        "run", "run a scene and write tables, pictures and an animation",
        "python -m dem_demo run tilt --out out/tilt", _run, (SCENE, *OUTPUT),
    ),
    Command(
        "new", "write a commented scene of a jointed rock slope to start from",
        "python -m dem_demo new my-slope.toml", _new,
        (option("file", type=Path, help="TOML file to write"),),
    ),
    Command(
        "check", "validate a scene, find its static equilibrium and time step",
        "python -m dem_demo check slope", _check, (SCENE,),
    ),
    Command(
        "resume", "continue a run from its saved state",
        "python -m dem_demo resume out/tilt --until 40 --out out/tilt-2", _run,
        (
            option("state", type=Path, help="folder of a run, or the state folder in it"),
            *OUTPUT,
            option("--step", type=float, metavar="DT", help="another time step (s)"),
        ),
    ),
    Command(
        "strength-reduction", "compute factor of safety and critical tilt of each rock",
        "python -m dem_demo strength-reduction slope --out out/strength", _reduce_strength,
        (SCENE, OUT, FORCE, UNTIL, FORMAT, JSON),
    ),
    Command(
        "compare", "run each rock with its own laws and with Coulomb's law of the same strength",
        "python -m dem_demo compare slope --seeds 1 2 3 --until 10", _compare,
        (
            SCENE,
            option("--seeds", type=int, nargs="+", default=[1, 2, 3], metavar="SEED",
                   help="seeds of the joint sets (default: 1 2 3)"),
            UNTIL,
        ),
    ),
    Command(
        "ablate", "run a scene without each of its ingredients in turn",
        "python -m dem_demo ablate slope --out out/ablate", _ablate, (SCENE, OUT, FORCE, UNTIL),
    ),
)  # fmt: skip
