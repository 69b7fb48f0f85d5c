"""`check` names faults of a drawing and floating blocks; stages start on time; colours of figures
where a block has failed."""

import numpy as np
import pytest
from running import until
from scene_text import block, coulomb, lines, on_base

from dem_demo import SceneError, Simulation, parse
from dem_demo.cli import main
from dem_demo.dynamics.blocks import drawn_overlaps, floating_blocks
from dem_demo.output.pictures import Pictures
from dem_demo.output.record import RunRecord
from dem_demo.output.run import advance

pytestmark = pytest.mark.usefixtures("assumed_drawing_time")


def check(text, tmp_path, capsys):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    assert main(["check", str(path)]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("depth", [0.0, 2e-4, 3e-3])
def test_drawn_overlaps_are_named(depth, tmp_path, capsys):
    """From a thousandth of the smaller block's width (1 m), for which joints are not closed."""
    text = on_base(coulomb(0.5), [2.0, 1.0], at=[0.0, 0.5 - depth])
    found = drawn_overlaps(parse(text))
    output = check(text, tmp_path, capsys)
    if depth > 1e-3:
        assert found == [("base", "block", pytest.approx(depth))]
        assert "drawing fault: blocks 'base' and 'block' overlap by 0.003 m as drawn" in output
    else:
        assert not found
        assert "drawing fault" not in output


def test_blocks_that_are_drawn_in_each_other_are_an_error():
    with pytest.raises(SceneError, match=r"drawn in each other: blocks 'base' and 'block'"):
        Simulation(parse(on_base(coulomb(0.5), [2.0, 1.0], at=[0.0, 0.3])))


@pytest.mark.parametrize(
    ("density", "load", "floats"),
    [(900.0, 0.0, True), (1100.0, 0.0, False), (900.0, -3e3, False), (1100.0, 3e3, True)],
)
def test_a_block_lighter_than_water_floats(density, load, floats, tmp_path, capsys):
    text = on_base(coulomb(0.5), [2.0, 1.0], density=density, load=[0.0, load])
    text += "[water]\ntable = [[0.0, 3.0]]\n"
    sim = Simulation(parse(text))
    found = floating_blocks(sim.scene, sim.blocks, sim.manager)
    assert found.tolist() == [False, floats]
    assert sim.unstable.tolist() == [False, floats]
    output = check(text, tmp_path, capsys)
    assert ("1 block floats: the water lifts more than the weight" in output) == floats


def dug(start, step):
    text = f"[laws.rock]\n{coulomb()}" + block("base", box=[4, 1], at=[0, -0.5], fixed=True)
    text += block("low", box=[1, 1], at=[0, 0.5]) + block("high", box=[1, 1], at=[0, 1.5])
    text += "[[excavate]]\n" + lines(start=start, release_time=0.02)
    text += lines(corners=[[-1, 1], [1, 1], [1, 2], [-1, 2]])
    return text + f"[run]\nend = 1.0\nstep = {step}\n"


@pytest.mark.parametrize("start", [0.0, 0.0123, 0.02])
def test_stages_start_on_time(start):
    """In the step that reaches the time; the support is gone a release time later, in between it
    is the remaining share of the weight."""
    step = 1.3e-4
    sim = Simulation(parse(dug(start, step)))
    weight = 2600.0 * 9.81
    while np.isinf(sim.stage_start_times[0]):
        assert sim.time < start + 1e-9
        sim.step()
    assert sim.stage_start_times[0] == start
    assert start - 1e-9 <= sim.time < start + step * (1 + 1e-9)
    until(sim, start + 0.01)
    share = (start + 0.02 - sim.time) / 0.02
    assert sim.blocks.support[1, 1] == pytest.approx(-weight * share, rel=0.01)
    until(sim, start + 0.02 + step)
    assert not sim.blocks.support.any()


def test_a_falling_block_does_not_set_the_colours():
    """The others move by fractions of a millimetre, and keep their colours and arrows."""
    text = "[laws.rock]\n" + coulomb(0.1, 1e8, 1e8)
    text += block("base", box=[20, 1], at=[0, -0.5], fixed=True)
    text += block("slow", box=[2, 1], at=[0, 0.5], velocity=[2e-3, 0.0])
    text += block("stone", box=[1, 1], at=[6, 9.0])
    scene = parse(text + "[run]\nend = 0.5\nsettle = false\nskin = 0.05\n")
    record = RunRecord(sim := Simulation(scene))
    advance(sim, record)
    slow, stone = record.distances[1:]
    assert stone > 1.0
    assert slow < 0.01
    pictures = Pictures(record)
    assert pictures.max_distance == pytest.approx(slow)
    assert pictures.largest_distance == pytest.approx(stone)
    figure, _ = pictures.figure()
    (label,) = [axes.get_xlabel() for axes in figure.axes if "displacement" in axes.get_xlabel()]
    assert label.startswith("displacement since the start (mm), failed blocks beyond the scale")
    assert f"up to {stone:.2g} m" in label
