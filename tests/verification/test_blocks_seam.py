"""Blocks that slide over the seam between two coplanar blocks: as on one base.

The contact with the second base block continues the joint with the first one. Where the second
block is displaced, separated by more than a skin, or has joints of another law, it does not.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from running import until
from scene_text import ROCK, block, coulomb, dipping, lines

from dem_demo import Simulation, parse

COULOMB = coulomb(0.5, 1e9, 5e8)
DEGRADING = ROCK + "slope_wear = 50.0\nslope_residual = 0.2\n"
LAWS = pytest.mark.parametrize("law", [COULOMB, ROCK], ids=["coulomb", "rock"])
SLIDE = 0.4  # m/s
SKIN = 6e-3  # m
END_OF_SLAB = 1  # number of the slab's edge that faces across the seam
END_OF_SECOND = 3


def sliding_slab(
    law, split, roof=False, width=1.0, height=0.3, dip=0.0, gap=0.0, step=0.0, slant=0.0, end=1.2,
    prescribed=True,
):  # fmt: skip
    """A slab whose front is 2 cm before x = 0, where the base is split into two blocks.

    gap, step (m): of the second base block from the first one, along and across the face. slant
    (m): of the seam over its depth of 1 m. roof: whether a fixed block lies on the slab, and all
    joints are closed by 0.1 MPa. prescribed: whether a drive moves the slab, else gravity.
    """
    text = lines(gravity=dipping(dip)) + f"[laws.rock]\n{law}[laws.other]\n{coulomb(0.2, 2e9, 1e9)}"
    right = [[3.0, -1.0 + step], [3.0, step]]
    if split:
        first = [[-2.0, -1.0], [slant, -1.0], [0.0, 0.0], [-2.0, 0.0]]
        second = [[gap + slant, -1.0 + step], *right, [gap, step]]
        text += block("first", corners=first, fixed=True)
        text += block("second", corners=second, fixed=True)
    else:
        text += block("first", corners=[[-2.0, -1.0], *right, [-2.0, 0.0]], fixed=True)
    left, front = -0.02 - width, -0.02
    corners = [[left, 0.0], [front, 0.0], [front, height], [left, height]]
    text += block("slab", corners=corners)
    if roof:
        text += block("roof", box=[6.0, 1.0], at=[0.5, 0.5 + height], fixed=True)
        text += "[in_situ]\nstress = [1e5, 1e5, 0.0]\n"
    if prescribed:
        text += "[[drive]]\nblock = 'slab'\nmotion = 'x'\n"
        text += lines(times=[0.0, end], values=[0.0, SLIDE * end])
    return parse(text + "[run]\n" + lines(end=end, skin=SKIN))


def normal_force(sim, name):
    """Normal force (N) of the joints between the slab and the blocks called so."""
    names = [block.name for block in sim.scene.blocks]
    contacts = sim.contacts
    force = contacts.length * sim.joints.traction[:, 0]
    slab = names.index("slab")
    return sum(force[sim.manager.between(slab, names.index(n))].sum() for n in name if n in names)


def slide(scene, step):
    """The simulation at its end; and for each step normal forces (N) below and above the slab, and
    its position (m) and rotation."""
    sim = Simulation(scene, step=step)
    slab = [block.name for block in scene.blocks].index("slab")
    history = until(
        sim,
        scene.run.end,
        lambda: (
            normal_force(sim, ("first", "second")),
            normal_force(sim, ("roof",)),
            *sim.blocks.motion[:3, slab],
        ),
    )
    return sim, np.array(history)


def on_both_bases(end=1.2, **keys):
    """`slide` on one base, and over the seam, with the same time step."""
    one_base = sliding_slab(split=False, end=end, **{**keys, "slant": 0.0})
    step = 0.9 * Simulation(one_base).dt
    return slide(one_base, step), slide(sliding_slab(split=True, end=end, **keys), step)


@pytest.mark.parametrize(
    ("law", "slant"),
    [
        pytest.param(COULOMB, 0.0, id="square-coulomb"),
        pytest.param(ROCK, 0.0, id="square-rock"),
        pytest.param(COULOMB, 0.4, id="forward-coulomb", marks=pytest.mark.slow),
        pytest.param(ROCK, 0.4, id="forward-rock"),
        pytest.param(COULOMB, -0.4, id="back-coulomb", marks=pytest.mark.slow),
        pytest.param(ROCK, -0.4, id="back-rock", marks=pytest.mark.slow),
    ],
)
def test_normal_force_between_floor_and_roof(law, slant):
    """Without the joint of its neighbour the contact would start anew: the slab loses its dilation
    and half of its load. With it, the forces differ by the time step, 4e-4 at the seam."""
    keys = {"law": law, "roof": True, "slant": slant, "width": 0.5, "end": 0.6}
    (one, expected), (two, actual) = on_both_bases(**keys)
    assert expected[-1, 2] - expected[0, 2] > 0.2
    np.testing.assert_allclose(actual[:, :2], expected[:, :2], rtol=1e-3)
    assert actual[-1, :2] == pytest.approx(expected[-1, :2], rel=1e-5)
    assert abs(two.energy_balance.error - one.energy_balance.error) < 1e-5


def layer(name, left, right, low, high, seams, **keys):
    """Blocks of a layer that vertical seams divide."""
    bounds = [left, *seams, right]
    return "".join(
        block(f"{name} {i}", corners=[[a, low], [b, low], [b, high], [a, high]], **keys)
        for i, (a, b) in enumerate(pairwise(bounds))
    )


@pytest.mark.parametrize(
    "law",
    [pytest.param(COULOMB, id="coulomb", marks=pytest.mark.slow), pytest.param(ROCK, id="rock")],
)
def test_two_slabs_under_a_divided_roof(law):
    """Two slabs in a row slide over two seams of the floor, and under two of the roof."""
    end = 0.8

    def run(floor_seams, roof_seams, step=None):
        text = f"[laws.rock]\n{law}"
        text += layer("floor", -2.0, 3.0, -1.0, 0.0, floor_seams, fixed=True)
        text += layer("slab", -0.52, -0.02, 0.0, 0.3, [-0.26])
        text += layer("roof", -2.0, 3.0, 0.3, 1.3, roof_seams, fixed=True)
        text += "[in_situ]\nstress = [1e5, 1e5, 0.0]\n"
        for slab in ("slab 0", "slab 1"):
            text += f"[[drive]]\nblock = '{slab}'\nmotion = 'x'\n"
            text += lines(times=[0.0, end], values=[0.0, SLIDE * end])
        sim = Simulation(parse(f"{text}[run]\n{lines(end=end, skin=SKIN)}"), step=step)
        until(sim, end)
        names = np.array([block.name.split()[0] for block in sim.scene.blocks])
        contacts = sim.contacts
        pairs = np.char.add(names[contacts.block_a], names[contacts.block_b])
        force = contacts.area * sim.joints.traction[:, 0]
        return sim, [force[pairs == pair].sum() for pair in ("floorslab", "slabroof")]

    one, expected = run([], [])
    two, actual = run([0.0, 0.15], [0.1, 0.2], step=one.dt)
    assert actual == pytest.approx(expected, rel=1e-5)
    assert abs(two.energy_balance.error - one.energy_balance.error) < 1e-5


@LAWS
def test_free_load(law):
    """A slab under its own weight: normal force, and its height relative to its dilation."""
    (one, expected), (two, actual) = on_both_bases(law=law, width=0.5, height=0.15, end=0.6)
    np.testing.assert_allclose(actual[:, 0], expected[:, 0], rtol=1e-3)
    height = expected[:, 3] - 0.075
    assert actual[:, 3] - 0.075 == pytest.approx(height, abs=5e-3 * np.abs(height).max())
    assert abs(two.energy_balance.error - one.energy_balance.error) < 5e-5


@pytest.mark.parametrize(
    "law",
    [
        pytest.param(COULOMB, id="coulomb"),
        pytest.param(ROCK, id="rock", marks=pytest.mark.slow),
        pytest.param(DEGRADING, id="degrading"),
    ],
)
def test_free_slab_that_tilts(law):
    """A slab slides down 45 degrees: friction tilts it forward, by 1e-5 to 2e-4.

    On two bases it tilts by up to twice as much, because each joint acts at its two ends only, half
    of the length in the middle; beyond the seam it is as on one base.
    """
    keys = {"width": 0.6, "height": 0.5, "dip": 45.0, "prescribed": False, "end": 0.7}
    (_, expected), (two, actual) = on_both_bases(law=law, **keys)
    travel = expected[:, 2] - expected[0, 2]
    assert travel[-1] > 0.6 + 0.02  # over the seam with its whole length
    assert actual[:, 2] == pytest.approx(expected[:, 2], abs=1e-3 * travel[-1])
    rotation = np.abs(expected[:, 4]).max()
    assert rotation > 1e-5
    assert actual[-1, 4] == pytest.approx(expected[-1, 4], abs=1e-2 * rotation)
    height = np.abs(expected[:, 3] - 0.25).max()
    assert actual[-1, 3] == pytest.approx(expected[-1, 3], abs=1e-3 * height)
    beyond = len(expected) * 9 // 10  # a mean over vibrations of the slab
    assert actual[beyond:, 0].mean() == pytest.approx(expected[beyond:, 0].mean(), rel=1e-3)
    assert abs(two.energy_balance.error) < 1e-4


def slip_beyond_the_seam(scene):
    """Largest slip (m) of the joint with the second base block, 1 cm beyond the seam."""
    sim = Simulation(scene)
    until(sim, scene.run.end)
    second, slab = ([b.name for b in scene.blocks].index(name) for name in ("second", "slab"))
    joint = sim.manager.between(second, slab)
    assert joint.any()
    return sim, float(np.abs(sim.joints.delta[joint, 1]).max())


# 1 cm beyond the seam; a drive begins and ends with a ramp of 0.1 s
CROSSED = {"law": ROCK, "split": True, "end": 0.03 / SLIDE + 0.05}


def test_the_slip_of_the_neighbour_is_continued():
    _, slip = slip_beyond_the_seam(sliding_slab(**CROSSED))
    assert slip == pytest.approx(0.03, rel=0.05)


@pytest.mark.parametrize(
    "keys", [{"step": -0.2 * SKIN}, {"gap": 1.2 * SKIN}], ids=["displaced", "separated"]
)
def test_the_joint_of_a_block_elsewhere_is_not_continued(keys):
    _, slip = slip_beyond_the_seam(sliding_slab(**CROSSED, **keys))
    assert slip < 0.015  # since the contact was found


def with_edge_laws(law_of_edge):
    """The scene with the laws of these edges (by block and number of the edge)."""
    scene = sliding_slab(**CROSSED)
    names = [block.name for block in scene.blocks]
    edges = {(names.index(name), edge): law for (name, edge), law in law_of_edge.items()}
    return replace(scene, edge_laws=edges)


def test_the_joint_of_another_law_is_not_continued():
    bottom, top = ("slab", 0), ("second", 2)
    _, slip = slip_beyond_the_seam(with_edge_laws({bottom: "other", top: "other"}))
    assert slip < 0.015  # since the contact was found


def test_the_end_faces_may_have_another_law():
    """The contact is found between the end faces, and changes to the law of the faces on which it
    slides."""
    ends = {("slab", END_OF_SLAB): "other", ("second", END_OF_SECOND): "other"}
    sim, slip = slip_beyond_the_seam(with_edge_laws(ends))
    assert slip == pytest.approx(0.03, rel=0.05)
    assert (sim.manager.law[sim.joints.traction[:, 0] > 0] == 0).all()
    assert (sim.joints.law == sim.manager.law).all()


def test_a_run_resumed_before_the_seam_is_the_same_bit_by_bit():
    sim = Simulation(sliding_slab(**CROSSED))
    before = until(sim, 0.02 / SLIDE, sim.state)[-1]
    resumed = Simulation(sim.scene, saved=before)
    for one in (sim, resumed):
        until(one, 0.03 / SLIDE + 0.05)
    expected = sim.state()
    actual = resumed.state()
    assert all(np.array_equal(expected[name], actual[name]) for name in expected)
    assert np.abs(sim.joints.delta[:, 1]).min() > 0.02  # all joints have crossed


def neighbours_one_by_one(manager, rows, bears_load):
    """Neighbours (m,) of contacts as `find_neighbours` defines them, by a loop over all pairs."""
    contacts = manager.contacts
    outlines = manager.outlines
    corner = outlines.corner_position
    found = []
    for row in rows:
        law = manager.laws_of(contacts.edge_pairs[[row]])[0]
        a, b = contacts.block_a[row], contacts.block_b[row]
        max_step = 0.05 * 0.5 * (manager.skins[a] + manager.skins[b])
        best = (np.inf, -1)
        for other in np.flatnonzero(bears_load & (manager.law == law)):
            if abs(contacts.closure[other] - contacts.closure[row]) > max_step:
                continue
            for mine in (0, 1):
                for its in (0, 1):
                    shared, across = contacts.edge_pairs[other, [its, 1 - its]]
                    edge = contacts.edge_pairs[row, 1 - mine]
                    if shared != contacts.edge_pairs[row, mine]:
                        continue
                    if outlines.block[across] == outlines.block[edge]:
                        continue
                    along = outlines.edge_direction[edge].conj()
                    gaps = [(corner[across] - corner[outlines.next[edge]]) * along,
                            (corner[outlines.next[across]] - corner[edge]) * along]  # fmt: skip
                    gap = min(gaps, key=abs)
                    skin = manager.skins[outlines.block[edge]]
                    turned = outlines.edge_direction[across] * along
                    is_parallel = turned.real > 0 and abs(turned.imag) <= np.sin(np.radians(2))
                    if is_parallel and abs(gap) <= skin and abs(gap.imag) <= 0.05 * skin:
                        distance = abs(contacts.position[other] - contacts.position[row])
                        best = min(best, (distance, other))
        found.append(best[1])
    return found


def test_neighbours_are_found_as_by_a_loop_over_all_pairs():
    """In a wall of bricks, whose seams meet faces everywhere; some blocks have another law."""
    text = f"law = 'rock'\n[laws.rock]\n{COULOMB}[laws.other]\n{coulomb(0.2, 2e9, 1e9)}"
    text += block("floor", box=[9.0, 1.0], at=[0.0, -0.5], fixed=True)
    for row in range(3):
        for i in range(4):
            text += block(f"{row} {i}", box=[1.0, 0.5], at=[i + 0.5 * (row % 2), 0.25 + 0.5 * row])
    text += "[[joint]]\nbetween = ['1 1', '2 1']\nlaw = 'other'\n"
    sim = Simulation(parse(text + "[run]\n" + lines(end=1.0, skin=SKIN)))
    rng = np.random.default_rng(4)
    for _ in range(3):
        bears_load = rng.random(sim.joints.n) < 0.6
        is_new = rng.random(sim.joints.n) < 0.9
        sim.manager.bind_joints(2.0 * bears_load, 1e3 * bears_load[:, None] * [1.0, 0.0])
        rows, sources = sim.manager.find_neighbours(is_new)
        unloaded = np.flatnonzero(~bears_load & is_new)
        expected = np.array(neighbours_one_by_one(sim.manager, unloaded, bears_load))
        assert rows.tolist() == unloaded[expected >= 0].tolist()
        assert sources.tolist() == expected[expected >= 0].tolist()
        assert len(rows) > 5


def test_laws_of_another_dimension_are_refused():
    """Their joints would be read beyond the end of their arrays."""
    scene = sliding_slab(COULOMB, split=False)
    laws = {name: replace(law, plane=None) for name, law in scene.laws.items()}
    with pytest.raises(ValueError, match=r"'rock' has displacements of 3 components.*plane=0\.0"):
        Simulation(replace(scene, laws=laws))
