"""Factor of safety of blocks in space, and the blocks that fail first."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..output.record import format_blocks, list_blocks
from ..studies.strength import LOG_FACTOR, SHOWN_REDUCTION, STRENGTHENED, LimitSearch, Trials
from .drawing import Drawing
from .pictures import SpacePictures
from .scene import SpaceScene
from .statics import Statics


def factor_of_safety(
    statics: Statics,
    trials: Trials | None = None,
    name: str = "scene",
    excluded: np.ndarray | None = None,
    tolerance: float = LOG_FACTOR.tolerance,
) -> float | None:
    """Compute the factor by which the strength of all joints is divided at limit equilibrium.

    Strength is the shear stress that a joint can carry at its own normal stress. trials: finished
    trials, under `name`. excluded (n,): blocks that need no equilibrium. tolerance: of the factor,
    relative.

    Returns None if the scene is in equilibrium with 1/64 of its strength, or has no equilibrium
    with 64 times of it.
    """
    scene = statics.scene

    def solve(log_factor: float, guess: np.ndarray | None) -> np.ndarray | None:
        return statics.displacements(scene.weakened(float(np.exp(log_factor))), guess, excluded)

    with LimitSearch(solve, trials or Trials(scene), f"{name}: factor of safety") as search:
        log_factor = search.upwards(LOG_FACTOR._replace(tolerance=tolerance))
    return None if log_factor is None else float(np.exp(log_factor))


def strength_reduction(
    scene: SpaceScene,
    folder: Path | None,
    tell: Callable[[str], None],
    picture_format: str | None = None,
) -> dict[str, Any]:
    """Compute the factor of safety of a scene, after all excavation stages and with its last water
    table.

    folder: for finished trials; called again with it, the search continues. tell: called with each
    line of progress. picture_format: of `initiating.FORMAT` in the folder, a picture of the blocks
    that fail first, which needs pyvista; None for no picture.

    Returns a row. `unstable`: names and centroids (m) of blocks without static equilibrium.
    `excluded`: the same blocks, or if all blocks are unstable, only blocks that are unstable with
    twice the strength too. `factor_of_safety`: of all blocks. `factor_without_excluded`: of all
    other blocks, while the excluded ones move away, if some are excluded. `initiating_blocks`:
    blocks without equilibrium when the strength is divided by 1.02 times the factor, none of them
    excluded. A number is None where none is found.
    """
    trials = Trials(scene, folder)
    scene = scene.excavated
    statics = Statics(scene)
    tell("searching unstable blocks")
    unstable = trials.result("unstable", partial(_unstable_blocks, statics, scene))
    count = int(statics.is_free.sum())
    tell(f"{len(unstable)} of {count} blocks are unstable")
    excluded = unstable
    if len(unstable) == count:
        stronger = scene.weakened(1 / STRENGTHENED)
        excluded = trials.result(
            f"unstable at strength * {STRENGTHENED:g}", partial(_unstable_blocks, statics, stronger)
        )
        tell(f"{len(excluded)} blocks stay unstable at strength x {STRENGTHENED:g}")
    names = [block["block"] for block in excluded]
    is_excluded = np.isin([block.name for block in scene.blocks], names)
    tell("factor of safety of all blocks")
    row: dict[str, Any] = {"rock": scene.title, "unstable": unstable, "excluded": excluded}
    factor = row["factor_of_safety"] = factor_of_safety(statics, trials)
    if 0 < len(excluded) < count:
        tell(f"factor of safety without {len(excluded)} unstable blocks")
        factor = row["factor_without_excluded"] = factor_of_safety(
            statics, trials, "without unstable blocks", is_excluded
        )
    row["initiating_blocks"] = []
    if factor:
        weak = scene.weakened(SHOWN_REDUCTION * factor)
        failing = trials.result(
            f"unstable at {SHOWN_REDUCTION:g} times the factor",
            partial(_unstable_blocks, statics, weak),
        )
        row["initiating_blocks"] = [block for block in failing if block["block"] not in names]
        tell(f"initiating blocks: {format_blocks(row['initiating_blocks'])}")
        if folder and picture_format and row["initiating_blocks"]:
            path = folder / f"initiating.{picture_format}"
            _draw_initiating(statics, row, factor, path)
    return row


def _draw_initiating(statics: Statics, row: dict[str, Any], factor: float, path: Path) -> None:
    """Draw the initiating blocks of a row of `strength_reduction` among all blocks."""
    names = [block.name for block in statics.scene.blocks]
    unstable, initiating = (
        np.isin(names, [block["block"] for block in row[key]])
        for key in ("unstable", "initiating_blocks")
    )
    pictures = SpacePictures(
        Drawing(statics, unstable), marked=initiating, mark="initiating block", with_hatching=False
    )
    pictures.write(path, f"factor of safety {factor:.3g}")


def _unstable_blocks(statics: Statics, scene: SpaceScene) -> list[dict[str, Any]]:
    """List the blocks without static equilibrium, with the laws and reduction of a scene."""
    return list_blocks(scene, statics.solve(scene).unstable)
