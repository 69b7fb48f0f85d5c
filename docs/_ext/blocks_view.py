"""The view of the two wedges on the page docs/space.md, which turns with the mouse.

The wedges are computed while the site is built.
"""

from dem_demo.space import Statics, load
from dem_demo.space.drawing import Drawing
from dem_demo.space.view import fragment, scene_data

PLACE = "<!-- view of the wedges -->"
SCENES = {"wedge": "rough along the line", "wedge-across": "rough across the line"}
PULL = 0.6  # of the slider: the rough direction is seen on the joint planes


def wedges():
    """The part of the page, as HTML."""
    scenes = []
    for name, label in SCENES.items():
        statics = Statics(load(name))
        result = statics.solve()
        text = f"{label[0].upper()}{label[1:]} of intersection: {result.verdict.value}."
        scenes.append(scene_data(Drawing(statics, result.unstable), text, label))
    return fragment(scenes, PULL)


def fill(app, name, source):
    """Replace the mark of the page docs/space.md."""
    if name == "space" and app.builder.format == "html":
        source[0] = source[0].replace(PLACE, f"````{{raw}} html\n{wedges()}\n````")


def setup(app):
    app.connect("source-read", fill)
    return {"parallel_read_safe": True}
