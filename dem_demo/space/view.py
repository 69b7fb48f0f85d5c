"""Blocks in space as a page for the browser: they turn with the mouse, and move with the run.

The page needs no network and no library: `view.html` draws with WebGL what `scene_data` gives it.
"""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from .drawing import Drawing, Motion
from .pictures import STATE_COLOURS

VIEW = "view.html"
FRAGMENT = Path(__file__).parent / VIEW
DIGITS = 5  # of a place, relative to the size of what is drawn
MAX_FRAMES = 120
PULL_SHARE = 0.6  # of `Drawing.pull`, at the end of the slider
_DATA = '<script type="application/json">{}</script>'
_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>{title}</title>
<style>:root {{ color-scheme: light dark; }} h1 {{ font-size: 1.2rem; }}</style>
</head>
<body style="font-family: system-ui, sans-serif; max-width: 60rem; margin: auto; padding: 0 0.6rem">
<h1>{title}</h1>
{fragment}
</body>
</html>
"""


def scene_data(
    drawing: Drawing,
    text: str,
    label: str = "",
    motions: Sequence[Motion] = (),
    times: Sequence[float] = (0.0,),
) -> dict[str, Any]:
    """What the page draws of one scene, as numbers and lists for JSON.

    text: a sentence about the scene. label: on the button that shows it, where a page has several
    scenes. motions: places of the blocks, one a frame, by default as drawn; times: of the frames
    (s). Of many frames some are left out.
    """
    motions = list(motions) or [drawing.as_drawn]
    size = drawing.size

    def places(values: np.ndarray) -> list:
        digits = DIGITS - int(np.floor(np.log10(size))) - 1
        return (np.round(values, digits) + 0.0).tolist()

    vertices = np.concatenate([solid.vertices for solid in drawing.solids if solid])
    centre = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    chosen = np.linspace(0, len(motions) - 1, min(len(motions), MAX_FRAMES)).round().astype(int)
    ends = drawing.hatch.reshape(-1, 6)
    return {
        "title": drawing.title,
        "label": label or drawing.title,
        "text": text,
        "size": size,
        "centre": places(centre),
        "eye": drawing.view_direction.round(4).tolist(),
        "states": [{"name": name, "colour": colour} for name, colour in STATE_COLOURS.items()],
        "state": drawing.state.tolist(),
        "unstable": drawing.unstable.astype(int).tolist(),
        "centroid": places(drawing.centroid),
        "pull": places(drawing.pull),
        "pull_share": PULL_SHARE,
        "blocks": [
            solid and {"points": places(solid.vertices), "faces": solid.faces}
            for solid in drawing.solids
        ],
        "hatch": [
            [block, *points]
            for block, points in zip(drawing.hatch_block.tolist(), places(ends), strict=True)
        ],
        "frames": [_frame(motions[i], float(times[i]), places) for i in chosen.tolist()],
    }


def _frame(motion: Motion, time: float, places: Callable[[np.ndarray], list]) -> dict[str, Any]:
    """One frame: time (s), displacement and rotation of each block, None for a removed block, and
    the largest displacement (m)."""
    is_present = motion.is_present
    rotations = np.where(is_present[:, None, None], motion.rotation, np.eye(3))
    moved = places(np.nan_to_num(motion.displacement))
    return {
        "time": time,
        "displacement": [
            place if present else None for place, present in zip(moved, is_present, strict=True)
        ],
        "quaternion": Rotation.from_matrix(rotations).as_quat().round(6).tolist(),
        "largest": float(np.nanmax(motion.distances, initial=0.0)),
    }


def fragment(scenes: Sequence[dict[str, Any]], pull: float = 0.0) -> str:
    """Part of an HTML page that shows one scene, or the one that the reader chooses.

    scenes: of `scene_data`. pull: share of the way that the blocks are pulled apart at first.
    """
    data = json.dumps({"scenes": list(scenes)}, separators=(",", ":")).replace("<", "\\u003c")
    html = FRAGMENT.read_text(encoding="utf-8").replace(_DATA, _DATA.replace("{}", data))
    return html.replace('max="100" value="0"', f'max="100" value="{100 * pull:.0f}"')


def page(scenes: Sequence[dict[str, Any]]) -> str:
    """A page for the browser in one file."""
    title = scenes[0]["title"].replace("&", "&amp;").replace("<", "&lt;")
    return _PAGE.format(title=title, fragment=fragment(scenes))
