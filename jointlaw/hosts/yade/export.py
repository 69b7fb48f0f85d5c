"""Export of a joint law to YADE: table, law, adapter and script, in one folder."""

from pathlib import Path
from typing import Any

from ...laws.law import Law
from ...support.files import write_files, write_json
from ...tables import joint_table
from ...tables.joint_table import JointTable
from ...tables.tabulate import require_3d, tabulate

COPIED = ("yade_joint.py", "joint_table.py", "settle_and_incline.py", "README.md")


def export_yade(law: Law, directory: str | Path, **options: Any) -> JointTable:
    """Write all that an unmodified YADE needs to run this joint; the folder may be copied away.

    Parameters
    ----------
    law: a law in 3-D (`plane=None`).
    directory: folder to write to; made if missing, files of the same names are replaced.
    options: of the table, as in `tabulate`.

    Writes `joint.txt` (the table), `law.toml` (for live mode), `yade_joint.py` with
    `joint_table.py` (the adapter: YADE and numpy alone), the script `settle_and_incline.py`,
    `README.md` and `summary.json`. Returns the table. Raises ValueError for a law or option that
    cannot be tabulated, before anything is written.

    >>> table = jl.export_yade(law, "joint-for-yade", tolerance=1e-2, azimuths=4)
    """
    require_3d(law, "motion in YADE")
    table = tabulate(law, **options)
    report = table.report(law)
    folder = write_files(directory, {"law.toml": law.to_toml()})
    table.save(folder / "joint.txt")
    copy_files(folder)
    summary = {
        "version": 1,
        "files": ["joint.txt", "law.toml", *COPIED],
        "table": {k: v for k, v in table.metadata.items() if k != "law"},
        "dropped_by_the_table": {name: error._asdict() for name, error in report.items()},
    }
    write_json(folder / "summary.json", summary)
    return table


def copy_files(folder: Path) -> None:
    """Copy the adapter, the table that it needs, and the script."""
    own, table = Path(__file__).with_name("files"), Path(joint_table.__file__)
    sources = (table if name == table.name else own / name for name in COPIED)
    write_files(folder, {source.name: source.read_bytes() for source in sources})
