"""The strength reduction factor and critical tilt of one block are those of the law alone."""

import math
import re
from dataclasses import replace

import pytest
from scipy.optimize import brentq

from dem_demo.cli import main
from dem_demo.output.monitors import friction_angle
from dem_demo.scene import coulomb_law, parse
from dem_demo.studies.strength import critical_tilt, reduced, strength_factor

DIP = 32.0
SCENE = f"""
gravity = [{9.81 * math.sin(math.radians(DIP))}, {-9.81 * math.cos(math.radians(DIP))}]
[laws.joint]
asperity_density = 1e4
mating_length = 2e-3
plane = 0.0
resolution = {{ u = 4, phi = 10, depth = 1 }}
orientation = {{ a = 4.0, b = 0.0, c = 0.3 }}
asperity = {{ K = 9.5e6, lam = 1.2, eta = 0.5, mu = 0.4 }}
heights = {{ alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }}
[[block]]
name = "base"
box = [9.0, 1.0]
at = [0.0, -0.5]
fixed = true
[[block]]
name = "slab"
box = [5.0, 1.0]
at = [-1.0, 0.5]
[run]
end = 0.2
fraction = 0.7
"""
FOUND = 0.01  # share to which both are found


def angle(factor, dip):
    """Friction angle (degrees) of the scene's law with its mu divided, at the slab's weight."""
    scene = parse(SCENE)
    law = scene.laws["joint"]
    weak = replace(law, asperity=replace(law.asperity, mu=law.asperity.mu / factor))
    return friction_angle(weak, 2600.0 * 9.81 * math.cos(math.radians(dip)))


def test_factor_of_a_block_is_that_of_the_law_alone():
    alone = brentq(lambda f: angle(f, DIP) - DIP, 1.0, 3.0, xtol=1e-3)
    assert strength_factor(parse(SCENE)) == pytest.approx(alone, rel=FOUND)


def test_critical_tilt_of_a_block_is_that_of_the_law_alone():
    alone = brentq(lambda tilt: angle(1.0, DIP + tilt) - DIP - tilt, 0.0, 15.0, xtol=1e-3)
    assert critical_tilt(parse(SCENE)) == pytest.approx(alone, rel=FOUND)


@pytest.mark.parametrize("degrees", [58.0, 62.0])
def test_a_tilt_near_the_steepest_is_found(degrees):
    """A flat slab slides at its friction angle, also where the last step of the search is short."""
    text = SCENE.replace("box = [5.0, 1.0]\nat = [-1.0, 0.5]", "box = [3.0, 0.1]\nat = [0.0, 0.05]")
    plain = coulomb_law(1e9, 1e9, math.tan(math.radians(degrees)))
    found = critical_tilt(replace(parse(text), gravity=(0.0, -9.81), laws={"joint": plain}))
    assert found is None if degrees > 60 else found == pytest.approx(degrees, rel=FOUND)


def test_all_frictions_are_divided_and_nothing_else():
    scene = parse(SCENE)
    law, sticks = scene.laws["joint"], coulomb_law(1e9, 1e9, math.inf)
    worn = replace(law, slope_wear=1e3)
    given = {"worn": worn, "plain": coulomb_law(1e9, 1e9, 0.6), "sticks": sticks}
    laws = reduced(replace(scene, laws=given), 2.0).laws
    assert laws["worn"] == replace(worn, asperity=replace(worn.asperity, mu=law.asperity.mu / 2))
    assert laws["plain"] == coulomb_law(1e9, 1e9, 0.3)
    assert laws["sticks"] == sticks


def test_command_tells_both_and_draws_the_failure(tmp_path, capsys):
    scene = tmp_path / "slab.toml"
    scene.write_text(SCENE)
    assert main(["strength-reduction", str(scene), "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    factor, tilt = re.search(
        r"scene: F = ([\d.]+), critical tilt \+([\d.]+) degrees", told
    ).groups()
    assert (float(factor), float(tilt)) == pytest.approx((1.61, 8.0), rel=0.03)
    assert (tmp_path / "out" / "failing-scene.png").stat().st_size > 10_000
    assert (tmp_path / "out" / "strength.json").exists()
