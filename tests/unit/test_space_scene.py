"""Scenes in space from their files: shapes, rocks, laws of joints, and errors in plain words."""

import re
from pathlib import Path

import numpy as np
import pytest
from scene_text import ROCK, block, coulomb

from dem_demo.scene import Files
from dem_demo.scene import parse as parse_in_plane
from dem_demo.space.keys import SCENE, not_there_yet
from dem_demo.space.read import parse
from dem_demo.space.scene import SpaceScene
from dem_demo.space.statics import Statics

LAWS = f"[laws.plain]\n{coulomb()}[laws.other]\n{coulomb(0.5)}"
ANISOTROPIC = "[laws.rough]\n" + ROCK.replace("a = 3.0", "a = 3.0, c = 0.3")
BASE = block("base", box=[6, 4, 1], at=[0, 0, -0.5], fixed=True)
BLOCK = block("block", box=[1, 1, 1], at=[0, 0, 0.5])
SETS = """\
[[rock.set]]
dip = 40
dip_direction = 150
spacing = 2.0
[[rock.set]]
dip = 80
dip_direction = 20
spacing = 3.0
law = "other"
rough = 30
"""
MASS = '[[rock]]\nname = "mass"\nbox = [8, 8, 8]\nat = [0, 0, 4]\nseed = 1\n'


def error_of(text, files=None):
    with pytest.raises(ValueError) as error:
        parse(text, "scene", files)
    return str(error.value)


def test_blocks_of_all_shapes():
    cube = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    text = LAWS + BASE + block("cube", corners=cube, density=2000.0, load=[1.0, 2.0, 3.0])
    scene = parse(text + block("corner", file="corner.obj"), files=Files(known={"corner.obj": obj}))
    assert isinstance(scene, SpaceScene)
    assert [b.name for b in scene.blocks] == ["base", "cube", "corner"]
    assert [b.solid.volume for b in scene.blocks] == pytest.approx([24.0, 1.0, 1 / 6])
    assert [b.fixed for b in scene.blocks] == [True, False, False]
    assert scene.blocks[1].mass == pytest.approx(2000.0)
    assert scene.blocks[1].load.tolist() == [1.0, 2.0, 3.0]
    assert scene.gravity.tolist() == [0.0, 0.0, -9.81]


def test_a_fixed_block_has_no_motions_of_its_own():
    motions = {"fixed_motions": ["x"]}
    moving = block("moving", box=[1, 1, 1], at=[2, 0, 0.5], **motions)
    scene = parse(LAWS + BASE.rstrip() + '\nfixed_motions = ["x"]\n' + moving)
    assert scene.blocks[0].prescribed == ()
    assert len(scene.blocks[1].prescribed) == 1


def test_a_scene_in_the_plane_is_read_as_before():
    text = "[laws.plain]\n" + coulomb() + block("base", box=[4, 1], fixed=True)
    text += block("block", box=[1, 1], at=[0, 1]) + "[run]\nend = 1\n"
    scene = parse(text)
    assert type(scene) is type(parse_in_plane(text))
    with pytest.raises(ValueError, match=r"in space: use dem_demo\.space"):
        parse_in_plane(LAWS + BASE + BLOCK)


def test_a_rock_is_cut_and_its_joints_have_the_laws_and_directions_of_their_sets():
    region = "[[rock.fixed]]\ndip = 40\ndip_direction = 150\nthrough = [0, 0, 3]\n"
    scene = parse(LAWS + MASS + SETS + region)
    assert sum(b.solid.volume for b in scene.blocks) == pytest.approx(512.0)
    rock = scene.rocks[0]
    assert [b.name for b in scene.blocks] == [f"mass {i + 1}" for i in rock.blocks]
    assert 0 < len(rock.free) < len(rock.blocks)
    statics = Statics(scene)
    for name, direction in (("plain", 150.0), ("other", 20.0)):
        is_law = statics.law == [*scene.laws].index(name)
        assert is_law.any()
        normal = statics.axes[is_law, 0]
        azimuth = np.degrees(np.arctan2(*(normal * np.sign(normal[:, 2:]))[:, :2].T))
        assert azimuth == pytest.approx(np.full(is_law.sum(), direction))
    axes = statics.axes[statics.law == 0]
    assert (axes[:, 1, 2] < 0).all()  # down the dip
    assert np.abs(axes[:, 1, 2]) == pytest.approx(np.sin(np.radians(40.0)))


def test_laws_of_a_rock_can_be_replaced_in_another_like_it():
    alternative = (
        '[[rock]]\nname = "copy"\nlike = "mass"\nat = [50, 0, 4]\nlaws = { plain = "other" }\n'
    )
    scene = parse(LAWS + MASS + SETS + alternative)
    names = [{law for b in r.blocks for law in scene.blocks[b].face_laws} for r in scene.rocks]
    assert names == [{None, "plain", "other"}, {None, "other"}]


def test_the_law_of_two_blocks_comes_before_the_default():
    joint = '[[joint]]\nbetween = ["base", "block"]\nlaw = "other"\nrough = 90\n'
    statics = Statics(parse(LAWS + BASE + BLOCK + joint))
    assert statics.law.tolist() == [1] * 4
    assert np.abs(statics.axes[:, 1]) == pytest.approx(np.tile([1.0, 0.0, 0.0], (4, 1)))
    default = Statics(parse('law = "plain"\nrough = 0\n' + LAWS + BASE + BLOCK))
    assert default.law.tolist() == [0] * 4
    assert default.axes[:, 1] == pytest.approx(np.tile([0.0, 1.0, 0.0], (4, 1)))


def test_small_blocks_have_a_small_range_of_detection():
    scene = parse(LAWS + BASE + BLOCK + block("chip", box=[0.1, 1, 1], at=[9, 0, 0]))
    assert scene.skins == pytest.approx([0.011, 0.011, 0.01])
    assert parse(LAWS + BASE + BLOCK + "[run]\nskin = 0.003\n").skins.tolist() == [0.003] * 2


FLAT = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
DRIVE = '[[drive]]\nmotion = "x"\ntimes = [0, 1]\nvalues = [0, 1]\n'
DENTED = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)] + [[0.5, 0.5, 0.5]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (BLOCK + block("flat", corners=FLAT), r"block\['flat'\].corners.*volume is zero"),
        (BLOCK + block("dent", corners=DENTED), r"\[0.5, 0.5, 0.5\] lies in.*must be convex"),
        (BLOCK + block("plane", box=[1, 1]), "three numbers.*scene in space"),
        (BLOCK + block("thin", box=[1, 1, 0]), "sides must be above 0"),
        (BLOCK + block("none"), "one of `box`"),
        (BLOCK + block("two", box=[1, 1, 1], file="a.obj"), "one of `box`"),
        (BLOCK + block("moved", corners=DENTED[:8], at=[0, 0, 9]), r"one of `box` \(with `at`\)"),
        (BLOCK + '[in_situ]\nbottom = "fixed"\n', "either k0 or stress"),
        (BLOCK + block("turned", box=[1, 1, 1], angle=3), "'block.2..angle' is unknown"),
        (BLOCK + BLOCK, "'block' is given twice"),
        (BLOCK + block("fast", box=[1, 1, 1], velocity=[1, 0, 0]), "'fast'.*run.end is missing"),
        (BLOCK + '[[joint]]\nbetween = ["base", "no"]\nlaw = "plain"\n', "joint.0..between"),
        (BLOCK + "[run]\nstep = 1\n", "run.end is missing.*leave out step"),
        (BLOCK + DRIVE, "drives move blocks, but run.end is missing"),
        (BLOCK + DRIVE + 'block = "base"\n' + DRIVE + "[run]\nend = 1\n", "prescribed twice"),
        (BLOCK + DRIVE.replace('"x"', '"turn"'), "motion = 'turn' is unknown"),
        (BLOCK + DRIVE.replace('"x"', '"turn_x"'), "name one; .*along x or y or z"),
        (BLOCK + "[monitor]\npoints = [[0, 0, 99]]\n", r"points\[0\].*lies in no block"),
        (MASS + SETS.replace("dip = 40", "dip = 91"), "dip = 91: must be from 0 to 90"),
        (MASS + SETS.replace("spacing = 2.0", "spacing = 1e-5"), "blocks; must be at most 1e"),
        (MASS + "min_width = 9\n" + SETS, "all blocks would be slivers"),
        (MASS + SETS.replace('"other"', '"none"'), "set.1..law"),
        (MASS + SETS + "[[rock.fixed]]\ndip = 3\n", r"fixed\[0\]: give one of"),
    ],
)
def test_errors_name_key_and_remedy(text, message):
    assert re.search(message, error_of(LAWS + BASE + text), re.DOTALL)


def test_more_errors():
    assert "no block can move" in error_of(LAWS + BASE)
    assert "gravity" in error_of("gravity = [0.0, -9.81]\n" + LAWS + BASE + BLOCK)
    nine = MASS.replace("[8, 8, 8]", "[1000, 1000, 1000]") + SETS.replace("3.0", "1.0")
    assert "blocks; must be at most 1e+05" in error_of(LAWS + nine.replace("2.0", "1.0") + SETS)
    plane = LAWS.replace("[laws.other]\n", "[laws.other]\nplane = 0.0\n")
    assert "laws.other.plane" in error_of(plane + BASE + BLOCK)
    weightless = "gravity = [0, 0, 0]\nseismic = [0.1, 0, 0]\n"
    assert "without gravity" in error_of(weightless + LAWS + BASE + BLOCK)


def test_an_anisotropic_law_needs_a_rough_direction():
    """Of a set, of a pair, and of joints in no set; then the scene is read."""
    assert "rough is missing: the law 'rough' of joints in no" in error_of(
        ANISOTROPIC + BASE + BLOCK
    )
    parse("rough = 45\n" + ANISOTROPIC + BASE + BLOCK)
    joint = '[[joint]]\nbetween = ["base", "block"]\nlaw = "rough"\n'
    assert "joint[0].rough is missing" in error_of(LAWS + ANISOTROPIC + BASE + BLOCK + joint)
    sets = SETS.replace('"other"', '"plain"')
    text = 'law = "rough"\n' + LAWS + ANISOTROPIC + MASS + sets
    assert "set[0].rough is missing" in error_of(text)
    parse(text.replace("dip = 40\n", "dip = 40\nrough = 10\n"))


def declared_keys(rules):
    """Names of all keys that a scene in space may have, of its tables too."""
    for name, rule in rules.items():
        table = rule[0] if isinstance(rule, list) else rule
        if isinstance(table, dict):
            yield from declared_keys(table)
        elif rule is not not_there_yet:
            yield name.removesuffix("!")


def test_the_page_has_a_row_for_each_key():
    page = (Path(__file__).parents[2] / "docs" / "space.md").read_text(encoding="utf-8")
    rows = page.partition("## The keys of a scene in space")[2].partition("\n## ")[0]
    documented = {*re.findall(r"`(\w+)`", rows)}
    assert not {*declared_keys(SCENE)} - documented
    assert documented - {*declared_keys(SCENE)} <= {
        "like", "plane", "pressure", "set", "sine", "c",
    }  # fmt: skip


def test_blocks_that_overlap_as_drawn_are_named():
    scene = parse(LAWS + BASE + block("low", box=[1, 1, 1], at=[0, 0, 0.4]))
    with pytest.raises(ValueError, match=r"'base' and 'low' overlap by 0\.1 m"):
        Statics(scene)
