"""Strength reduction: how much weaker the joints of every rock may be, and how it then fails."""

from collections.abc import Iterator
from pathlib import Path

from jointlaw.support.pyplot import FORMATS

from ..dynamics.simulation import Simulation
from ..output import frames, rock_report
from ..output.outcome import far
from ..output.record import Record
from ..output.run import play
from ..scene import Scene, build, read_tables
from .compare import alone
from .limit import critical_tilt, reduced, strength_factor

SHOWN = 1.02  # times the factor: what the friction of the failing run is divided by


def strength_reduction(
    scene: Scene, until: float, folder: Path, picture_format: str = FORMATS[0]
) -> Iterator[dict]:
    """Factor and critical tilt of every rock alone, or of a scene without rocks; and a picture.

    The picture is of a run with friction divided by 1.02 times the factor, which ends at `until`
    (s) or once a block has moved by the size of a block. Yields `rock`, `factor`, `critical_tilt`
    (degrees) as `limit` gives them, and the `picture` in `folder`, None without a factor.
    """
    data = read_tables(scene.text)
    for table in data.get("rock", [None]):
        one = data if table is None else alone(data, table["name"])
        name = "scene" if table is None else table["name"]
        factor, picture = strength_factor(one, scene.files), None
        if factor is not None:
            picture = folder / f"failing-{name}.{picture_format}"
            title = f"{scene.title}; {name}, friction divided by {SHOWN * factor:.3g}"
            weak = {**reduced(one, SHOWN * factor, scene.files), "title": title}
            _show(build(weak, files=scene.files), until, picture)
        yield {
            "rock": name,
            "factor": factor,
            "critical_tilt": critical_tilt(one, scene.files),
            "picture": picture and picture.name,
        }


def _show(scene: Scene, until: float, path: Path) -> None:
    """Run a scene until a block has moved by its size, and draw it."""
    sim = Simulation(scene)
    record = Record(sim)
    play(sim, record, until, far)
    if record.scene.rocks:
        rock_report.report(record, path)
    else:
        frames.final(record, path, [])
