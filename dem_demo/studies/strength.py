"""Strength reduction: how much weaker the joints of every rock may be, and how it then fails."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from jointlaw.support.pyplot import FORMATS

from ..dynamics.simulation import Simulation
from ..output import frames, rock_report
from ..output.record import Record
from ..output.run import play
from ..scene import Scene, build, read_tables
from .compare import FAR, alone
from .limit import critical_tilt, reduced, strength_factor

SHOWN = 1.02  # times the factor: what the friction of the failing run is divided by


def strength_reduction(
    scene: Scene, where: str, until: float, folder: Path, picture_format: str = FORMATS[0]
) -> Iterator[dict]:
    """Factor and critical tilt of every rock alone, or of a scene without rocks; and a picture.

    The picture is of a run with friction divided by 1.02 times the factor, which ends at `until`
    (s) or once a block has moved 1 m. Yields `rock`, `factor`, `critical_tilt` (degrees) as
    `limit` gives them, and the `picture` in `folder`, None without a factor.
    """
    data = read_tables(scene.text, where)
    for table in data.get("rock", [None]):
        one = data if table is None else alone(data, table["name"])
        name = "scene" if table is None else table["name"]
        factor, picture = strength_factor(one, where), None
        if factor is not None:
            picture = folder / f"failing-{name}.{picture_format}"
            title = f"{scene.title}; {name}, friction divided by {SHOWN * factor:.3g}"
            _show({**reduced(one, SHOWN * factor), "title": title}, where, until, picture)
        yield {
            "rock": name,
            "factor": factor,
            "critical_tilt": critical_tilt(one, where),
            "picture": picture and picture.name,
        }


def _show(data: dict[str, Any], where: str, until: float, path: Path) -> None:
    """Run a scene until a block has moved 1 m, and draw it."""
    sim = Simulation(build(data, where))
    record = Record(sim)
    play(sim, record, until, lambda record: record.moved.max() > FAR)
    if record.scene.rocks:
        rock_report.report(record, path)
    else:
        frames.final(record, path, [])
