"""Blocks in space under in-situ stress, and excavation in stages: joints bear the given stress, its
mean over the blocks is returned, and what an excavation leaves is stable or falls as by hand."""

from dataclasses import replace

import numpy as np
import pytest
from scene_text import ROCK, block, coulomb, lines

from dem_demo.cli import main
from dem_demo.dynamics.relaxation import Verdict
from dem_demo.scene.laws import INTACT_ROCK
from dem_demo.space import SpaceSimulation
from dem_demo.space.in_situ import in_situ_traction
from dem_demo.space.read import parse
from dem_demo.space.statics import Statics
from dem_demo.space.strength import factor_of_safety

UNIT_WEIGHT = 2600 * 9.81
SIDES = ("left", "right", "front", "back", "bottom", "top")
LAWS = f"[laws.joint]\n{coulomb(0.8)}"
FRAME = lines(**dict.fromkeys(SIDES, "fixed"))
SETS = """\
[[rock.set]]
dip = 35
dip_direction = 120
spacing = 1.1
scatter = 0.3
[[rock.set]]
dip = 75
dip_direction = 230
spacing = 1.3
[[rock.set]]
dip = 65
dip_direction = 340
spacing = 1.5
"""
COARSE = SETS.replace("1.1", "2.0").replace("1.3", "2.2").replace("1.5", "2.4")
CUBE = '[[rock]]\nname = "mass"\nbox = [6, 6, 6]\nat = [0, 0, 3]\n'
STRESS = np.array([[4e6, 0.4e6, 0.2e6], [0.4e6, 3e6, -0.3e6], [0.2e6, -0.3e6, 2e6]])
COMPONENTS = [4e6, 3e6, 2e6, 0.4e6, -0.3e6, 0.2e6]


def mass(in_situ, sides=FRAME, laws=LAWS, top="", sets=SETS):
    return parse(f"{top}{laws}{CUBE}{sets}[in_situ]\n{in_situ}{sides}")


def solved(statics):
    result = statics.solve()
    assert result.verdict is Verdict.EQUILIBRIUM
    return result


def forces_on(statics, result):
    """Forces (k, 3) in N of the contact points on block a, the opposite of the ones on block b."""
    traction = result.traction * [1.0, -1.0, -1.0]
    return np.einsum("k,kc,kci->ki", statics.points.area, traction, statics.axes)


def mean_stress(statics, result):
    """Mean stress (3, 3) over the free blocks without other loads, compression positive: minus the
    sum of place times force over their contact points, divided by their volume."""
    points = statics.points
    is_inner = statics.is_free & ~statics.loads.any(axis=1)
    assert is_inner.sum() > 20
    force = forces_on(statics, result)
    total = np.zeros((3, 3))
    for owner, sign in ((points.block_a, 1.0), (points.block_b, -1.0)):
        arm = points.point - statics.surfaces.position[owner]
        total -= sign * np.einsum("k,ki,kj->ij", is_inner[owner].astype(float), arm, force)
    return total / statics.surfaces.volume[is_inner].sum()


LOADED = lines(**dict.fromkeys(SIDES, "loaded") | {"bottom": "fixed"})


@pytest.mark.parametrize("sides", [FRAME, LOADED], ids=["fixed", "loaded"])
@pytest.mark.parametrize("law", ["coulomb", "rough"])
def test_the_mean_stress_of_a_block_mass_is_the_given_one(law, sides):
    """35 blocks between fixed ones, or loaded from five sides, without weight. Every joint bears
    the stress on its plane, the blocks stay where they are, and the mean over the blocks is the
    given tensor."""
    laws = LAWS if law == "coulomb" else f"[laws.joint]\n{ROCK}"
    scene = mass(lines(stress=COMPONENTS), sides, laws, "gravity = [0, 0, 0]\n")
    statics = Statics(scene)
    result = solved(statics)
    assert mean_stress(statics, result) == pytest.approx(STRESS, abs=4e6 * 1e-6)
    # corners that the search for contacts rounds off are not in the areas of loaded faces
    assert np.abs(result.displacement).max() < (1e-10 if sides is FRAME else 1e-7)
    on_a = statics.axes[:, 0] @ STRESS
    expected = np.einsum("ki,kci->kc", on_a, statics.axes) * [1.0, -1.0, -1.0]
    assert result.traction == pytest.approx(expected, abs=4e6 * 1e-4)


@pytest.mark.parametrize("k0", [0.5, 2.0, [0.7, 1.6]])
def test_blocks_under_their_own_weight_and_k0_do_not_move(k0):
    """At a depth of 100 m: vertical stress by the weight above, horizontal stresses k0 times it."""
    statics = Statics(mass(f"k0 = {k0}\nsurface = [[0, 0, 103]]\n"))
    result = solved(statics)
    assert np.abs(result.displacement).max() < 1e-8
    ratios = np.array(k0) * np.ones(2)
    depth = 103 - np.average(
        statics.surfaces.position[:, 2][statics.is_free],
        weights=statics.surfaces.volume[statics.is_free],
    )
    expected = UNIT_WEIGHT * depth * np.diag([*ratios, 1.0])
    assert mean_stress(statics, result) == pytest.approx(expected, abs=0.01 * expected.max())


def test_contact_points_have_force_and_moment_of_a_linear_stress():
    """A rectangle of 2 m by 3 m on a vertical joint, in a stress that grows with depth."""
    text = lines(gravity=[0, 0, -10]) + LAWS
    text += block("west", box=[1, 2, 3], at=[-0.5, 0, 0], fixed=True)
    text += block("east", box=[1, 4, 3], at=[0.5, 0.5, 0]) + "[in_situ]\nk0 = 0.5\n"
    scene = parse(text + "surface = [[0, 0, 8]]\n")
    statics = Statics(scene)
    traction = in_situ_traction(scene, statics.points, statics.axes)
    force = statics.points.area * traction[:, 0]
    growth = 0.5 * 2600 * 10  # Pa per m of depth
    assert force.sum() == pytest.approx(growth * 8 * 6)
    about_y = force @ statics.points.point[:, 2]
    assert about_y == pytest.approx(-growth * 2 * 3**3 / 12)
    assert force @ statics.points.point[:, 1] == pytest.approx(0.0, abs=1e-6 * force.sum())
    assert traction[:, 1:] == pytest.approx(np.zeros((4, 2)), abs=1e-9)


def test_joints_bear_the_effective_stress():
    """Total stress of the rock less the pressure of the water up to a level."""
    in_situ = "k0 = 1.0\nsurface = [[0, 0, 103]]\n"
    dry = Statics(mass(in_situ))
    wet = Statics(mass(in_situ, top="[water]\ntable = [[0, 0, 53]]\n"))
    water = 9810 * (53 - wet.points.point[:, 2])
    difference = solved(dry).traction[:, 0] - solved(wet).traction[:, 0]
    heaviest = wet.points.area > 0.02  # points in the middle of small faces differ more
    assert difference[heaviest] == pytest.approx(water[heaviest], rel=0.02)


@pytest.mark.parametrize("sides", ["rollers", "loaded"])
def test_the_floor_bears_the_weight_and_the_load_above(sides):
    """On rollers, and under loads, the sides bear no part of the weight."""
    kinds = dict.fromkeys(SIDES[:4], sides) | {"bottom": "fixed", "top": "loaded"}
    statics = Statics(mass("k0 = 1.5\nsurface = [[0, 0, 50]]\n", lines(**kinds)))
    result = solved(statics)
    above = (statics.gravity + statics.loads)[statics.is_free, 2].sum()
    mass_free = statics.mass[statics.is_free].sum()
    assert above == pytest.approx(-mass_free * 9.81 - UNIT_WEIGHT * 44 * 36, rel=1e-9)
    force = forces_on(statics, result)[:, 2]
    is_fixed = ~statics.is_free
    carried = force[is_fixed[statics.points.block_a]].sum()
    carried -= force[is_fixed[statics.points.block_b]].sum()
    assert carried == pytest.approx(above, rel=1e-6)


def test_rollers_prescribe_the_motion_across_the_side_and_rotations():
    scene = mass("k0 = 1.0\n", lines(left="rollers", bottom="fixed"))
    for one in scene.blocks:
        low = one.solid.vertices.min(axis=0)
        is_left = any(
            np.abs(one.solid.vertices[list(face), 0] + 3).max() < 1e-9 for face in one.solid.faces
        )
        assert one.fixed == bool(
            any(np.abs(one.solid.vertices[list(face), 2]).max() < 1e-9 for face in one.solid.faces)
        )
        expected = ("turn", "x") if is_left and not one.fixed else ()
        assert one.prescribed == expected, low


def roof(stress, stages):
    """A block between two walls on a column of two blocks, under horizontal stress (Pa)."""
    text = LAWS + block("west", box=[2, 4, 8], at=[-1.5, 0, 4], fixed=True)
    text += block("east", box=[2, 4, 8], at=[1.5, 0, 4], fixed=True)
    text += block("floor", box=[1, 4, 1], at=[0, 0, -0.5], fixed=True)
    for name, height in (("low", 1.0), ("middle", 3.0), ("roof", 5.0)):
        text += block(name, box=[1, 2, 2], at=[0, 0, height])
    return text + stages + f"[in_situ]\nstress = [{stress}, 0, 0, 0, 0, 0]\n"


STAGES = """\
[[excavate]]
box = [1, 2, 2]
at = [0, 0, 1]
release_time = 0.1
[[excavate]]
corners = [[-1, -1, 2], [1, -1, 2], [-1, 1, 2], [1, 1, 2],
           [-1, -1, 4], [1, -1, 4], [-1, 1, 4], [1, 1, 4]]
start = 2.0
release_time = 0.2
"""


def test_a_roof_that_friction_holds_after_an_excavation_in_two_stages():
    """Once both blocks below are away, the walls hold the roof block: its factor of safety is the
    friction of both joints at the horizontal stress over its weight, within 0.1 %. Without friction
    enough it falls, and the walls hold both blocks after the first stage."""
    weight = UNIT_WEIGHT * 4
    stress = 1.4 * weight / (2 * 0.8 * 4)
    scene = parse(roof(stress, STAGES))
    assert [stage["blocks"] for stage in scene.stages] == [[3], [4]]
    assert [stage["start"] for stage in scene.stages] == [None, 2.0]
    assert [stage["release_time"] for stage in scene.stages] == [0.1, 0.2]
    assert solved(Statics(scene)).unstable.sum() == 0
    excavated = Statics(scene.excavated)
    assert excavated.is_free.tolist() == [False] * 5 + [True]
    assert excavated.is_removed.tolist() == [False] * 3 + [True] * 2 + [False]
    assert factor_of_safety(excavated, tolerance=5e-4) == pytest.approx(1.4, rel=1e-3)
    weak = parse(roof(0.9 / 1.4 * stress, STAGES))
    for count, unstable in ((0, []), (1, [4, 5]), (2, [5])):
        result = Statics(weak.after_stages(count)).solve()
        assert np.flatnonzero(result.unstable).tolist() == unstable


def test_check_reports_the_equilibrium_after_each_stage(tmp_path, capsys):
    file = tmp_path / "scene.toml"
    weight = UNIT_WEIGHT * 4
    file.write_text(roof(0.9 * weight / (2 * 0.8 * 4), STAGES))
    assert main(["check", str(file)]) == 0
    printed = capsys.readouterr().out
    first, _, second = printed.partition("after excavation stage 2")
    assert "initial state: in equilibrium" in first.partition("after excavation stage 1")[0]
    assert "middle" in first.partition("after excavation stage 1")[2]
    assert "roof" in second
    assert "middle" not in second


TUNNEL = """\
[[excavate]]
box = [2.2, 20, 2.4]
at = [0.3, 0, 3.1]
release_time = 0.1
"""


def test_rock_is_cut_along_an_excavation():
    """The removed blocks fill the region; cuts beyond it have the law of intact rock, and its
    outline the law of the scene."""
    laws = f'law = "rim"\n{LAWS}[laws.rim]\n{coulomb(0.3)}'
    sets = SETS.replace("[[rock.set]]\n", '[[rock.set]]\nlaw = "joint"\n')
    scene = mass(lines(stress=COMPONENTS), laws=laws, sets=sets + TUNNEL + "[run]\nskin = 0.01\n")
    removed = {*scene.stages[0]["blocks"]}
    volume = sum(scene.blocks[i].solid.volume for i in removed)
    gaps = sum(float(m.split()[3]) for m in scene.rocks[0].messages if m.startswith("a gap"))
    assert volume <= 2.2 * 2.4 * 6 + 1e-9
    assert volume + gaps >= 0.999 * 2.2 * 2.4 * 6
    whole = sum(one.solid.volume for one in scene.blocks)
    assert whole + gaps == pytest.approx(216.0, rel=1e-3)
    low, high = np.array([-0.8, -10, 1.9]), np.array([1.4, 10, 4.3])
    for i, one in enumerate(scene.blocks):
        vertices = one.solid.vertices
        if i in removed:
            assert (vertices > low - 1e-6).all()
            assert (vertices < high + 1e-6).all()
    statics = Statics(scene)
    names = np.array([*scene.laws])[statics.law]
    points = statics.points
    is_outline = np.isin(points.block_a, [*removed]) != np.isin(points.block_b, [*removed])
    at_edges = is_outline & (names == "joint")  # edges of blocks that lie on the outline
    assert points.area[at_edges].sum() < 1e-2 * points.area[is_outline].sum()
    assert {*names[is_outline & ~at_edges]} == {"rim"}
    assert INTACT_ROCK in names
    assert INTACT_ROCK not in names[is_outline]
    normals = np.abs(statics.axes[names == INTACT_ROCK, 0])
    assert normals.max(axis=1) == pytest.approx(np.ones(len(normals)))  # faces of the box
    assert "rim" not in names[~is_outline & (normals_of(statics) < 1 - 1e-9)]


def normals_of(statics):
    """Largest component (k,) of the normals of contact points."""
    return np.abs(statics.axes[:, 0]).max(axis=1)


def test_other_values_of_the_keys_are_felt():
    base = {"stress": COMPONENTS} | dict.fromkeys(SIDES, "fixed")
    still = Statics(mass(lines(**base), "", sets=COARSE))
    for key in SIDES:
        other = Statics(mass(lines(**base | {key: "rollers"}), "", sets=COARSE))
        assert (other.is_free_motion != still.is_free_motion).any()
        assert (other.is_free_motion.sum(axis=0) >= still.is_free_motion.sum(axis=0)).all()
    axial = lines(**base | {"stress": [4e6, 3e6, 2e6, 0, 0, 0]})
    other = Statics(mass(axial, "", sets=COARSE))
    assert not np.allclose(other.start, still.start, rtol=1e-3, atol=0)
    deep = [
        Statics(mass(f"k0 = 1\nsurface = {surface}\n", sets=COARSE))
        for surface in ("[[0, 0, 50]]", "[[0, 0, 60]]")
    ]
    assert (deep[1].start[:, 0] > deep[0].start[:, 0]).all()
    default = Statics(mass("k0 = 1\n", sets=COARSE))
    assert (default.start[:, 0] < deep[0].start[:, 0]).all()


CLOSED = CUBE + SETS + "[in_situ]\nstress = [1e9, 1e9, 1e9, 0, 0, 0]\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[in_situ]\n", "either k0 or stress"),
        ("[in_situ]\nk0 = 1\nstress = [1, 1, 1, 0, 0, 0]\n", "either k0 or stress"),
        ("[in_situ]\nstress = [1, 1, 0]\n", r"must be \[sxx, syy, szz, sxy, syz, szx\]"),
        ("[in_situ]\nk0 = -1\n", "in_situ.k0"),
        ("[in_situ]\nk0 = [1, 1, 1]\n", "one number, or two along x and y"),
        ('[in_situ]\nk0 = 1\nleft = "free"\n', "in_situ.left"),
        ("[in_situ]\nk0 = 1\nsurface = [[0, 0, 1], [1, 0, 1]]\n", "in_situ.surface: must be one"),
        ("[[excavate]]\nbox = [1, 1, 1]\nat = [9, 9, 9]\nrelease_time = 1\n", "no block is left"),
        ("[[excavate]]\nbox = [1, 1, 1]\n", "release_time' is missing"),
        ("[[excavate]]\nrelease_time = 1\n", r"excavate\[0\]: give one of `box`"),
        (
            "[[excavate]]\nrelease_time = 1\n"
            "corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]\n",
            "volume is zero",
        ),
        (TUNNEL + "start = -1\n", r"excavate\[0\].start"),
        (TUNNEL + TUNNEL, r"excavate\[1\]: no block is left there"),
    ],
)
def test_input_that_in_situ_stress_and_excavation_refuse(text, message):
    with pytest.raises(ValueError, match=message):
        parse(LAWS + CUBE + COARSE + text)


def test_a_stress_that_closes_joints_too_far_is_refused():
    with pytest.raises(ValueError, match=r"in_situ closes joints by up to 0\.1.*run\.skin"):
        Statics(parse(LAWS + CLOSED))
    scene = replace(parse(LAWS + CLOSED.replace("1e9", "1e7")), gravity=np.zeros(3))
    assert Statics(scene).start[:, 0].max() == pytest.approx(1e-3, rel=1e-6)


def test_k0_needs_gravity_that_points_down():
    with pytest.raises(ValueError, match="must point down"):
        mass("k0 = 1\n", top="gravity = [1, 0, -9]\n")


@pytest.mark.parametrize("strength", [1.4, 0.9])
def test_an_excavation_in_a_run(strength):
    """The stages begin at rest and at their time. With friction enough the roof block stays where
    it is, with too little it slides down between the walls."""
    weight = UNIT_WEIGHT * 4
    start = 0.15
    end = 0.4
    stages = STAGES.replace("start = 2.0", f"start = {start}")
    text = roof(strength * weight / (2 * 0.8 * 4), stages) + f"[run]\nend = {end}\n"
    sim = SpaceSimulation(parse(text))
    assert sim.verdict == "in equilibrium"
    while sim.time < end:
        sim.step()
    assert sim.stage_start_times.tolist() == [0.0, start]
    assert np.flatnonzero(sim.blocks.is_removed).tolist() == [3, 4]
    fall = sim.initial[2, 5] - sim.blocks.motion[2, 5]
    if strength > 1.0:
        assert abs(fall) < 1e-5
        assert abs(sim.energy_balance.error) < 1e-6
    else:
        # both free blocks slide after the first release; without release time it would be sooner
        acceleration = (1 - strength) * 9.81
        assert 0.5 * acceleration * (end - 0.1) ** 2 < fall < 0.5 * acceleration * end**2


def test_rock_in_a_run_stays_under_its_stress():
    scene = mass("k0 = 1.0\nsurface = [[0, 0, 103]]\n")
    sim = SpaceSimulation(parse(scene.text + "[run]\nend = 0.02\n"))
    assert sim.verdict == "in equilibrium"
    while sim.time < 0.02:
        sim.step()
    assert np.abs(sim.blocks.motion[:3] - sim.initial[:3]).max() < 1e-9
