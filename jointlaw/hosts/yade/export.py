"""Export of a joint law to YADE: table, law, adapter and scripts, in one folder."""

import math
from importlib import resources
from pathlib import Path
from typing import Any

from ... import tables
from ...law import JointLaw
from ...support.files import replace_file, write_json
from ...tables.table import JointTable
from ...tables.tabulate import require_3d, tabulate

ADAPTER = ("yade_joint.py", "table_law.py")
SCRIPTS = ("direct_shear.py", "settle_and_incline.py", "assembly.py")
DEFAULT_LIMIT = 10.0  # shear limit over closure range, where the law has no critical slip


def export_yade(
    law: JointLaw, directory: str | Path, table: JointTable | None = None, **options: Any
) -> JointTable:
    """Write all that an unmodified YADE needs to run this joint; the folder may be copied away.

    Parameters
    ----------
    law: a law in 3-D (`plane=None`).
    directory: folder to write to; made if missing, files of the same names are replaced.
    table: a table of this law; made with `tabulate(law, **options)` by default. Where the
        critical slip is infinite and no `shear_limit` is given, friction is read at a shear of ten
        closure ranges; the table's metadata state it.

    Writes `joint.txt` and `joint.npz` (the table), `law.toml` (for live mode), `yade_joint.py` with
    `table_law.py` (the adapter: YADE and numpy alone), the scripts and `summary.json`. Returns the
    table. Raises ValueError for a law or option that cannot be tabulated and for a table of another
    law, before anything is written.
    """
    require_3d(law)
    if table is None:
        if "shear_limit" not in options and math.isinf(law.critical_slip):
            options["shear_limit"] = DEFAULT_LIMIT * law.closure_range
        table = tabulate(law, **options)
    elif options:
        raise ValueError(f"{', '.join(options)}: give a table or options for one, not both")
    elif table.metadata.get("law") != law.to_toml():
        raise ValueError(
            "table is of another law: joint.txt and law.toml would differ; give the law that its "
            'metadata["law"] holds, or leave the table out'
        )
    report = table.report(law)
    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    table.save(folder / "joint.txt")
    table.save(folder / "joint.npz")
    law.to_toml(folder / "law.toml")
    copy_adapter(folder)
    summary = {
        "version": 1,
        "files": ["joint.txt", "joint.npz", "law.toml", *ADAPTER, *SCRIPTS],
        "table": {k: v for k, v in table.metadata.items() if k != "law"},
        "dropped_by_the_table": report.as_dict(),
    }
    write_json(folder / "summary.json", summary)
    return table


def copy_adapter(folder: Path) -> None:
    """Copy the adapter, the table law that it needs, and the scripts."""
    own, table_law = resources.files(__package__) / "files", resources.files(tables)
    for name in (*ADAPTER, *SCRIPTS):
        source = table_law if name == "table_law.py" else own
        replace_file(folder / name, (source / name).read_bytes())
