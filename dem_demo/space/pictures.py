"""Pictures of blocks in space, by pyvista (extra `view`), which is loaded when they are drawn.

Solids are drawn by pyvista, without a screen; titles, legends, scale bar and compass by matplotlib,
in the style of all pictures. The projection is parallel, so the scale bar holds at any depth.
"""

import os
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from jointlaw.support.pyplot import escape_math, style, written

from ..output.pictures import (
    DISPLACEMENT_COLOURS,
    MARKED_COLOUR,
    MAX_COLOUR_RATIO,
    MIN_DISTANCE,
    length_unit,
    write_animation,
)
from ..output.record import FAILURE_DISPLACEMENT
from .drawing import Drawing, Motion

#: Sentence for a user who has no pyvista
MISSING = "no pictures of blocks in space: they need pyvista: pip install 'jointlaw[view]'"
STATE_COLOURS = {  # distinguishable with any colour vision
    "fixed": "#c9cdd2",
    "stable": "#1b8a6b",
    "unstable": "#d55e00",
    "not decided": "#f0d442",
}
ROUGH_COLOUR = "#1f3f8f"
EDGE_COLOUR = "#404040"
PIXELS = 2000  # of the longer side of the rendered solids
ANIMATION_PIXELS = 700
LINE_WIDTH = 1 / 450  # of an edge, over the longer side of the picture
WIDTH = 7.5  # inches of a figure
TITLE_HEIGHT = 0.45  # inches
LEGEND_HEIGHT = 0.3  # inches, of a row
BAR_HEIGHT = 0.75  # inches, of the colour bar with its label
LEGEND_COLUMNS = 3
FOOT = 0.12  # of the height: room for scale bar and compass below the solids
NICE_LENGTHS = 1.0, 2.0, 5.0, 10.0
JOINTS_PULL = 0.35  # share of the distance from the fixed rock, to show the joints


def has_pyvista() -> bool:
    """Whether pictures of blocks in space can be drawn."""
    return find_spec("pyvista") is not None


def import_pyvista() -> Any:
    """Import and return pyvista. Raises ImportError with the remedy where it is missing."""
    try:
        # without a screen VTK would try X first, and print that there is none
        if "DISPLAY" not in os.environ:
            os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
        import pyvista
    except ImportError as error:
        raise ImportError(MISSING) from error
    return pyvista


def nice_length(length: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above a length."""
    power = 10.0 ** np.floor(np.log10(length))
    return power * max(step for step in NICE_LENGTHS if step * power <= length * (1 + 1e-9))


def colour_limit(distances: np.ndarray, size: float) -> tuple[float, bool]:
    """Displacement (m) at the end of the colours, and whether failed blocks have moved farther.

    distances (n,) in m, of free blocks; size: their median size (m). As in the plane, a block that
    has failed does not set the scale of blocks that have moved by millimetres.
    """
    largest = max(float(distances.max(initial=0.0)), MIN_DISTANCE)
    remaining = distances[distances <= FAILURE_DISPLACEMENT * size]
    of_remaining = max(float(remaining.max(initial=0.0)), MIN_DISTANCE)
    is_clipped = len(remaining) > 0 and largest > MAX_COLOUR_RATIO * of_remaining
    return (of_remaining if is_clipped else largest), is_clipped


class SpacePictures:
    """Draws one or more places of the blocks of a drawing, all to one scale.

    drawing: shapes and states. motions: places of the blocks, one a frame; by default one, as
    drawn. title: of the drawing, unless another one is given. by: what colours the blocks, "state"
    or "displacement". marked (n,): blocks whose edges are drawn thick, by default the unstable
    ones, and `mark`, their name in the legend. with_hatching: whether rough directions are drawn.

    eye (3,): unit vector to the eye; right, up (3,): unit vectors of the picture; low, high (2,):
    the visible range along them (m). foot (m): room below it. max_distance (m): at the end of the
    colours.
    """

    def __init__(
        self,
        drawing: Drawing,
        motions: Sequence[Motion] = (),
        title: str | None = None,
        by: str = "state",
        marked: np.ndarray | None = None,
        mark: str = "unstable block",
        with_hatching: bool = True,
    ) -> None:
        self.drawing = drawing
        self.motions = list(motions) or [drawing.as_drawn]
        self.title = title or drawing.title
        self.by = by
        self.marked = drawing.unstable if marked is None else marked
        self.mark = mark
        self.has_hatching = with_hatching and len(drawing.hatch) > 0
        self.eye = drawing.view_direction
        self.right = np.cross([0.0, 0.0, 1.0], self.eye)
        self.right /= np.linalg.norm(self.right)
        self.up = np.cross(self.eye, self.right)
        distances = self.motions[-1].distances[drawing.is_free]
        distances = distances[np.isfinite(distances)]
        solids = [drawing.solids[i] for i in np.flatnonzero(drawing.is_free)]
        size = float(np.median([solid.size for solid in solids])) if solids else drawing.size
        self.largest_distance = float(distances.max(initial=0.0))
        self.max_distance, self.is_clipped = colour_limit(distances, size)
        self.length_factor, self.length_unit = length_unit(self.max_distance)
        ends = [self._project(self._vertices(motion)) for motion in self._extremes()]
        plane = np.concatenate(ends)
        low, high = np.nanmin(plane, axis=0), np.nanmax(plane, axis=0)
        margin = 0.02 * (high - low).max()
        self.low, self.high = low - margin, high + margin
        width, height = self.high - self.low
        self.foot = FOOT * max(height, 0.7 * width)

    def _extremes(self) -> list[Motion]:
        """The first and the last place; blocks that are far away by then where they started.

        A block that has fallen far may leave the picture, so that the rock fills it.
        """
        last = self.motions[-1]
        distances = np.linalg.norm(last.displacement, axis=1)
        is_far = distances > self.drawing.free_extent
        near = np.where(is_far[:, None], 0.0, last.displacement)
        return [self.motions[0], Motion(near, last.rotation)]

    def _vertices(self, motion: Motion) -> np.ndarray:
        """Vertices (v, 3) of all drawn solids now."""
        solids = [(i, solid) for i, solid in enumerate(self.drawing.solids) if solid]
        block = np.concatenate([np.full(len(solid.vertices), i) for i, solid in solids])
        points = np.concatenate([solid.vertices for _, solid in solids])
        return motion.place(block, self.drawing.centroid, points)

    def _project(self, points: np.ndarray) -> np.ndarray:
        """Places (m, 2) of points (m, 3) in the picture."""
        return points @ np.stack([self.right, self.up], axis=1)

    # ------------------------------------------------------------------------- solids, by pyvista

    def plotter(self, i: int, pixels: int = PIXELS) -> Any:
        """A pyvista plotter with frame i; its actors are "blocks", "edges", and, where there are
        any, "marked" and "rough direction".

        Cells have the number `block`; the cells of "blocks" also `state` and `displacement (UNIT)`.
        pixels: of the longer side.
        """
        pv = import_pyvista()
        drawing, motion = self.drawing, self.motions[i]
        width, height = self.high - self.low
        scale = pixels / max(width, height)
        plotter = pv.Plotter(
            off_screen=True, window_size=(round(scale * width), round(scale * height))
        )
        plotter.enable_anti_aliasing("ssaa")
        plotter.remove_all_lights()
        light = self.eye + 0.5 * self.up - 0.45 * self.right
        plotter.add_light(pv.Light(position=light, light_type="scene light"))
        line_width = max(pixels * LINE_WIDTH, 1.0)
        self._add_blocks(pv, plotter, motion)
        block, ends = drawing.edges
        is_present = motion.is_present
        block, ends = block[is_present[block]], ends[is_present[block]]
        lines = self._lines(pv, block, ends, motion)
        plotter.add_mesh(lines, color=EDGE_COLOUR, line_width=line_width, name="edges")
        thick = {"line_width": 2.5 * line_width, "lighting": False}
        is_marked = self.marked[block]
        if is_marked.any():
            outlined = self._lines(pv, block[is_marked], ends[is_marked], motion, 2)
            plotter.add_mesh(outlined, color=MARKED_COLOUR, name="marked", **thick)
        if self.has_hatching:
            is_drawn = is_present[drawing.hatch_block]
            hatching = self._lines(
                pv, drawing.hatch_block[is_drawn], drawing.hatch[is_drawn], motion
            )
            plotter.add_mesh(
                hatching, color=ROUGH_COLOUR, line_width=1.5 * line_width, name="rough direction"
            )
        centre = 0.5 * (self.low + self.high) @ np.stack([self.right, self.up])
        far = 10 * drawing.size
        plotter.camera.parallel_projection = True
        plotter.camera.focal_point = centre
        plotter.camera.position = centre + far * self.eye
        plotter.camera.up = (0.0, 0.0, 1.0)
        plotter.camera.parallel_scale = 0.5 * height
        plotter.camera.clipping_range = (0.1, 3 * far)
        return plotter

    def _add_blocks(self, pv: Any, plotter: Any, motion: Motion) -> None:
        """Add the faces of all blocks, coloured."""
        drawing = self.drawing
        faces, block, start = [], [], 0
        for i, solid in enumerate(drawing.solids):
            if solid is None:
                continue
            for face in solid.faces if motion.is_present[i] else ():
                faces += [len(face), *(start + vertex for vertex in face)]
                block.append(i)
            start += len(solid.vertices)
        vertices = np.nan_to_num(self._vertices(motion))  # no face uses the ones of removed blocks
        mesh = pv.PolyData(vertices, faces=faces)
        mesh.cell_data["block"] = block
        mesh.cell_data["state"] = drawing.state[block]
        distances = motion.distances
        name = f"displacement ({self.length_unit})"
        mesh.cell_data[name] = self.length_factor * distances[block]
        colours = ListedColormap(list(STATE_COLOURS.values()))
        look = {"scalars": "state", "cmap": colours, "clim": (-0.5, len(STATE_COLOURS) - 0.5)}
        if self.by == "displacement":
            # fixed rock is grey: it has the colour below the scale
            mesh.cell_data["state"] = drawing.state[block]
            values = mesh.cell_data[name].copy()
            values[~drawing.is_free[block]] = -1.0
            mesh.cell_data["coloured by"] = values
            limit = self.length_factor * self.max_distance
            look = {"scalars": "coloured by", "cmap": DISPLACEMENT_COLOURS, "clim": (0.0, limit)}
            look["below_color"] = STATE_COLOURS["fixed"]
        plotter.add_mesh(
            mesh, show_scalar_bar=False, ambient=0.5, diffuse=0.52, specular=0.0,
            smooth_shading=False, name="blocks", **look,
        )  # fmt: skip

    def _lines(
        self, pv: Any, block: np.ndarray, ends: np.ndarray, motion: Motion, layer: int = 1
    ) -> Any:
        """Segments (m, 2, 3), fixed to blocks (m,), somewhat before the faces that bear them.

        The projection is parallel, so a shift towards the eye changes no place in the picture.
        """
        points = motion.place(np.repeat(block, 2), self.drawing.centroid, ends.reshape(-1, 3))
        points = points + 1e-3 * layer * self.drawing.size * self.eye
        m = len(block)
        cells = np.column_stack([np.full(m, 2), np.arange(2 * m).reshape(m, 2)])
        mesh = pv.PolyData(points, lines=cells.ravel())
        mesh.cell_data["block"] = block
        return mesh

    def render(self, i: int, pixels: int = PIXELS) -> np.ndarray:
        """Image (rows, columns, 4) of the solids of frame i."""
        plotter = self.plotter(i, pixels)
        try:
            return plotter.screenshot(None, transparent_background=True, return_img=True)
        finally:
            plotter.close()

    # ---------------------------------------------------------------------- frame, by matplotlib

    def figure(self) -> tuple[Figure, Axes]:
        """Create an empty frame with legend, and colour bar where colours are displacements."""
        width, height = self.high - self.low
        inches = WIDTH * (height + self.foot) / width
        bar = BAR_HEIGHT if self.by == "displacement" else 0.0
        handles = self._legend()
        rows = -(-len(handles) // LEGEND_COLUMNS)
        size = WIDTH, inches + TITLE_HEIGHT + LEGEND_HEIGHT * rows + bar
        figure = Figure(figsize=size)
        figure.legend(
            handles=handles, loc="outside lower center", ncols=LEGEND_COLUMNS, frameon=False
        )
        axes = figure.add_subplot()
        if self.by == "displacement":
            label = f"displacement since the start ({self.length_unit})"
            if self.is_clipped:
                label += f", failed blocks beyond the scale: up to {self.largest_distance:.2g} m"
            scale = Normalize(0.0, self.length_factor * self.max_distance)
            figure.colorbar(
                ScalarMappable(scale, DISPLACEMENT_COLOURS), ax=axes, location="bottom",
                aspect=50, pad=0.02, label=label, extend="max" if self.is_clipped else "neither",
            )  # fmt: skip
        return figure, axes

    @property
    def _outlines_unstable(self) -> bool:
        """Whether the outlined blocks are the unstable ones."""
        return bool((self.marked == self.drawing.unstable).all())

    def _legend(self) -> list[Patch | Line2D]:
        """Handles of the legend: states with the numbers of blocks, outlines, rough direction."""
        drawing = self.drawing
        entries: list[Patch | Line2D] = []
        if self.by == "state":
            for number, (name, colour) in enumerate(STATE_COLOURS.items()):
                count = int((drawing.state == number).sum())
                if count:
                    label = f"{name}: {count} block{'s'[: count > 1]}"
                    is_outlined = self._outlines_unstable and name in ("unstable", "not decided")
                    edge = MARKED_COLOUR if is_outlined else EDGE_COLOUR
                    width = 2.0 if is_outlined else 0.8
                    patch = Patch(facecolor=colour, edgecolor=edge, lw=width, label=label)
                    entries.append(patch)
        elif not drawing.is_free.all():
            fixed = STATE_COLOURS["fixed"]
            entries.append(Patch(facecolor=fixed, edgecolor=EDGE_COLOUR, label="fixed"))
        if self.marked.any() and not (self.by == "state" and self._outlines_unstable):
            entries.append(Line2D([], [], color=MARKED_COLOUR, lw=2.5, label=self.mark))
        if self.has_hatching:
            label = "rough direction of the joints"
            entries.append(Line2D([], [], color=ROUGH_COLOUR, lw=1.5, label=label))
        return entries

    def draw(self, axes: Axes, i: int, note: str = "", pixels: int = PIXELS) -> None:
        """Draw frame i with scale bar and compass; a note below the solids."""
        width = self.high[0] - self.low[0]
        extent = (self.low[0], self.high[0], self.low[1], self.high[1])
        axes.imshow(self.render(i, pixels), extent=extent, interpolation="antialiased")
        foot = self.foot
        axes.set(xlim=extent[:2], ylim=(self.low[1] - foot, self.high[1]), aspect="equal")
        axes.set_axis_off()
        length = nice_length(0.2 * width)
        right, bottom = self.high[0] - 0.03 * width, self.low[1] - 0.35 * foot
        axes.plot([right - length, right], [bottom, bottom], color="k", lw=2.5,
                  solid_capstyle="butt", gid="scale bar")  # fmt: skip
        axes.text(
            right - 0.5 * length, bottom - 0.12 * foot, f"{length:g} m", ha="center", va="top"
        )
        origin = np.array([self.low[0] + 0.08 * width, self.low[1] - 0.75 * foot])
        for name, direction in (("N", [0.0, 1.0, 0.0]), ("up", [0.0, 0.0, 1.0])):
            arrow = 0.75 * foot * self._project(np.array(direction))
            look = {"arrowstyle": "-|>", "color": "k", "shrinkA": 0, "shrinkB": 0}
            axes.annotate("", origin + arrow, origin, arrowprops=look, gid=name)
            axes.text(*(origin + 1.3 * arrow), name, ha="center", va="center")
        middle = 0.5 * (self.low[0] + self.high[0])
        axes.text(middle, bottom, escape_math(note), ha="center", va="center", gid="note")
        axes.figure.suptitle(escape_math(self.title))

    @style()
    def write(self, path: Path, note: str = "", i: int = -1) -> None:
        """Draw one frame, the last one by default, into a file."""
        figure, axes = self.figure()
        self.draw(axes, i % len(self.motions), note)
        written(figure, path)

    @style()
    def animation(self, path: Path, times: Sequence[float]) -> None:
        """Draw all frames as GIF, at a constant rate. times: of the frames (s)."""
        _, axes = self.figure()

        def draw(i: int) -> None:
            self.draw(axes, i, f"t = {times[i]:.2f} s", ANIMATION_PIXELS)

        write_animation(path, axes, len(self.motions), draw)
