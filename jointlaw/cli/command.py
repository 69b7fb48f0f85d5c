"""What the subcommands of `jointlaw` share: help with a worked example, options, results."""

import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from .. import presets
from ..laws.joint_law import JointLaw
from ..parameters import keys
from ..parameters.resolution import NAMED
from ..parameters.rock import ROCK, require_rock
from ..support import units
from ..support.files import clear_run, replace_file, write_json
from ..support.pyplot import FORMATS

VERSION = 2  # of summary.json
_CONTACTS = {name: getattr(ROCK, name) for name in ("K", "lam", "eta", "mu")}
DEFAULT_ROCK = ", ".join(f"{name} = {value:.4g}" for name, value in _CONTACTS.items())
Written = Mapping[str, str | Callable[[Path], object]]
Option = tuple[tuple[str, ...], dict[str, Any]]


class Command(NamedTuple):
    """A subcommand: its one-line purpose, an example that runs as printed, what it does with its
    options (it returns the exit status, None for success), and the options; or its own subcommands,
    which are called hosts.
    """

    name: str
    what: str
    example: str
    run: Callable[[argparse.Namespace], int | None]
    options: tuple[Option, ...] = ()
    parts: tuple["Command", ...] = ()


def option(*names: str, **settings: Any) -> Option:
    """An option or argument, as `add_argument` of argparse takes it."""
    return names, settings


def in_unit(unit: str, *, positive: bool = False) -> Callable[[str], float]:
    """Type of an option such as 10MPa: a function that reads its SI value.

    unit: "Pa", "m", "Pa/m" or "rad"; only zero may be given without one.
    """

    def read(text: str) -> float:
        try:
            return units.parse_option(text, unit, positive=positive)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return read


def several(unit: str, *, positive: bool = False) -> Callable[[str], list[float]]:
    """Type of an option such as 5MPa,20MPa: one quantity or several with commas between."""
    return lambda text: [in_unit(unit, positive=positive)(part) for part in text.split(",")]


LAW = (  # a preset or a file, and its resolution; `read_law` reads them
    option("law", metavar="PRESET_OR_FILE", help="preset name or TOML file"),
    option(
        "--default-rock",
        action="store_true",
        help="for a file without [asperity], such as that of a scan: " + DEFAULT_ROCK,
    ),
    option("--resolution", choices=tuple(NAMED), help="instead of the law's own"),
)
OUT = (  # the folder for the results
    option("--out", metavar="DIR", type=Path, required=True, help="folder for the results"),
    option(
        "--force", action="store_true", help="replace the results of another run in that folder"
    ),
)
PICTURES = option("--format", choices=FORMATS, default=FORMATS[0], help="of pictures (default png)")


def read_law(options: argparse.Namespace) -> Any:
    """The law that the options name. Raises ValueError that says what is missing."""
    path = Path(options.law)
    if options.law in presets.names() or not path.is_file():
        law = presets.load_any(options.law)
    else:
        parts = keys.read(path, "law file")
        coulomb = parts.get("kind") == "coulomb"
        if "asperity" not in parts and not options.default_rock and not coulomb:
            raise ValueError(
                f"{path} has no contacts: add the table [asperity] with K (Pa m^(1-eta)), lam, eta "
                f"and mu of your rock, or give --default-rock, which takes {DEFAULT_ROCK}"
            )
        own = {} if coulomb else {"asperity": _CONTACTS}
        law = JointLaw.from_dict(own | parts, str(path))
    require_rock({"plane": law.plane or 0.0}, f"{options.law}: ")
    if not isinstance(law, JointLaw):
        require_rock({"friction": law.friction}, f"{options.law}: ")
        return law
    require_rock({"mu": law.asperity.mu}, f"{options.law}: asperity.")
    return replace(law, resolution=options.resolution) if options.resolution else law


def write_results(
    folder: Path, files: Written, summary: Mapping[str, Any], picture_format: str
) -> None:
    """Write each file, its text or by its function, and summary.json.

    A picture is named as PNG and written in its format; without matplotlib it is left out.
    """
    clear_run(folder)
    names = []
    for name, content in files.items():
        path = folder / name.replace(".png", f".{picture_format}")
        try:
            if isinstance(content, str):
                replace_file(path, content.encode())
            else:
                content(path)
        except ImportError as error:
            print(f"no picture: {error}", file=sys.stderr)
        else:
            names.append(path.name)
    write_json(folder / "summary.json", {"version": VERSION, **summary, "files": names})
    print(f"wrote {', '.join([*names, 'summary.json'])} to {folder}")
