"""The page of blocks in space in Chromium: it turns, pulls apart and plays what Python computed."""

import csv
import re

import numpy as np
import pytest
from chromium import Chromium
from matplotlib.colors import to_rgb
from scipy.spatial.transform import Rotation

from dem_demo.cli import main
from dem_demo.space import Statics, load
from dem_demo.space.drawing import Drawing, Motion
from dem_demo.space.pictures import MARKED_COLOUR, STATE_COLOURS
from dem_demo.space.view import PULL_SHARE, page, scene_data

MAX_BYTES = 2e6
VIEW = "document.querySelector('.blocks-view')"
TIMES = 0.0, 0.5, 1.0


@pytest.fixture(scope="module")
def drawings():
    """The wedge, and the wedge across, of which one block is unstable."""
    result = []
    for name in ("wedge", "wedge-across"):
        statics = Statics(load(name))
        result.append(Drawing(statics, statics.solve().unstable))
    return result


@pytest.fixture(scope="module")
def slide(drawings):
    """The wedge moves to the south and down, and turns, in three frames."""
    moving = drawings[1].is_free
    motions = []
    for time in TIMES:
        rotation = np.array(drawings[1].as_drawn.rotation)
        rotation[moving] = Rotation.from_rotvec([0.0, 0.0, 0.3 * time]).as_matrix()
        motions.append(Motion(np.outer(moving, [0.0, -4.0 * time, -3.0 * time]), rotation))
    return motions


@pytest.fixture(scope="module")
def page_file(drawings, slide, tmp_path_factory):
    scenes = [
        scene_data(drawings[0], "It is stable.", "along"),
        scene_data(drawings[1], "It slides.", "across", slide, TIMES),
    ]
    path = tmp_path_factory.mktemp("view") / "view.html"
    path.write_text(page(scenes), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Chromium(tmp_path_factory.mktemp("profile")) as chromium:
        yield chromium


@pytest.fixture
def chromium(browser, page_file):
    """The page, loaded; a test must end without an error in the console."""
    browser.call("Page.navigate", url="about:blank")
    browser.call("Page.navigate", url=page_file.as_uri())
    browser.wait(f"{VIEW} && {VIEW}.dataset.state === 'ready'")
    yield browser
    assert browser.errors == []


def view(chromium, name):
    return chromium.run(f"{VIEW}.view.{name}")


def click(chromium, part):
    chromium.run(f"{VIEW}.querySelector('{part}').click()")


def slide_to(chromium, part, value):
    element = f"{VIEW}.querySelector('.{part} input')"
    chromium.run(f"{element}.value = {value}; {element}.oninput({{target: {element}}})")


def look_from(chromium, azimuth, elevation):
    script = f"Object.assign({VIEW}.view, {{azimuth: {azimuth}, elevation: {elevation}}})"
    chromium.run(f"{script}; {VIEW}.querySelector('.pull input').oninput({{target: {{value: 0}}}})")


def pixel(chromium, point):
    """Colour (3,) of the canvas at a place (m)."""
    colour = np.array(chromium.run(f"{VIEW}.pixel({list(map(float, point))})"))
    assert colour[3] == 255
    return colour[:3] / 255.0


def has_colour(colour, hexadecimal):
    """Whether a pixel has a colour, as bright or shaded."""
    expected = np.array(to_rgb(hexadecimal))
    shade = colour.max() / expected.max()
    return 0.45 < shade < 1.05 and np.abs(colour - shade * expected).max() < 0.04


def top_middle(drawing, motion=None):
    """Middle (3,) of the top of the free block, somewhat off its edges."""
    number = int(np.flatnonzero(drawing.is_free)[0])
    solid = drawing.solids[number]
    face = solid.faces[int(np.argmax(solid.face_normals[:, 2]))]
    point = solid.vertices[list(face)].mean(axis=0)
    motion = motion or drawing.as_drawn
    return motion.place(np.array([number]), drawing.centroid, point[None])[0]


def test_blocks_have_the_colours_of_their_states(chromium, drawings):
    look_from(chromium, -np.pi / 2, 1.2)
    assert has_colour(pixel(chromium, top_middle(drawings[0])), STATE_COLOURS["stable"])
    chromium.run(f"{VIEW}.querySelectorAll('.scenes button')[1].click()")
    assert has_colour(pixel(chromium, top_middle(drawings[1])), STATE_COLOURS["unstable"])
    corner = drawings[1].solids[0].vertices
    beside = corner[corner[:, 2] == corner[:, 2].max()].mean(axis=0)
    assert has_colour(pixel(chromium, beside), STATE_COLOURS["fixed"])
    text = chromium.run(f"{VIEW}.querySelector('.legend').textContent")
    assert "fixed: 3 blocks" in text
    assert "unstable: 1 block" in text
    assert "rough direction" in text


def test_the_edges_of_an_unstable_block_are_drawn_in_their_colour(chromium, drawings):
    """Along the crest of the wedge, from below no other line lies there."""
    chromium.run(f"{VIEW}.querySelectorAll('.scenes button')[1].click()")
    look_from(chromium, -np.pi / 2, 0.6)
    block, ends = drawings[1].edges
    ends = ends[drawings[1].unstable[block]]
    crest = ends[np.argmax(np.abs(ends[:, 1, 0] - ends[:, 0, 0]))]
    middle = crest.mean(axis=0)
    assert has_colour(pixel(chromium, middle), MARKED_COLOUR)
    look_from(chromium, np.pi / 2, -0.6)  # seen from behind and below
    assert not has_colour(pixel(chromium, middle), MARKED_COLOUR)


def test_dragging_and_keys_turn_the_view(chromium):
    start = view(chromium, "azimuth"), view(chromium, "elevation")
    box = chromium.run(
        f"(() => {{ scrollTo(0, 0); const b = {VIEW}.querySelector('canvas')"
        ".getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()"
    )
    for kind, by in (("Pressed", (0, 0)), ("Moved", (50, 25)), ("Released", (50, 25))):
        chromium.call(
            "Input.dispatchMouseEvent", type=f"mouse{kind}", x=box[0] + by[0], y=box[1] + by[1],
            button="left", buttons=1, clickCount=1,
        )  # fmt: skip
    turned = view(chromium, "azimuth"), view(chromium, "elevation")
    # to the right by 50 pixels: the eye moves to the left around the blocks, and up with the hand
    assert turned == pytest.approx((start[0] - 0.4, start[1] + 0.2))
    chromium.run(f"{VIEW}.querySelector('canvas').focus()")
    for key in ("ArrowRight", "ArrowUp", "+"):
        for kind in ("keyDown", "keyUp"):
            chromium.call("Input.dispatchKeyEvent", type=kind, key=key)
    keyed = view(chromium, "azimuth"), view(chromium, "elevation")
    assert keyed == pytest.approx((turned[0] + 0.1, turned[1] + 0.1))
    assert view(chromium, "zoom") == pytest.approx(1.15)
    click(chromium, ".out")
    assert view(chromium, "zoom") == pytest.approx(1.0)


def test_the_scale_bar_and_compass_follow_the_view(chromium):
    look_from(chromium, -np.pi / 2, 0.0)
    for zoom in (1, 2.6):
        chromium.run(f"{VIEW}.view.zoom = {zoom}")
        look_from(chromium, -np.pi / 2, 0.0)
        places = [chromium.run(f"{VIEW}.view.project([{x}, 0, 0])") for x in (0, 10)]
        pixels = (places[1][0] - places[0][0]) / 2  # of the page: the screen has two per pixel
        text, width = chromium.run(
            f"(() => {{ const bar = {VIEW}.querySelector('.scale');"
            " return [bar.textContent, bar.getBoundingClientRect().width]; })()"
        )
        length = float(re.fullmatch(r"([\d.]+) m", text)[1])
        assert width / length == pytest.approx(pixels / 10, rel=0.02)
    arrows = chromium.run(
        f"Array.from({VIEW}.querySelectorAll('.arrow'), (a) => a.getAttribute('d'))"
    )
    north, up = (
        np.array(re.match(r"M0 0L(\S+) (\S+)M", arrow).groups(), float) for arrow in arrows
    )
    assert np.abs(north).max() < 1e-6  # away from the eye
    assert up == pytest.approx([0, -26])


def test_the_slider_pulls_the_blocks_apart(chromium, drawings):
    chromium.run(f"{VIEW}.querySelectorAll('.scenes button')[1].click()")
    look_from(chromium, -np.pi / 2, 1.2)
    before = top_middle(drawings[1])
    slide_to(chromium, "pull", 50)
    motion = drawings[1].pulled_apart(0.5 * PULL_SHARE)
    assert has_colour(pixel(chromium, top_middle(drawings[1], motion)), STATE_COLOURS["unstable"])
    assert np.linalg.norm(top_middle(drawings[1], motion) - before) > 3.0


def test_the_time_slider_shows_the_frames_of_the_run(chromium, drawings, slide):
    assert chromium.run(f"{VIEW}.querySelector('.time').hidden")  # one frame
    chromium.run(f"{VIEW}.querySelectorAll('.scenes button')[1].click()")
    assert not chromium.run(f"{VIEW}.querySelector('.time').hidden")
    look_from(chromium, -np.pi / 2, 1.2)
    slide_to(chromium, "time", 2)
    message = chromium.run(f"{VIEW}.querySelector('.message').textContent")
    assert message.startswith("1.00 s: largest displacement 5.00 m")
    assert has_colour(pixel(chromium, top_middle(drawings[1], slide[2])), STATE_COLOURS["unstable"])
    click(chromium, ".play")  # from the start again, to the end
    button = f"{VIEW}.querySelector('.play').textContent"
    chromium.wait(f"{VIEW}.view.frame === 2 && {button}.includes('play')")


def test_a_run_writes_the_page_and_it_is_small_and_loads_nothing(tmp_path, browser):
    assert main(["wedge-across", "--until", "0.3", "--out", str(tmp_path)]) == 0
    path = tmp_path / "view.html"
    text = path.read_text(encoding="utf-8")
    assert len(text.encode()) < MAX_BYTES
    assert not re.search(r"""(?:src|href)=|https?://|import\(|fetch\(|url\(""", text)
    browser.call("Page.navigate", url="about:blank")
    browser.call("Page.navigate", url=path.as_uri())
    browser.wait(f"{VIEW} && {VIEW}.dataset.state === 'ready'")
    text = browser.run("document.body.textContent")
    assert "0.3 s of motion after a start without equilibrium." in text
    last = browser.run(f"+{VIEW}.querySelector('.time input').max")
    browser.run(f"{VIEW}.querySelector('.time input').oninput({{target: {{value: {last}}}}})")
    message = browser.run(f"{VIEW}.querySelector('.message').textContent")
    with (tmp_path / "blocks.csv").open(newline="") as file:
        largest = max(float(row["displacement_m"]) for row in csv.DictReader(file))
    shown, unit = re.search(r"displacement ([\d.]+) (m+)", message).groups()
    assert float(shown) * {"mm": 1e-3, "m": 1.0}[unit] == pytest.approx(largest, rel=0.005)
    assert browser.run(f"{VIEW}.querySelector('.scenes').hidden")
    width = browser.run("document.documentElement.scrollWidth")
    assert width == browser.run("document.documentElement.clientWidth")  # nothing overflows
    assert browser.errors == []
