"""The pictures of the page "Blocks in space".

    python docs/draw/space.py FOLDER

wedge.png: the scenes wedge and wedge-across, their rough directions and factors of safety.
face-contact.png: two faces that lie on each other, their overlap, and the points that carry it.
"""

import numpy as np
from command_line import output_folder
from matplotlib import pyplot as plt
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from dem_demo.space import Statics, load
from dem_demo.space.contacts import Surfaces, find_contacts
from dem_demo.space.solids import box, convex_hull
from dem_demo.space.strength import factor_of_safety
from jointlaw.support.pyplot import style

FIXED_COLOUR = "#c9cdd2"
STABLE_COLOUR = "#2c8a5b"
UNSTABLE_COLOUR = "#c95500"
ROUGH_COLOUR = "#1f4fa3"
VIEW = {"elev": 30, "azim": -68}
LOW = np.array([-17.0, -2.0, -3.0])  # m: the part of the slope that is shown
HIGH = np.array([17.0, 19.0, 10.0])
LIFT = np.array([0.0, -4.0, 11.0])  # m: the wedge is drawn higher, so that its planes can be seen
GRID = 0.8  # m between the lines of the rough direction


def draw_scene(axes, name):
    """Draw a wedge in its slope, its rough direction on both planes, and its factor of safety."""
    statics = Statics(load(name))
    factor = factor_of_safety(statics, tolerance=0.002)
    surfaces = statics.surfaces
    free = int(np.flatnonzero(statics.is_free)[0])
    colour = STABLE_COLOUR if factor > 1 else UNSTABLE_COLOUR
    for i, solid in enumerate(surfaces.solids):
        part = solid.moved(LIFT) if i == free else crop(solid)
        axes.add_collection3d(
            Poly3DCollection(
                [part.vertices[list(face)] for face in part.faces],
                facecolor=colour if i == free else FIXED_COLOUR, edgecolor="0.25", linewidth=0.6,
                alpha=0.95 if i == free else 0.5,
            )
        )  # fmt: skip
    points = statics.points
    for contact in range(points.contact[-1] + 1):
        rows = np.flatnonzero(points.contact == contact)
        lines = hatching(points.point[rows], statics.axes[rows[0]])
        axes.add_collection3d(Line3DCollection(lines, colors=ROUGH_COLOUR, linewidth=1.2))
    axes.set_xlim(LOW[0], HIGH[0])
    axes.set_ylim(LOW[1] - 5, HIGH[1])
    axes.set_zlim(LOW[2], HIGH[2] + 11)
    axes.set_box_aspect((34, 26, 24), zoom=1.08)
    axes.view_init(**VIEW)
    axes.set_axis_off()
    way = "along" if name == "wedge" else "across"
    verdict = "stable" if factor > 1 else "falls"
    axes.set_title(f"rough {way} the line of intersection:\nfactor {factor:.2f}, {verdict}")


def crop(solid):
    """The part of a solid that is shown."""
    for axis in np.eye(3):
        _, solid = solid.split(axis, float(axis @ LOW), -1, 1e-9)
        solid, _ = solid.split(axis, float(axis @ HIGH), -1, 1e-9)
    return solid


def hatching(corners, axes):
    """Segments (m, 2, 3) in a convex polygon (p, 3) along axis 2 of the law."""
    origin = corners.mean(axis=0)
    along, across = (corners - origin) @ axes[1], (corners - origin) @ axes[2]
    segments = []
    for height in np.arange(across.min() + 0.5 * GRID, across.max(), GRID):
        next_along, next_across = np.roll(along, -1), np.roll(across, -1)
        crosses = (across > height) != (next_across > height)
        part = ((height - across) / np.where(crosses, next_across - across, 1.0))[crosses]
        ends = along[crosses] + part * (next_along - along)[crosses]
        segments.append([origin + x * axes[1] + height * axes[2] for x in ends])
    return segments


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
    axes.fill(*upper.T, facecolor="none", edgecolor=UNSTABLE_COLOUR, label="face of block b")
    axes.fill(*ring.T, color=STABLE_COLOUR, alpha=0.3, label="overlap")
    for corner in polygon:
        axes.plot(*np.array([centroid, corner]).T, color="0.6", linewidth=0.8, linestyle="--")
    axes.scatter(*polygon.T, 600 * points.area / points.area.max(), color=ROUGH_COLOUR, zorder=3,
                 label="points, as large as their areas")  # fmt: skip
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, labelspacing=1.0)


def main() -> None:
    """Draw both pictures into the folder of the command line."""
    folder = output_folder(__doc__)
    with style():
        figure = plt.figure(figsize=(10, 4.6), layout="none")
        for i, name in enumerate(("wedge", "wedge-across")):
            draw_scene(figure.add_subplot(1, 2, i + 1, projection="3d"), name)
        figure.subplots_adjust(left=0.0, right=1.0, bottom=0.0, top=0.9, wspace=0.0)
        figure.savefig(folder / "wedge.png", dpi=110)
        figure, axes = plt.subplots(figsize=(7, 3.4))
        draw_contact(axes)
        figure.savefig(folder / "face-contact.png", dpi=110, bbox_inches="tight")


if __name__ == "__main__":
    main()
