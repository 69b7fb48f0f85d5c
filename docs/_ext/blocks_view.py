"""The view of the two wedges on the page docs/space.md, which turns with the mouse.

The wedges are computed while the site is built.
"""

from dem_demo.output.run import run
from dem_demo.space import SpaceSimulation, load
from dem_demo.space.picture_files import drawing_of_run
from dem_demo.space.view import fragment, scene_data

PLACE = "<!-- view of the wedges -->"
SCENES = {"wedge": "rough along the line", "wedge-across": "rough across the line"}
PULL = 0.45  # of the slider: the rough direction is seen on the joint planes


def wedges():
    """The part of the page, as HTML."""
    scenes = []
    for name, label in SCENES.items():
        record, _ = run(SpaceSimulation(load(name)), pictures=None)
        drawing, motions = drawing_of_run(record)
        text = f"{label[0].upper()}{label[1:]} of intersection: {record.verdict}."
        scenes.append(scene_data(drawing, text, label, motions, record.times))
    return fragment(scenes, PULL)


def fill(app, name, source):
    """Replace the mark of the page docs/space.md."""
    if name == "space" and app.builder.format == "html":
        source[0] = source[0].replace(PLACE, f"````{{raw}} html\n{wedges()}\n````")


def setup(app):
    app.connect("source-read", fill)
    return {"parallel_read_safe": True}
