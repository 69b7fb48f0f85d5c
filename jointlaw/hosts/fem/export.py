"""Export of a joint law to finite elements: MGIS and UMAT, OpenGeoSys and Kratos, in one folder."""

from importlib import resources
from pathlib import Path
from textwrap import fill

from ...law import JointLaw
from ...support.checks import number
from ...support.files import replace_file
from ..c import export as c
from . import opengeosys

FILES = ("jointlaw_fem.h", "mgis.c", "umat.c", "Makefile", "kratos.py", "README.md")
SEATING = 10e3  # Pa
NORMAL = 2e6  # Pa: of the direct shear tests
YOUNG, POISSON = 50e9, 0.2  # of the rock: Pa, -
THICKNESS = 1e-3  # m: of the layer that stands for the joint


def export_fem(
    law: JointLaw, directory: str | Path, name: str = "joint", seating: float = SEATING
) -> list[str]:
    """Write all that a finite-element code needs to run this joint; the folder may be copied away.

    law: a law that shears; with a plane it is for 2-D alone. directory: made if missing; files of
    the same names are replaced. name: of the behaviours, an identifier of C; NAME is a cohesive
    zone, NAME_layer a thin layer of solid elements. seating: normal stress in Pa, > 0, of the
    joint before the first step; its displacements count from there.

    Writes `jointlaw.h` (the law), `NAME.h` (its tables), `jointlaw_fem.h`, `mgis.c` and `umat.c`
    with a `Makefile`, direct shear tests for OpenGeoSys and Kratos, and `README.md`. Returns the
    names. Raises ValueError for a law, name or seating that does not fit, before anything is
    written.
    """
    if law.closure_only:
        raise ValueError("law.closure_only = True: finite elements shear; set closure_only=False")
    if number("seating", seating) <= 0.0:
        raise ValueError(
            f"seating = {seating:g} Pa is out of bounds: it must be > 0. A joint without stress "
            "has no stiffness, so that under a given force the first step of Newton's method has "
            "no end; take 10e3, or 1 where all displacements are given"
        )
    c.require_name(name)
    tables = c.header_text(law, name)
    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    marks = _marks(law, seating)
    texts = {"jointlaw.h": (Path(c.include_dir()) / "jointlaw.h").read_text(encoding="utf-8")}
    texts |= {f"{name}.h": tables} | {file: _filled(file, name, marks) for file in FILES}
    for dim in range(2, law.dim + 1):
        zeros = " ".join(["0"] * dim)
        more = {"D": str(dim), "ZEROS": zeros, "BOUNDARIES": opengeosys.boundaries(dim)}
        texts[f"opengeosys_{dim}d.prj"] = _filled("opengeosys.prj", name, marks | more)
        texts |= opengeosys.meshes(dim, THICKNESS)
    for file, text in texts.items():
        replace_file(folder / file, text.encode())
    return list(texts)


def _filled(file: str, name: str, marks: dict[str, str]) -> str:
    """A file of this package for the joint of this name, with values for its @WORDS@."""
    text = (resources.files(__package__) / "files" / file).read_text(encoding="utf-8")
    for mark, value in marks.items():
        text = text.replace(f"@{mark}@", value)
    return text.replace("granite", name)


def _marks(law: JointLaw, seating: float) -> dict[str, str]:
    """What stands for the @WORDS@ of all files."""
    start = [*law.joint(normal_stress=seating).snapshot().values[0].tolist(), 1.0]
    names = [f'"State{i}"' for i in range(1, len(start))] + ['"Begun"']
    shear = 5.0 * float(law.closure(NORMAL))
    return {
        "DIM": str(law.dim),
        "STATE": str(len(start)),
        "NAMES": fill(", ".join(names), 96).replace("\n", " \\\n"),
        "START": fill(", ".join(map(repr, start)), 96),
        "SEATING": f"{seating:g}",
        "NORMAL": f"{NORMAL:g}",
        "SHEAR": repr(shear),
        "BACK": repr(shear / 2),
        "YOUNG": f"{YOUNG:g}",
        "POISSON": f"{POISSON:g}",
        "THICKNESS": f"{THICKNESS:g}",
    }
