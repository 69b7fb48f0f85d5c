"""What the subcommands of `jointlaw` share: help with a worked example, options, results."""

import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from .. import presets
from ..laboratory.experiments import PathError
from ..laboratory.record import UNITS, Record
from ..law import JointLaw
from ..parameters.resolution import NAMED
from ..parameters.rock import require_rock
from ..support import units
from ..support.checks import number
from ..support.files import clear_run, replace_file, write_json
from ..support.pyplot import FORMATS

VERSION = 1  # of summary.json
Written = Mapping[str, str | Callable[[Path], object]]


def add_command(
    commands: Any,
    name: str,
    what: str,
    example: str,
    run: Callable[[argparse.Namespace], int | None],
) -> argparse.ArgumentParser:
    """Add a subcommand with its one-line purpose and an example that runs as printed.

    run: what the command does with its options; returns the exit status, None for success.
    """
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=what,
        description=what,
        epilog=f"example:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=run)
    return parser


def add_law(parser: argparse.ArgumentParser, *, resolution: bool = True) -> None:
    """Add the law, a preset or a file, and its resolution; `read_law` reads them."""
    parser.add_argument("law", metavar="PRESET_OR_FILE", help="preset name or TOML file")
    if resolution:
        parser.add_argument("--resolution", choices=tuple(NAMED), help="instead of the law's own")


def read_law(options: argparse.Namespace) -> JointLaw:
    """The law that the options name."""
    law = presets.load_any(options.law)
    require_rock({"mu": law.asperity.mu}, f"{options.law}: asperity.")
    require_rock({"plane": law.plane or 0.0}, f"{options.law}: ")
    value = given(options, "yield_interference", "m", positive=True)
    if value is not None:
        law = replace(law, asperity=replace(law.asperity, yield_interference=value))
    resolution = getattr(options, "resolution", None)  # last: a name chooses by the whole law
    if resolution is not None:
        law = replace(law, resolution=resolution)
    return law


def add_out(
    parser: argparse.ArgumentParser, *, required: bool = True, pictures: bool = True
) -> None:
    """Add the folder for the results and, of a command that draws, the format of its pictures."""
    parser.add_argument(
        "--out", metavar="DIR", type=Path, required=required, help="folder for the results"
    )
    parser.add_argument(
        "--force", action="store_true", help="replace the results of another run in that folder"
    )
    if pictures:
        parser.add_argument(
            "--format", choices=FORMATS, default=FORMATS[0], help="of pictures (default png)"
        )


def quantity(option: str, text: str, unit: str, *, positive: bool = False) -> float:
    """The SI value of an option, which errors name; only zero needs no unit."""
    try:
        value = units.parse(text, unit)
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None
    number(option, value)
    if value and text.strip()[-1] in "0123456789.":
        raise ValueError(
            f"{option} = {text} has no unit: write for example {text.strip()}"
            f"{units.COMMON[unit]}, or {text.strip()}{unit}"
        )
    if positive and value <= 0:
        raise ValueError(f"{option} = {text} is out of bounds: it must be > 0 {unit}")
    return value


def given(options: argparse.Namespace, name: str, unit: str, **more: bool) -> float | None:
    """The SI value of an option by its name in `options`; None if it is left out."""
    text = getattr(options, name, None)
    option = f"--{name.replace('_', '-')}"
    return None if text is None else quantity(option, text, unit, **more)


def write_results(
    folder: Path, files: Written, summary: Mapping[str, Any], picture_format: str
) -> None:
    """Write each file, its text or by its function, and summary.json.

    A picture is named as PNG and written in its format; without matplotlib it is left out.
    """
    clear_run(folder)
    names = []
    for name, content in files.items():
        picture = name.endswith(".png")
        if picture:
            name = name.removesuffix("png") + picture_format
        try:
            if isinstance(content, str):
                replace_file(folder / name, content.encode())
            else:
                content(folder / name)
        except ImportError as error:
            if not picture:
                raise
            print(f"no picture: {error}", file=sys.stderr)
            continue
        names.append(name)
    write_json(folder / "summary.json", {"version": VERSION, **summary, "files": names})
    print(f"wrote {', '.join([*names, 'summary.json'])} to {folder}")


def add_test_options(parser: argparse.ArgumentParser, steps: int) -> None:
    """Add what the laboratory tests take: law, yielding, steps and folder for the results."""
    add_law(parser)
    parser.add_argument(
        "--yield-interference",
        metavar="LENGTH",
        help="compression at which asperities yield, such as 0.1um, instead of the law's own",
    )
    parser.add_argument(
        "--steps", metavar="N", type=int, default=steps, help=f"steps per leg (default {steps})"
    )
    parser.add_argument(
        "--units",
        metavar="LENGTH,STRESS",
        default="m,Pa",
        help="of CSV and text: mm,MPa (default m,Pa)",
    )
    add_out(parser)


def run_test(test: Callable[[], Record], law: JointLaw, options: argparse.Namespace) -> Record:
    """Run a laboratory test and write its record, also that of a test that stopped early."""
    csv_units(options)  # refused before the work
    try:
        record = test()
    except PathError as error:
        if len(error.record):
            _write(error.record, law, options)
        raise
    _write(record, law, options)
    return record


def _write(record: Record, law: JointLaw, options: argparse.Namespace) -> None:
    """Curve (CSV, NPZ), picture, law and summary of a test."""
    name, (length, stress) = options.command, csv_units(options)
    files: Written = {
        f"{name}.csv": partial(record.to_csv, length=length, stress=stress),
        f"{name}.npz": record.to_npz,
        "law.toml": law.to_toml,
        f"{name}.png": record.plot,
    }
    settings = {k: v for k, v in vars(options).items() if k not in ("run", "out", "force")}
    summary = {"settings": settings, "result": record.summary(), "units": UNITS}
    write_results(options.out, files, summary, options.format)


def csv_units(options: argparse.Namespace) -> list[str]:
    """Units of length and stress for the CSV."""
    given: list[str] = options.units.split(",")
    if len(given) != 2 or not all(given):
        raise ValueError(f"--units = {options.units}: write a length and a stress: mm,MPa")
    for unit, base in zip(given, ("m", "Pa"), strict=True):
        quantity("--units", f"1{unit}", base)
    return given
