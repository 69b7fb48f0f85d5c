"""Parts shared by the subcommands of `jointlaw`: help with an example, options, results."""

import argparse
import hashlib
import json
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from .. import presets
from ..laws.joint_law import JointLaw
from ..parameters import keys
from ..parameters.about import ABOUT_TABLE, About
from ..parameters.aperture import APERTURE_TABLE, Aperture
from ..parameters.resolution import NAMED_RESOLUTIONS
from ..parameters.rock import ROCK, require_rock
from ..support import units
from ..support.files import SUMMARY, clear_run, replace_file, write_json
from ..support.pyplot import FORMATS
from ..support.version import __version__

SUMMARY_VERSION = 2
_ROCK_CONTACTS = {name: getattr(ROCK, name) for name in ("K", "lam", "eta", "mu")}
DEFAULT_ROCK = ", ".join(f"{name} = {value:.4g}" for name, value in _ROCK_CONTACTS.items())
Contents = Mapping[str, str | Callable[[Path], object]]  # of files: text, or a function that writes
Option = tuple[tuple[str, ...], dict[str, Any]]


class Group(NamedTuple):
    """Options under a heading of their own in the help."""

    title: str
    options: tuple[Option, ...]


class Command(NamedTuple):
    """A subcommand.

    name: as it is typed. purpose: one line. example: a command that runs as printed.
    run: takes the parsed options, returns the exit status, None for success.
    options: its own options, alone or in groups. subcommands: one for each host, instead.
    """

    name: str
    purpose: str
    example: str
    run: Callable[[argparse.Namespace], int | None]
    options: tuple[Option | Group, ...] = ()
    subcommands: tuple["Command", ...] = ()


def option(*names: str, **settings: Any) -> Option:
    """An option or argument, as `add_argument` of argparse takes it."""
    return names, settings


def quantity(unit: str, *, positive: bool = False) -> Callable[[str], float]:
    """Type of an option such as 10MPa: a function that returns the value in SI units.

    unit: SI unit of the value; only zero may be typed without a unit. positive: refuse <= 0.
    """

    def parse(text: str) -> float:
        try:
            return units.parse_option(text, unit, positive=positive)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return parse


def quantities(unit: str, *, positive: bool = False) -> Callable[[str], list[float]]:
    """Type of an option such as 5MPa,20MPa: quantities separated by commas, in SI units."""
    return lambda text: [quantity(unit, positive=positive)(part) for part in text.split(",")]


LAW = (  # read by `read_law`
    option("law", metavar="PRESET_OR_FILE", help="a preset (see jointlaw presets) or a TOML file"),
    option(
        "--default-rock",
        action="store_true",
        help="contacts for a file without [asperity], such as the result of a scan: "
        + DEFAULT_ROCK,
    ),
    option(
        "--resolution",
        choices=tuple(NAMED_RESOLUTIONS),
        help="number of springs and sliders (default: that of the preset or file)",
    ),
)
OUT = (
    option("--out", metavar="DIR", type=Path, required=True, help="folder for the results"),
    option(
        "--force", action="store_true", help="replace the results of another run in that folder"
    ),
)
JSON = option("--json", action="store_true", help="print summary.json instead of text, for scripts")
PICTURE_FORMAT = option(
    "--format", choices=FORMATS, default=FORMATS[0], help="format of pictures (default png)"
)


def read_law(options: argparse.Namespace) -> Any:
    """The law that the options `LAW` name. Raises ValueError naming the missing part."""
    path = Path(options.law)
    if options.law in presets.names() or not path.is_file():
        law = presets.load_any(options.law)
    else:
        law = _read_law_file(path, options.default_rock)
    require_rock({"plane": law.plane or 0.0}, f"{options.law}: ")
    if not isinstance(law, JointLaw):
        require_rock({"friction": law.friction}, f"{options.law}: ")
        return law
    require_rock({"mu": law.asperity.mu}, f"{options.law}: asperity.")
    return replace(law, resolution=options.resolution) if options.resolution else law


def read_aperture(name_or_file: str) -> Aperture | None:
    """The hydraulic aperture in a law file.

    None for a preset, for a file without the table [aperture], and for a path without a file.
    """
    path = Path(name_or_file)
    if name_or_file in presets.names() or not path.is_file():
        return None
    table = keys.read(path, "law file").get(APERTURE_TABLE)
    return None if table is None else Aperture.from_table(table, str(path))


def read_about(options: argparse.Namespace) -> About:
    """Origin and caveats of the law that the options `LAW` name, its warnings printed to stderr.

    With --default-rock a warning says that the contacts of a file without [asperity] are assumed.
    """
    path = Path(options.law)
    if options.law in presets.names() or not path.is_file():
        return About(presets.about(options.law)) if options.law in presets.names() else About()
    tables = keys.read(path, "law file")
    about = About.from_table(tables.get(ABOUT_TABLE, {}), str(path))
    if options.default_rock and "asperity" not in tables and tables.get("kind") != "coulomb":
        assumed = dict.fromkeys(_ROCK_CONTACTS, "assumed: default rock")
        text = f"contacts are assumed, those of a default rock ({DEFAULT_ROCK})"
        about = replace(about, warnings=(*about.warnings, text), origin={**about.origin, **assumed})
    print_warnings(about, options.law)
    return about


def print_warnings(about: About, name: str) -> None:
    """Print the warnings of a law to stderr, so that --json leaves stdout to scripts."""
    for text in about.warnings:
        print(f"warning, {name}: {text}", file=sys.stderr)


def new_about(
    options: argparse.Namespace,
    files: Iterable[str | Path],
    warnings: Iterable[str],
    origin: Mapping[str, str],
) -> About:
    """Origin of a law that this command makes: command, version, date, hashes of input files."""
    paths = [Path(file) for file in files]
    digests = {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in paths if path.is_file()
    }
    notes = {
        "command": options.words,
        "version": f"jointlaw {__version__}",
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    return About(notes, tuple(warnings), dict(origin), digests)


def law_text(law: Any, about: About) -> str:
    """TOML text of a law with its table [about]."""
    return "\n".join(text for text in (law.to_toml(), about.to_toml()) if text)


def _read_law_file(path: Path, default_rock: bool) -> Any:
    """The law in a TOML file.

    A file without [asperity] gets the contacts of the default rock if `default_rock` is True; else
    ValueError names the missing table. Coulomb's laws are read as they are.
    """
    tables = keys.read(path, "law file")
    if tables.get("kind") == "coulomb":
        return JointLaw.from_dict(tables, str(path))
    if "asperity" not in tables and not default_rock:
        raise ValueError(
            f"{path} has no contacts: add the table [asperity] with K (Pa m^(1-eta)), lam, eta "
            f"and mu of your rock, or give --default-rock for {DEFAULT_ROCK}"
        )
    return JointLaw.from_dict({"asperity": _ROCK_CONTACTS} | tables, str(path))


def write_results(
    options: argparse.Namespace, files: Contents, summary: Mapping[str, Any], text: str
) -> None:
    """Write the files and summary.json into the folder --out; print the text, or the summary.

    files: by name. A picture is named *.png and written in the format --format; without matplotlib
    it is left out, with a message.
    summary: numbers for scripts; printed with --json instead of the text.
    """
    folder = options.out
    clear_run(folder)
    names = []
    for name, content in files.items():
        path = folder / name
        if path.suffix == ".png":
            path = path.with_suffix(f".{options.format}")
        try:
            if isinstance(content, str):
                replace_file(path, content.encode())
            else:
                content(path)
        except ImportError as error:
            print(f"no picture: {error}", file=sys.stderr)
        else:
            names.append(path.name)
    write_json(folder / SUMMARY, {"version": SUMMARY_VERSION, **summary, "files": names})
    if options.json:
        print((folder / SUMMARY).read_text(encoding="utf-8"), end="")
    else:
        print(text)
        print(f"wrote {', '.join([*names, SUMMARY])} to {folder}")


def settings(options: argparse.Namespace) -> dict[str, Any]:
    """The options of a command for its summary, without the options that direct the output."""
    return {
        k: v for k, v in vars(options).items() if k not in ("run", "out", "force", "json", "words")
    }


def print_json(data: Any) -> None:
    """Print data as JSON."""
    print(json.dumps(data, indent=2, ensure_ascii=False))
