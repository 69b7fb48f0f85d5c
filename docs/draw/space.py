"""The pictures of the page "Blocks in space".

    python docs/draw/space.py FOLDER

wedge.png: the scenes wedge and wedge-across, their rough directions and factors of safety.
slope-3d-joints.png: the scene slope-3d, its blocks pulled apart.
face-contact.png: two faces that lie on each other, their overlap, and the points that carry it.
veering.png: direction in which a block slides, whose dip line is oblique to the rough direction.
"""

import numpy as np
from command_line import output_folder
from matplotlib import pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from PIL import Image

from dem_demo.space import SpaceSimulation, Statics, load, parse
from dem_demo.space.contacts import Surfaces, find_contacts
from dem_demo.space.drawing import Drawing
from dem_demo.space.pictures import (
    EDGE_COLOUR,
    JOINTS_PULL,
    MARKED_COLOUR,
    ROUGH_COLOUR,
    STATE_COLOURS,
    SpacePictures,
)
from dem_demo.space.solids import box, convex_hull
from dem_demo.space.strength import factor_of_safety
from jointlaw.support.pyplot import style


def draw_scene(axes, name):
    """Draw a wedge pulled off its slope, its rough direction, and its factor of safety."""
    statics = Statics(load(name))
    factor = factor_of_safety(statics, tolerance=0.002)
    unstable = statics.solve().unstable
    drawing = Drawing(statics, unstable)
    pictures = SpacePictures(drawing, [drawing.pulled_apart(JOINTS_PULL)])
    pictures.draw(axes, 0, "pulled apart to show the joints")
    way = "along" if name == "wedge" else "across"
    verdict = "unstable" if unstable.any() else "stable"
    axes.figure.suptitle("")
    axes.set_title(
        f"rough {way} the line of intersection:\nfactor of safety {factor:.2f}, {verdict}"
    )


def add_legend(figure):
    """Add the colours of the blocks and the lines of the rough direction below both wedges."""
    handles = [
        Patch(facecolor=STATE_COLOURS[name], edgecolor=EDGE_COLOUR, lw=0.8, label=name)
        for name in ("fixed", "stable")
    ]
    look = {"facecolor": STATE_COLOURS["unstable"], "edgecolor": MARKED_COLOUR, "lw": 2.0}
    handles.append(Patch(**look, label="unstable"))
    handles.append(Line2D([], [], color=ROUGH_COLOUR, lw=1.5, label="rough direction"))
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)


def draw_slope(path):
    """Draw the joints of a slope, in few colours: the lines on its faces make a large file."""
    statics = Statics(load("slope-3d"))
    drawing = Drawing(statics, statics.solve().unstable)
    pictures = SpacePictures(drawing, [drawing.pulled_apart(JOINTS_PULL)])
    pictures.write(path, "pulled apart to show the joints")
    Image.open(path).convert("RGB").quantize(160).save(path, optimize=True)


def draw_contact(axes):
    """Draw two faces, their overlap, its points, and the share of each point."""
    upper = np.array([[-1.0, -0.6], [0.9, -0.9], [1.3, 0.5], [0.2, 1.2], [-1.1, 0.6]])
    low = np.column_stack([upper, np.zeros(5)])
    solids = [
        box([2.0, 1.6, 1.0], [0.5, 0.2, -0.5]),
        convex_hull(np.concatenate([low, low + np.array([0, 0, 1])])),
    ]
    points = find_contacts(Surfaces(solids, np.ones(2)), np.full(2, 1e-3), 0.1)
    polygon = points.point[:, :2]
    ring = np.append(polygon, polygon[:1], axis=0)
    centroid = points.area @ polygon / points.area.sum()  # of points with these shares
    base = np.array([[-0.5, -0.6], [1.5, -0.6], [1.5, 1.0], [-0.5, 1.0]])
    axes.fill(*base.T, facecolor="none", edgecolor="0.45", label="face of block a")
    axes.fill(
        *upper.T, facecolor="none", edgecolor=STATE_COLOURS["unstable"], label="face of block b"
    )
    axes.fill(*ring.T, color=STATE_COLOURS["stable"], alpha=0.3, label="overlap")
    for corner in polygon:
        axes.plot(*np.array([centroid, corner]).T, color="0.6", linewidth=0.8, linestyle="--")
    axes.scatter(*polygon.T, 600 * points.area / points.area.max(), color=ROUGH_COLOUR, zorder=3,
                 label="points, as large as their areas")  # fmt: skip
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, labelspacing=1.0)


OBLIQUE_SCENE = """
gravity = [{g[0]}, {g[1]}, {g[2]}]
rough = -90.0
[laws.rock]
from = "jing-replica"
orientation = {{ a = 3.0, b = -1.0, c = {c} }}
mating_length = 2e-3
closure_range = 2e-5
[[block]]
name = "bed"
box = [8.0, 8.0, 1.0]
at = [0.0, 0.0, -0.5]
fixed = true
[[block]]
name = "slab"
box = [1.0, 1.0, 0.02]
at = [0.0, 0.0, 0.01]
density = 26000.0
[run]
end = 0.25
fraction = 0.15
skin = 0.02
max_overlap = 0.9
"""
SLOPE = np.radians(56.0)
DIP_AZIMUTH = np.radians(45.0)  # from axis 2 of the law


def slide_azimuths(anisotropy):
    """Distance (mm) and azimuth (degrees) from axis 2 of a slab on its way down a slope."""
    down = np.sin(SLOPE) * np.array([np.cos(DIP_AZIMUTH), np.sin(DIP_AZIMUTH)])
    gravity = 9.81 * np.array([*down, -np.cos(SLOPE)])
    sim = SpaceSimulation(parse(OBLIQUE_SCENE.format(g=gravity, c=anisotropy)))
    start = sim.blocks.motion[:2, 1].copy()
    path = []
    while sim.time < 0.25:
        sim.step()
        path.append(sim.blocks.motion[:2, 1] - start)
    x, y = np.array(path).T
    return 1e3 * np.hypot(x, y), np.degrees(np.arctan2(y, x))


def draw_veering(axes):
    """Draw the direction of the way of a slab by the distance that it has slid."""
    for anisotropy, text in (
        (-0.3, "rougher along axis 3"),
        (0.0, "isotropic"),
        (0.3, "rougher along axis 2"),
    ):
        distance, azimuth = slide_azimuths(anisotropy)
        seen = distance > 0.1
        label = f"c = {anisotropy:g}, {text}"
        axes.semilogx(distance[seen], azimuth[seen], label=label)
    axes.axhline(45.0, color="0.6", linewidth=0.8, linestyle="--", label="dip line")
    axes.set(xlabel="distance slid (mm)", ylabel="direction from axis 2 (degrees)")
    axes.set_ylim(42.5, 48.0)
    axes.legend(frameon=False, ncols=2, loc="upper center")


def main() -> None:
    """Draw the pictures into the folder of the command line."""
    folder = output_folder(__doc__)
    with style():
        figure, pair = plt.subplots(1, 2, figsize=(11, 4.9), layout="constrained")
        figure.get_layout_engine().set(h_pad=0.1)  # inches, above the titles
        for axes, name in zip(pair, ("wedge", "wedge-across"), strict=True):
            draw_scene(axes, name)
        add_legend(figure)
        figure.savefig(folder / "wedge.png", dpi=110)
        draw_slope(folder / "slope-3d-joints.png")
        figure, axes = plt.subplots(figsize=(7, 3.4))
        draw_contact(axes)
        figure.savefig(folder / "face-contact.png", dpi=110, bbox_inches="tight")
        figure, axes = plt.subplots(figsize=(6, 3.8), layout="constrained")
        draw_veering(axes)
        figure.savefig(folder / "veering.png", dpi=110)


if __name__ == "__main__":
    main()
