"""Every key of strength.json by hand, in the plane and in space.

One slab rests on a slope of tangent 1/4, another one on a slope of tangent 1, with a friction of
1/2: without the second, which has no equilibrium, the factor of safety is 2, of both it is 1/2. The
search finds it to 0.6 %.
"""

import json

import numpy as np
import pytest
from scene_text import block, coulomb, lines

import dem_demo.cli

FRICTION = 0.5
GENTLE = np.array([1.0, 0.25])
STEEP = np.array([1.0, 1.0])
LONG, HIGH = 1.0, 0.2  # m, of a slab
AT = {"slab": np.array([1.0, 0.0]), "steep": np.array([9.0, 0.0])}
FACTOR = 0.006  # relative tolerance of the search


def slope_and_slab(name, direction):
    """Corners of a fixed wedge below a slope through a point, and of a slab on it."""
    along = direction / np.hypot(*direction)
    up = np.array([-along[1], along[0]])
    start = AT[name]
    ends = start - 0.5 * along, start + 2.0 * along
    bottom = ends[0][1] - 1.0
    wedge = [ends[0], [ends[0][0], bottom], [ends[1][0], bottom], ends[1]]
    slab = [start, start + LONG * along, start + LONG * along + HIGH * up, start + HIGH * up]
    return np.array(wedge), np.array(slab), start + 0.5 * (LONG * along + HIGH * up)


def corners_in(dimension, corners):
    """Corners in the plane, or extruded by 1 m along y."""
    if dimension == 2:
        return corners
    return np.array([[x, y, z] for y in (0.0, 1.0) for x, z in corners])


def text_of(dimension):
    text = lines(title="slabs", law="joint") + f"[laws.joint]\n{coulomb(FRICTION, 1e9, 5e8)}"
    for name, direction in (("slab", GENTLE), ("steep", STEEP)):
        wedge, slab, _ = slope_and_slab(name, direction)
        text += block(f"below {name}", corners=corners_in(dimension, wedge), fixed=True)
        text += block(name, corners=corners_in(dimension, slab))
    return text + "[run]\nend = 0.1\n" * (dimension == 2)


def listed(dimension, name, direction):
    x, z = slope_and_slab(name, direction)[2]
    place = {"x_m": x, "y_m": z} if dimension == 2 else {"x_m": x, "y_m": 0.5, "z_m": z}
    return {"block": name} | {axis: pytest.approx(value) for axis, value in place.items()}


@pytest.mark.parametrize("dimension", [2, 3])
def test_every_key_of_strength(dimension, tmp_path, capsys):
    (tmp_path / "slabs.toml").write_text(text_of(dimension))
    words = ["strength-reduction", str(tmp_path / "slabs.toml"), "--out", str(tmp_path / "out")]
    assert dem_demo.cli.main(words) == 0
    x, z = slope_and_slab("slab", GENTLE)[2]
    place = f"{x:.2f}, {z:.2f}" if dimension == 2 else f"{x:.2f}, 0.50, {z:.2f}"
    assert f"initiating blocks: slab ({place})" in capsys.readouterr().out
    actual = json.loads((tmp_path / "out" / "strength.json").read_text())
    steep = listed(dimension, "steep", STEEP)
    of_both = FRICTION / (STEEP[1] / STEEP[0])
    of_slab = FRICTION / (GENTLE[1] / GENTLE[0])
    row = {
        "unstable": [steep],
        "excluded": [steep],
        "factor_of_safety": pytest.approx(of_both, rel=FACTOR),
        "factor_without_excluded": pytest.approx(of_slab, rel=FACTOR),
        "initiating_blocks": [listed(dimension, "slab", GENTLE)],
    }
    if dimension == 2:
        row |= {
            "rock": "scene",
            "limit_analysis": pytest.approx(of_both, rel=FACTOR),
            "limit_without_excluded": pytest.approx(of_slab, rel=FACTOR),
            "critical_tilt": None,  # without equilibrium as drawn
            "picture": "failing-scene.png",
        }
    else:
        row |= {"rock": "slabs"}
    assert actual == {"version": dem_demo.cli.STRENGTH_VERSION, "rows": [row]}
