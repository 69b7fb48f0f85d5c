"""Export of a joint law to finite elements: MGIS and UMAT, OpenGeoSys and Kratos, in one folder."""

from pathlib import Path
from textwrap import fill

from ...laws.law import Law
from ...native.layout import jointlaw_h
from ...parameters.aperture import Aperture
from ...support.checks import number
from ...support.files import write_files
from .. import DEFAULT_SEATING
from ..c import export as c

MAX_TEST_STRESS = 2e6  # Pa: normal stress of the shear tests, at most


def export_fem(
    law: Law,
    directory: str | Path,
    name: str = "joint",
    seating: float = DEFAULT_SEATING,
    aperture: Aperture | None = None,
) -> list[str]:
    """Write all files that a finite-element code needs to run this joint; the folder may be copied.

    >>> names = jl.export_fem(law, "joint-for-fem")

    law: a law with shear; a law with a plane is for 2-D only. directory: created if missing; files
    of the same names are replaced. name: of the behaviours, an identifier of C; NAME is a cohesive
    zone, NAME_layer a thin layer of solid elements. seating: normal stress in Pa, > 0,
    of the joint before the first step, from which displacements count. aperture: its hydraulic
    aperture, `NAME_aperture` of `NAME.h`.

    Writes `jointlaw.h` and `jointlaw.c` (the law), `NAME.h` (its tables), `jointlaw_fem.h`,
    `mgis.c` and `umat.c` with a `Makefile`, direct shear tests for OpenGeoSys and Kratos, and
    `README.md`. Returns the names. Raises ValueError for an invalid law, name or seating, before
    anything is written.
    """
    if law.dim == 1:
        raise ValueError(
            "law.closure_only = True, but finite elements need shear: set closure_only=False"
        )
    if number("seating", seating) <= 0.0:
        raise ValueError(
            f"seating = {seating:g} Pa is out of bounds: it must be > 0. A joint without stress "
            "has no stiffness, so Newton's method cannot start from it under a prescribed force; "
            "take 10e3, or 1 if all displacements are prescribed"
        )
    c.require_name(name)
    texts = {
        "jointlaw.h": jointlaw_h(),
        "jointlaw.c": c.file_text("jointlaw.c"),
        f"{name}.h": c.header_text(law, name, aperture),
    }
    start = [*law.joint(normal_stress=seating).snapshot().values[0].tolist(), 1.0]
    names = [f'"State{i}"' for i in range(1, len(start))] + ['"Initialised"']
    normal = min(MAX_TEST_STRESS, 0.5 * float(law.normal_stress(law.closure_range)))
    shear = 5.0 * float(law.closure(normal))
    values = {  # of the @WORDS@ in the files
        "DIM": str(law.dim),
        "STATE": str(len(start)),
        "NAMES": fill(", ".join(names), 96).replace("\n", " \\\n"),
        "START": fill(", ".join(map(repr, start)), 96),
        "ZEROS": ", ".join(["0.0"] * len(start)),
        "SEATING": f"{seating:g}",
        "NORMAL": f"{normal:.3g}",
        "SHEAR": repr(shear),
        "BACK": repr(shear / 2),
    }
    for file in sorted(Path(__file__).with_name("files").iterdir()):
        # pip adds a folder with compiled Python
        if file.is_file() and (law.dim == 3 or "3d" not in file.name):
            text = file.read_text(encoding="utf-8")
            for word, value in values.items():
                text = text.replace(f"@{word}@", value)
            texts[file.name] = text.replace("granite", name)
    write_files(directory, texts)
    return list(texts)
