"""The pictures and the page for the browser of an equilibrium and of a run, as files."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..dynamics.relaxation import Verdict
from .drawing import Drawing, Motion
from .pictures import JOINTS_PULL, SpacePictures, has_pyvista
from .statics import Statics
from .view import VIEW, page, scene_data

if TYPE_CHECKING:
    from .record import SpaceRecord

Drawings = dict[str, Callable[[Path], None]]


def equilibrium_drawings(
    statics: Statics, unstable: np.ndarray, verdict: str, picture_format: str
) -> Drawings:
    """Functions that draw an equilibrium into a file, by the name of the file.

    unstable (n,): blocks without static equilibrium; verdict: of the search. view.html turns with
    the mouse. With pyvista also pictures: the verdict on each block, and the joints of a scene with
    rough directions, its blocks pulled apart.
    """
    drawing = _drawing(statics, unstable, verdict)
    text = f"Static analysis: {verdict}."
    drawings: Drawings = {VIEW: lambda path: _write_page(scene_data(drawing, text), path)}
    if has_pyvista():
        drawings |= _start_drawings(drawing, verdict, picture_format)
    return drawings


def run_drawings(record: "SpaceRecord", picture_format: str) -> Drawings:
    """Functions that draw a run into a file, by the name of the file.

    view.html turns with the mouse and plays the run. With pyvista also pictures: the start as
    `equilibrium_drawings` shows it, the displacements at the end, and the run as an animation.
    """
    drawing, motions = drawing_of_run(record)
    outcome = f"{record.times[-1]:.3g} s of motion after a start {record.verdict}."
    view = partial(scene_data, drawing, outcome, motions=motions, times=record.times)
    drawings: Drawings = {VIEW: lambda path: _write_page(view(), path)}
    if not has_pyvista():
        return drawings
    drawings |= _start_drawings(drawing, record.verdict, picture_format)
    pictures = SpacePictures(drawing, motions, by="displacement", mark="unstable at the start")
    note = f"t = {record.times[-1]:.2f} s"
    drawings[f"final.{picture_format}"] = lambda path: pictures.write(path, note)
    drawings["motion.gif"] = lambda path: pictures.animation(path, record.times)
    return drawings


def drawing_of_run(record: "SpaceRecord") -> tuple[Drawing, list[Motion]]:
    """The drawing of a run, and the places of its blocks in each frame."""
    statics = Statics(record.scene)
    drawing = _drawing(statics, record.unstable, record.verdict)
    motions = [
        Motion(
            record.motion[i][:3].T - drawing.centroid,
            record.axes[i] @ statics.surfaces.rotation.swapaxes(1, 2),
            np.linalg.norm(record.displacements(i), axis=1),
        )
        for i in range(len(record.times))
    ]
    return drawing, motions


def _drawing(statics: Statics, unstable: np.ndarray, verdict: str) -> Drawing:
    return Drawing(statics, unstable, verdict != Verdict.NOT_DECIDED.value)


def _start_drawings(drawing: Drawing, verdict: str, picture_format: str) -> Drawings:
    """Functions that draw the state at the start, and the joints."""
    start = SpacePictures(drawing, with_hatching=False)
    drawings: Drawings = {f"start.{picture_format}": lambda path: start.write(path, verdict)}
    if len(drawing.hatch):
        apart = SpacePictures(drawing, [drawing.pulled_apart(JOINTS_PULL)])
        note = "pulled apart to show the joints"
        drawings[f"joints.{picture_format}"] = lambda path: apart.write(path, note)
    return drawings


def _write_page(scene: dict, path: Path) -> None:
    path.write_text(page([scene]), encoding="utf-8")
