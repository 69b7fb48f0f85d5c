"""The page "A joint in your browser" in Chromium: the bits of Python, and no error."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import jointlaw as jl

sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "_ext"))
import browser as page
from chromium import Chromium

# (d, F) of every step as the bits of the numbers, for text would round them
STEPS = """(() => {
  const bits = new BigUint64Array(new Float64Array(test.steps.flat()).buffer);
  return Array.from(bits, (b) => b.toString(16));
})()"""


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    page.make(folder)
    page.write_alone(folder)
    with Chromium(tmp_path_factory.mktemp("profile")) as chromium:
        chromium.window(390, 900)
        chromium.ask("Page.navigate", url=(folder / "index.html").as_uri())
        chromium.wait("typeof test === 'object' && test.rows.length >= 40")
        yield chromium


def choose(chromium, part, value):
    """As a reader does it; the joint that begins then is seated."""
    chromium.run(f"window.before = test; part('{part}').value = '{value}'")
    chromium.run(f"part('{part}').onchange()")
    chromium.wait("test !== before && test.rows.length >= 40")


def on_block(chromium, places):
    """Places (x, y) from the middle of the upper block, in the window."""
    box = chromium.run(
        "(() => { const b = part('scene').getBoundingClientRect();"
        " return [b.x + b.width / 2, b.y + 40]; })()"
    )
    return [(box[0] + x, box[1] + y) for x, y in places]


def drag(chromium, places):
    """Press the mouse at the first place, move over the others, release."""
    at = on_block(chromium, places)
    chromium.mouse("mousePressed", *at[0])
    for place in at:
        chromium.mouse("mouseMoved", *place)
    chromium.mouse("mouseReleased", *at[-1])


def taken(chromium):
    """Increments and tractions of all steps, (n, 3) each, to the last bit."""
    bits = np.array([int(b, 16) for b in chromium.run(STEPS)], np.uint64)
    return np.split(bits.view(float).reshape(-1, 6), 2, axis=1)


def same_bits(chromium, preset, resolution):
    """Python's traction for the increments that the page gave to its law."""
    d, F = taken(chromium)
    joint = replace(jl.presets.load(preset), resolution=resolution).joint()
    ours = np.array([joint.update(step)[0] for step in d])
    np.testing.assert_array_equal(F, ours)
    kept = chromium.run("[test.joint.stored, test.joint.dissipated]")
    # sums of energies are formed in another order, lane by lane
    assert kept == pytest.approx([joint.stored_energy, joint.dissipated_energy], rel=1e-12)
    return d, F


@pytest.mark.parametrize("resolution", page.RESOLUTIONS)
@pytest.mark.parametrize("preset", ["westerly-rough", "jing-replica", "linear-a3"])
def test_a_drag_gives_the_bits_of_python(chromium, preset, resolution):
    choose(chromium, "preset", preset)
    choose(chromium, "resolution", resolution)
    drag(chromium, [(0, 0), (9, 0), (40, 3), (-35, 3), (10, 3)])
    d, F = same_bits(chromium, preset, resolution)
    assert len(d) > 100
    slid = F[np.flatnonzero(d[:, 1])]
    assert slid[:, 0] == pytest.approx(10e6, rel=1e-8)  # the bracket ends at 1e-9
    assert np.ptp(slid[:, 1]) > 3e6
    assert chromium.said == []


def test_every_test_and_control_works_without_an_error(chromium):
    """Each played test to its end, then apart and shut again by hand at a held closure."""
    choose(chromium, "preset", "biegel-rough")
    choose(chromium, "resolution", "balanced")
    for name in ("closure", "shear", "cycle", "opening"):
        chromium.run(f"document.querySelector('[data-test={name}]').click()")
        chromium.wait("!playing && test.rows.length > 50")
        same_bits(chromium, "biegel-rough", "balanced")
    chromium.run("part('hold').value = 'closure'")
    drag(chromium, [(0, 0), (20, 0), (20, -60), (-20, -60)])
    assert taken(chromium)[1][-1, 0] == 0.0  # apart
    drag(chromium, [(0, 0), (0, 70)])
    _, F = same_bits(chromium, "biegel-rough", "balanced")
    assert F[-1, 0] > 1e6
    chromium.run("part('hold').value = 'stress'")
    assert chromium.run("document.documentElement.scrollWidth <= innerWidth")  # at 390 pixels
    assert chromium.said == []


def test_finger_and_keys_move_the_block(chromium):
    choose(chromium, "preset", "westerly-smooth")
    chromium.finger(on_block(chromium, [(0, 0), (10, 0), (30, 0)]))
    way = chromium.run("test.slip * zoomOf(test)")
    assert 10 < way <= 30.001  # pixels; a browser may pass over the first of them
    chromium.run("part('scene').focus()")
    chromium.key("ArrowLeft")
    back = way - chromium.run("test.slip * zoomOf(test)")
    assert back == pytest.approx(chromium.run("test.joint.length * zoomOf(test) / 20"))
    same_bits(chromium, "westerly-smooth", chromium.run("part('resolution').value"))
    assert chromium.said == []


def test_the_law_takes_little_room(tmp_path):
    assert len(page.compiled()) <= 60_000
