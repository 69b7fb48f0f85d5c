"""The page "A joint in your browser" in Chromium: bitwise the results of Python; its controls."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from chromium import Chromium
from kinds import make_law
from programs import run_program

import jointlaw as jl
from jointlaw.cli.main import main
from jointlaw.hosts.browser import export

# (d, F) of every step as the bits of the numbers, for text would round them
STEPS = """(() => {
  const numbers = new Float64Array(test.rows.flatMap((row) => [...row.d, ...row.F]));
  return Array.from(new BigUint64Array(numbers.buffer), (b) => b.toString(16));
})()"""
ROOT = Path(__file__).parents[2]
LINEAR = jl.presets.load("linear-a3")
READY = "typeof test === 'object' && test.rows.length >= 40"


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    return export.export_browser(tmp_path_factory.mktemp("page"))


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with Chromium(tmp_path_factory.mktemp("profile")) as chromium:
        yield chromium


@pytest.fixture
def chromium(browser, page_file):
    """The page with rough granite closed under 10 MPa; the test must end without an error."""
    browser.call("Page.navigate", url="about:blank")
    browser.call("Page.navigate", url=page_file.as_uri())
    browser.wait(READY)
    browser.run("story.at = -1")
    choose(browser, "westerly-rough")
    yield browser
    assert browser.errors == []


def choose(chromium, preset):
    """Choose a preset as a reader does; the new joint is closed under 10 MPa."""
    chromium.run(f"part('preset').value = '{preset}'; part('preset').onchange()")


def move(chromium, part, value):
    """Set a slider or a list."""
    event = "change" if part == "hold" else "input"
    chromium.run(f"part('{part}').value = '{value}'; part('{part}').on{event}()")


def on_block(chromium, places):
    """Convert places (x, y) relative to the middle of the upper block to places in the window."""
    box = chromium.run(
        "(() => { scrollTo(0, 0); const b = part('scene').getBoundingClientRect();"
        " return [b.x + b.width / 2, b.y + 40]; })()"
    )
    return [(box[0] + x, box[1] + y) for x, y in places]


def drag(chromium, places, button="left"):
    """Press the mouse button at the first place, move over all places, release it."""
    at = on_block(chromium, places)
    moves = [("Pressed", at[0]), *(("Moved", place) for place in at), ("Released", at[-1])]
    for kind, (x, y) in moves:
        chromium.call("Input.dispatchMouseEvent", type=f"mouse{kind}", x=x, y=y, button=button,
                     clickCount=1, buttons={"left": 1, "right": 2}[button])  # fmt: skip


def touch(chromium, *moves):
    """Touch with fingers at each of these lists of places in turn, then lift them."""
    chromium.call("Emulation.setTouchEmulationEnabled", enabled=True)
    for places, before in zip((*moves, []), ([], *moves), strict=True):
        kind = "Start" if len(places) > len(before) else "Move" if places else "End"
        at = enumerate(on_block(chromium, places))
        points = [{"x": x, "y": y, "id": i} for i, (x, y) in at]
        chromium.call("Input.dispatchTouchEvent", type=f"touch{kind}", touchPoints=points)


def press(chromium, key):
    """Press and release a key on the block; returns whether the page prevents scrolling."""
    chromium.run("part('scene').focus(); onkeydown = (e) => (window.kept = e.defaultPrevented)")
    for kind in ("keyDown", "keyUp"):
        chromium.call("Input.dispatchKeyEvent", type=kind, key=key)
    return chromium.run("window.kept")


def same_bits(chromium, preset):
    """Increments and tractions of all steps, (n, 3) each; the tractions must equal Python's."""
    bits = np.array([int(b, 16) for b in chromium.run(STEPS)], np.uint64)
    d, F = np.split(bits.view(float).reshape(-1, 6), 2, axis=1)
    joint = jl.presets.load(preset).joint()
    np.testing.assert_array_equal(F, [joint.update(step)[0] for step in d])
    energies = chromium.run("[test.joint.stored, test.joint.dissipated]")
    # sums of energies are formed in another order, lane by lane
    assert energies == pytest.approx([joint.stored_energy, joint.dissipated_energy], rel=1e-12)
    return d, F


# ----------------------------------------------------------------------------------------- the law


@pytest.mark.parametrize("preset", ["westerly-rough", "jing-replica", "linear-a3"])
def test_a_drag_gives_the_bits_of_python(chromium, preset):
    choose(chromium, preset)
    drag(chromium, [(0, 0), (4, 0), (20, 3), (-20, 3), (5, 3)])
    d, F = same_bits(chromium, preset)
    assert len(d) > 100
    slid = F[np.flatnonzero(d[:, 1])]
    assert slid[:, 0] == pytest.approx(10e6, rel=1e-8)  # the bracket ends at 1e-9
    assert np.ptp(slid[:, 1]) > 3e6


@pytest.mark.parametrize("more", [{}, {"damage": {"yield_interference": 2e-7}}])
def test_a_law_that_degrades_by_stress_gives_the_bits_of_python(chromium, more):
    """Closed, sheared under a growing stress, and unloaded: the slopes decrease on the way."""
    law = make_law(mating_length=2e-6, degradation_stress=5e7, **more)
    rng = np.random.default_rng(8)
    d = rng.normal(0.0, 1e-7, (60, 3))
    d[0, 0] = 5e-7
    d[-10:, 0] = -8e-8
    table = list(export.tables(law))
    bits = chromium.run(
        f"(() => {{ const joint = new Joint(test.joint.wasm, new Uint8Array({table}));"
        "const numbers = [];"
        f"for (const d of {d.tolist()}) {{"
        "  joint.trial(d); joint.commit(); numbers.push(...joint.out); }"
        "const words = new BigUint64Array(new Float64Array(numbers).buffer);"
        "return Array.from(words, (b) => b.toString(16)); })()"
    )
    results = np.array([int(b, 16) for b in bits], np.uint64).view(float).reshape(-1, 12)
    joint = law.joint()
    for step, values in zip(d, results, strict=True):
        F, C = joint.update(step)
        np.testing.assert_array_equal(values, [*F, *C.ravel()])
    assert joint.slope_retention < 0.9


def test_a_law_that_the_page_cannot_compute_is_refused():
    for law in (make_law(plane=0.0), make_law(bond=jl.Bond(1e12, 1e12, 5e4, 1e5))):
        with pytest.raises(ValueError, match="laws in space that consist of asperities only"):
            export.tables(law)


@pytest.mark.parametrize("preset", jl.presets.names())
def test_tables_made_in_the_page_are_those_of_python(chromium, preset):
    """Facets, cells and numbers for other a, c, mu and mating length; near a bound of c too."""
    law = jl.presets.load(preset)
    c = 0.12 * (1 - law.orientation.b / 2)
    length = law.closure_range
    numbers = {"a": 2.3, "c": c, "mu": 0.5, "mating": length}
    bytes_ = chromium.run(
        f"Array.from(tablesOf(JOINTLAW.rocks['{preset}'], {json.dumps(numbers)}))"
    )
    law = replace(
        law, orientation=replace(law.orientation, a=2.3, c=c),
        asperity=replace(law.asperity, mu=0.5), mating_length=length,
    )  # fmt: skip
    expected = export.tables(law)
    start = export.LawStruct.facet.offset
    tables, expected_tables = (np.frombuffer(one[start:]) for one in (bytes(bytes_), expected))
    np.testing.assert_allclose(
        tables, expected_tables, rtol=1e-11, atol=1e-13
    )  # m: nodes of the curve
    for name in ("mu", "mating_length", "normal_stress_factor", "closure_per_displacement"):
        at = getattr(export.LawStruct, name).offset
        assert np.frombuffer(bytes(bytes_)[at : at + 8]) == pytest.approx(
            np.frombuffer(expected[at : at + 8]), rel=1e-11
        )


def test_the_law_that_the_package_carries_is_made_of_its_sources(tmp_path):
    """By the one version of zig in pyproject.toml: after a change, `python builder/wasm.py`."""
    pytest.importorskip("ziglang", reason="needs ziglang: pip install '.[docs]'")
    rebuilt = tmp_path / "rebuilt.wasm"
    packaged = export.HERE / export.WASM
    run_program(sys.executable, ROOT / "builder" / "wasm.py", rebuilt)
    assert rebuilt.read_bytes() == packaged.read_bytes()
    assert packaged.stat().st_size < 60_000


def test_the_command_writes_the_page_and_opens_it(tmp_path, monkeypatch, capsys):
    addresses = []
    monkeypatch.setattr("webbrowser.open", addresses.append)
    assert main(["browser", "--out", str(tmp_path / "joint")]) == 0
    assert addresses == [(tmp_path / "joint" / "index.html").as_uri()]
    assert "index.html" in capsys.readouterr().out


# ---------------------------------------------------------------------------- what a reader may do


@pytest.mark.parametrize("hold", ["stress", "closure"])
def test_every_test_plays_to_its_end_at_what_is_held(chromium, hold):
    choose(chromium, "biegel-rough")
    move(chromium, "hold", hold)
    for name in ("closure", "shear", "cycle", "opening"):
        chromium.run(f"document.querySelector('[data-test={name}]').click()")
        chromium.wait("!playing && test.rows.length > 45")
        d, F = same_bits(chromium, "biegel-rough")
        slid = np.flatnonzero(d[:, 1])
        if hold == "stress":
            assert F[slid, 0] == pytest.approx(10e6, rel=1e-8)
        else:
            assert not d[slid, 0].any()
    assert chromium.run("document.documentElement.scrollWidth <= innerWidth")  # at 390 pixels


# drags, in pixels, of which the first must not complete the step, and the second must
TUTORIAL = {
    "Touch": (
        lambda chromium: move(chromium, "level", 160),
        lambda chromium: move(chromium, "level", 200),
    ),
    "Stick": ([(0, 0), (100, 0)], [(0, 0), (-100, 0)]),
    "Slip one by one": ([(0, 0), (40, 0)], [(0, 0), (160, 0)]),
    "Dilate": ([(0, 0), (20, 0)], [(0, 0), (150, 0)]),
    "Turn back": ([(0, 0), (-20, 0)], [(0, 0), (-150, 0)]),
    "Turn the direction": ([(0, 0), (-20, 0)], [(0, 0), (120, 0)]),
}
SHEARS = "test.rows.map((row) => row.shear)"
CLOSURES = "test.rows.map((row) => row.closure)"
SHOWN = {  # what the joint must have done in each step
    "Touch": "test.joint.F[0] >= 9.5e6",
    "Stick": f"Math.max(...{SHEARS}) >= 0.5e6 && {SHEARS}.at(-1) <= 0.1e6",
    "Slip one by one": "test.joint.facetStates().filter((f) => f.slides > 0.5).length > 9",
    "Dilate": f"Math.max(...{CLOSURES}) - test.closure > 0.1 * test.joint.length",
    "Turn back": f"{SHEARS}.at(-1) < 0",
    "Turn the direction": "test.degrees === 90 && Math.abs(test.joint.F[1]) < Math.abs(before)",
}


def act(chromium, what):
    what(chromium) if callable(what) else drag(chromium, what)
    chromium.wait("!drawn")


@pytest.mark.parametrize(("rock", "predicted"), [("westerly-smooth", 0), ("westerly-rough", 1)])
def test_each_step_is_done_when_its_experiment_has_shown_what_it_says(chromium, rock, predicted):
    choose(chromium, rock)
    chromium.run(
        "choose = (i) => part('choices').children[i].click(); begin(); story.at = -1; goTo(0)"
    )
    for number, (name, (part_of_the_way, whole)) in enumerate(TUTORIAL.items()):
        chromium.wait("!drawn")
        assert chromium.run("story.step.name") == name
        assert chromium.run("part('explanation').textContent").endswith("?")
        gear = chromium.run("gear()")
        chromium.run(f"choose({predicted}); window.before = test.joint.F[1]")
        if name == "Turn the direction":
            move(chromium, "direction", 90)
        act(chromium, part_of_the_way)
        assert not chromium.run("story.isDone"), name
        act(chromium, whole)
        chromium.wait("story.isDone")
        assert chromium.run(SHOWN[name]), name
        assert chromium.run("gear()") == gear  # until the next step
        verdict = chromium.run("part('explanation').textContent")
        is_right = chromium.run("story.step.right") == predicted
        assert verdict.startswith("As you predicted" if is_right else "You predicted")
        assert chromium.run("story.at") == number
        chromium.run("part('next').click()")
    assert chromium.run("part('task').textContent").startswith("Done. The tutorial is complete")


def test_no_step_of_the_tutorial_has_a_dead_end(chromium):
    """After whatever was done before, Again loads the joint so that the task can be done."""
    for number, (name, (part_of_the_way, whole)) in enumerate(TUTORIAL.items()):
        chromium.run(f"begin(); story.at = -1; goTo({number})")
        move(chromium, "direction", 45)
        drag(chromium, [(0, 0), (900, 0), (-1900, 0)])
        chromium.run("document.querySelector('[data-test=\"\"]').click(); part('again').click()")
        chromium.wait("!drawn")
        if name == "Turn the direction":
            move(chromium, "direction", 90)
        act(chromium, part_of_the_way)
        act(chromium, whole)
        chromium.wait("story.isDone")


def test_a_link_opens_a_step_or_plays_a_test(chromium, page_file):
    for link, condition in {
        "step=4": "story.at === 3 && Math.abs(test.slip / test.joint.length - 1) < 0.01",
        "rock=biegel-rough&play=cycle": "part('preset').value === 'biegel-rough' && !playing"
        " && Math.min(...test.rows.map((row) => row.slip)) < -2.9 * test.joint.length",
    }.items():
        chromium.call("Page.navigate", url="about:blank")
        chromium.call("Page.navigate", url=f"{page_file.as_uri()}#{link}")
        chromium.wait(f"{READY} && {condition}")


def test_controls_on_a_phone_are_large_enough_for_a_finger(chromium):
    """44 pixels; block and curve together fit a screen of 390 by 740 pixels."""
    chromium.run("goTo(1)")
    chromium.wait("!drawn")
    controls = "[...document.querySelectorAll('#joint button, #joint select, #joint input')]"
    heights = chromium.run(
        f"{controls}.filter((c) => c.offsetParent).map((c) => c.getBoundingClientRect().height)"
    )
    assert len(heights) > 15
    assert min(heights) >= 44
    top = chromium.run("part('scene').getBoundingClientRect().top")
    bottom = chromium.run("part('stress').getBoundingClientRect().bottom")
    assert bottom - top <= 740


def test_what_cannot_be_loaded_is_told(browser, page_file, tmp_path):
    (tmp_path / "index.html").write_text(
        page_file.read_text().replace('"wasm": "', '"wasm": "AAAA')
    )
    browser.call("Page.navigate", url=(tmp_path / "index.html").as_uri())
    browser.wait("document.getElementById('joint-message')?.textContent")
    assert "cannot be shown" in browser.run("document.getElementById('joint-message').textContent")
    assert browser.errors
    browser.errors.clear()


def reload(chromium):
    """Reload the page once the address holds the joint."""
    chromium.wait("location.hash.includes('turn=45')")
    before = "[...test.joint.F, test.closure, test.degrees, numbers.mu]"
    before = chromium.run(before)
    chromium.call("Page.reload")
    chromium.wait(READY)
    chromium.run(f"window.before = {json.dumps(before)}")


def copied(chromium):
    """The Python script and the CSV for copying reproduce the joint of the page."""
    space = {}
    F = chromium.run("test.joint.F")
    exec(chromium.run("python(rockName(), numbers, test)"), space)
    # steps of Python's tests differ a little
    np.testing.assert_allclose(space["joint"].F, F, rtol=2e-4)
    rows = chromium.run("csv(test)").split()
    assert rows[0] == "closure_m,shear_2_m,shear_3_m,F1_Pa,F2_Pa,F3_Pa"
    assert [float(x) for x in rows[-1].split(",")][3:] == F


DO = {
    "drag": drag, "touch": touch, "move": move, "press": press, "choose": choose,
    "reload": reload, "run": Chromium.run, "is": Chromium.wait, "bits": same_bits,
    "copied": copied,
}  # fmt: skip
RIGHT, LEFT, UP, DOWN = ([(0, 0), end] for end in ((20, 0), (-15, 0), (0, -20), (0, 150)))
SEEN = "new MutationObserver(() => heard++).observe(part('status'), { childList: true })"
SCENES = {
    "a path of a changed rock, slipped in two directions and closed, can be copied": [
        *(("move", name, to) for name, to in (("a", 4), ("c", 0.1), ("mu", 0.45), ("mating", 6))),
        ("drag", [(0, 0), (20, 0), (8, 0)]),
        ("move", "direction", 60),
        ("move", "level", 240),
        ("drag", [(0, 0), (10, 0)]),
        ("move", "hold", "closure"),
        ("drag", [(0, 0), (4, 2)]),
        ("copied",),
    ],
    "the joint has the rock of its name": [
        ("choose", "jing-replica"),
        ("choose", "linear-a3"),
        ("is", f"Math.abs(test.joint.length / {float(LINEAR.closure(10e6))!r} - 1) < 1e-9"),
    ],
    "the picture has an end, which is told": [
        ("drag", [(0, 0), (170, 0)]),
        ("is", "Math.abs(test.slip / test.joint.length - 7) < 0.02"),
        ("is", "!drawn && part('message').textContent.includes('picture ends')"),
        ("drag", LEFT),
        ("is", "test.slip < 6 * test.joint.length"),
    ],
    "the tables have an end, which is told": [
        ("move", "hold", "closure"),
        ("drag", DOWN),
        ("is", "Math.max(...test.rows.map((row) => row.normal)) <= 20.02e6"),
        ("is", "!drawn && part('message').textContent.includes('20 MPa')"),
    ],
    "what does nothing leaves scrolling alone": [
        ("is", "part('scene').style.touchAction === 'pan-y'"),
        ("press", "ArrowDown"),
        ("is", "kept === false"),
        ("press", "ArrowRight"),
        ("is", "kept === true"),
        ("move", "hold", "closure"),
        ("is", "part('scene').style.touchAction === 'none'"),
        ("press", "ArrowDown"),
        ("is", "kept === true"),
    ],
    "a joint that is open stays open at no stress, and closes in small steps": [
        ("move", "hold", "closure"),
        ("drag", UP),
        ("is", "test.joint.F[0] === 0"),
        ("move", "hold", "stress"),
        ("run", "window.before = test.closure"),
        ("press", "ArrowRight"),
        ("is", "test.level === 0 && test.closure === before"),
        ("move", "level", 100),
        ("is", "Math.abs(test.joint.F[0] - 5e6) < 1"),
        ("is", "test.rows.every((row, i, all) => !i || row.normal - all[i - 1].normal < 1.1e6)"),
    ],
    "other numbers do again all that was done, and back": [
        ("drag", [(0, 0), (34, 0)]),
        ("drag", LEFT),
        ("run", "window.before = [...test.joint.F.slice(0, 2), test.slip]"),
        ("move", "a", 9),
        ("is", "Math.abs(test.slip / before[2] - 1) > 0.01"),
        ("move", "a", 3),
        ("is", "[...test.joint.F.slice(0, 2), test.slip]"
               ".every((x, i) => Math.abs(x / before[i] - 1) < 1e-4)"),
    ],
    "the right button moves nothing": [
        ("drag", [(0, 0), (40, 0)], "right"),
        ("is", "test.slip === 0"),
    ],
    "two fingers move nothing": [
        ("touch", [(0, 0)], [(0, 0), (90, 0)], [(30, 0), (120, 0)]),
        ("is", "test.slip === 0"),
    ],
    "a finger and the keys move the block": [
        ("touch", [(0, 0)], [(10, 0)], [(25, 0)]),
        ("run", "window.before = test.slip"),
        # pixels, slowed for a finger; a browser may pass over the first of them
        ("is", "before * zoomOf(test) > 0.4 * 10 && before * zoomOf(test) <= 0.4 * 25.001"),
        ("press", "ArrowRight"),
        ("is", "Math.abs((test.slip - before) / test.joint.length * 20 - 1) < 1e-6"),
        ("bits", "westerly-rough"),
    ],
    "the state stays when the direction turns, and friction turns": [
        ("drag", RIGHT),
        ("run", "window.before = [...test.joint.F, test.joint.dissipated]"),
        ("move", "direction", 90),
        ("is", "[...test.joint.F, test.joint.dissipated].every((x, i) => x === before[i])"),
        ("drag", RIGHT),
        ("bits", "westerly-rough"),
        # facets that were climbed stay loaded
        ("is", "test.joint.F[1] < 0.5 * before[1] && test.joint.F[2] > 0.8 * before[1]"),
    ],
    "the stored path has an end": [
        ("run", "for (let i = 0; i < 400; i++) drag((i % 2 ? -0.3 : 0.3) * test.joint.length, 0)"),
        ("is", "test.rows.length > 4000 && test.rows.length <= 6000"),
        ("run", "for (let i = 0; i < 400; i++) drag((i % 2 ? -1 : 1) * test.joint.length / 99, 0)"),
        ("is", "test.legs.length <= 600"),
    ],
    "the address brings the joint back": [
        ("move", "mu", 0.5),
        ("drag", RIGHT),
        ("move", "direction", 45),
        ("drag", LEFT),
        ("reload",),
        ("is", "[...test.joint.F, test.closure, test.degrees, numbers.mu]"
               ".every((x, i) => Math.abs(x / before[i] - 1) < 1e-5)"),
    ],
    "rounding is not shown, and energies add up": [
        ("is", "!drawn && part('values').textContent.includes('shear stress 0 MPa')"),
        ("drag", RIGHT),
        ("is", "!drawn && Math.abs(100 - ['stored', 'lost'].reduce((sum, name) =>"
               " sum + parseFloat(part(`${name}-bar`).style.width), 0)) < 1e-3"),
    ],
    "a screen reader hears of a control, at rest": [
        ("is", "part('scene').getAttribute('role') === 'slider'"),
        ("is", "part('status').textContent.includes('slip 0')"),
        ("run", f"window.heard = 0; {SEEN}"),
        ("drag", [(x, 0) for x in range(25)]),
        ("is", "heard && part('status').textContent.includes(part('values').textContent)"),
        ("is", "heard <= 2"),
    ],
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_a_reader_finds_that(name, chromium):
    for kind, *what in SCENES[name]:
        DO[kind](chromium, *what)
