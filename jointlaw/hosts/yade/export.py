"""Export of a joint law to YADE: table, law, adapter and script, in one folder."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ...laws.law import Law
from ...parameters.aperture import Aperture
from ...parameters.toml import text_or_reason
from ...support.files import write_files, write_json
from ...tables import joint_table
from ...tables.joint_table import JointTable
from ...tables.tabulate import require_3d, tabulate

COPIED = ("yade_joint.py", "joint_table.py", "settle_and_incline.py", "README.md")


def export_yade(
    law: Law, directory: str | Path, aperture: Aperture | None = None, **options: Any
) -> JointTable:
    """Write all files that an unmodified YADE needs to run this joint; the folder may be copied.

    Parameters
    ----------
    law: a law in 3-D (`plane=None`).
    directory: folder to write to; created if missing, files of the same names are replaced.
    aperture: its hydraulic aperture; the metadata of the table and `law.toml` hold its numbers.
    options: of the table, as in `tabulate`.

    Writes `joint.txt` (the table), `law.toml` (for live mode), `yade_joint.py` with
    `joint_table.py` (the adapter: YADE and numpy alone), the script `settle_and_incline.py`,
    `README.md` and `summary.json`. There is no `law.toml` for a law with a parameter of a class of
    your own: live mode then takes the law itself, `LiveLaw(law)`. Returns the table. Raises
    ValueError for a law or option that cannot be tabulated, before anything is written.

    >>> table = jl.export_yade(law, "joint-for-yade", tolerance=1e-2, azimuths=4)
    """
    require_3d(law, "motion in YADE")
    table = tabulate(law, **options)
    if aperture:
        table = replace(table, metadata={**table.metadata, "aperture": asdict(aperture)})
    report = table.report(law)
    parameters, _ = text_or_reason(law, aperture)
    law_file = {"law.toml": parameters} if parameters else {}
    folder = write_files(directory, law_file)
    if not law_file:  # one from an earlier export is of another law
        (folder / "law.toml").unlink(missing_ok=True)
    table.save(folder / "joint.txt")
    copy_files(folder)
    summary = {
        "version": 1,
        "files": ["joint.txt", *law_file, *COPIED],
        "table": {k: v for k, v in table.metadata.items() if k != "law"},
        "dropped_by_the_table": {name: error._asdict() for name, error in report.items()},
    }
    write_json(folder / "summary.json", summary)
    return table


def describe_table(table: JointTable, law: Law) -> str:
    """Message of the export command: size, content and largest errors of the exported table."""
    angle_error = table.metadata["resolution_error_friction_angle"]
    return (
        f"wrote the joint for YADE: a table of {len(table.closure)} rows, law, adapter, script\n"
        f"error of the friction angle at the shear limit, against a finer resolution: "
        f"{angle_error:.2g} deg\n"
        f"bond: {table.metadata['bond']}\n"
        "largest errors of the table against the law, in % of the largest traction of each path:\n"
        f"{table.report(law)}"
    )


def copy_files(folder: Path) -> None:
    """Copy the adapter, the module of its table, and the script into the folder."""
    files_folder = Path(__file__).with_name("files")
    table_module = Path(joint_table.__file__)
    sources = [files_folder / name for name in COPIED if name != table_module.name]
    write_files(folder, {source.name: source.read_bytes() for source in [*sources, table_module]})
