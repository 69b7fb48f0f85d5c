"""Parameter sets of the paper in SI units, each with its source and assumptions."""

import tomllib
from pathlib import Path

from ..laws.joint_law import JointLaw
from ..support.checks import one_of, remedy


def names() -> list[str]:
    """Names of all presets, sorted."""
    return sorted(path.stem for path in Path(__file__).parent.glob("*.toml"))


def text(name: str) -> str:
    """TOML text of a preset, with its source. Raises ValueError for an unknown name."""
    one_of("preset", name, tuple(names()))
    return Path(__file__).with_name(f"{name}.toml").read_text(encoding="utf-8")


def about(name: str) -> dict[str, str]:
    """Title, source and, where the paper leaves values open, assumptions of a preset."""
    return dict(tomllib.loads(text(name))["about"])


def load(name: str) -> JointLaw:
    """The law of a preset. Raises ValueError for an unknown name."""
    return JointLaw.from_dict(tomllib.loads(text(name)), f"preset {name!r}")


def load_any(name_or_file: str) -> JointLaw:
    """The law of a preset, or of a TOML file at this path. A preset takes precedence over a file.

    Raises ValueError for an unknown name, and for an invalid file.
    """
    if name_or_file in names():
        return load(name_or_file)
    if Path(name_or_file).is_file():
        return JointLaw.from_toml(Path(name_or_file))
    raise ValueError(
        f"{name_or_file!r} is neither a preset nor an existing TOML file: "
        f"{remedy(name_or_file, names(), 'the presets are')}"
    )
