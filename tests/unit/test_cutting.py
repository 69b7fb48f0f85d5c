"""Cutting a rock outline by joint sets: shapes of blocks, slivers, and the set of each edge."""

import numpy as np
import pytest
from shapely import Polygon

from dem_demo.scene.blocks import find_shape_error
from dem_demo.scene.cutting import INWARD_CUT, JointSet, cut

SQUARE = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])
SLOPE = np.array([[-12.0, 0], [6, 0], [6, 1], [2, 1], [-2, 9], [-12, 9]])
STEEP = JointSet(-60.0, 1.6, "steep", persistence=0.7, scatter=0.3)
FLAT = JointSet(36.0, 1.2, "flat", scatter=0.2, through=(2.0, 1.0))


def test_a_regular_grid_is_exact():
    """Ten by five blocks of 1 m by 2 m, for both orders of the corners of the outline."""
    sets = [JointSet(0.0, 2.0, "a"), JointSet(90.0, 1.0, "b")]
    for outline in (SQUARE, SQUARE[::-1]):
        blocks, edge_sets, merged, dropped = cut(outline, sets, seed=0, min_width=0.1)
        assert (len(blocks), merged, dropped) == (50, 0, [])
        for block, numbers in zip(blocks, edge_sets, strict=True):
            # Rounding of coordinates of size 10.
            assert np.ptp(block, axis=0) == pytest.approx([1.0, 2.0], abs=1e-13)
            on_outline = np.isclose(block, 0.0).any() or np.isclose(block, 10.0).any()
            assert (numbers == -1).any() == on_outline
            assert sorted(set(numbers[numbers >= 0].tolist())) == [0, 1]  # no INWARD_CUT


@pytest.mark.parametrize("seed", range(6))
def test_blocks_are_convex_wide_enough_and_fill_the_rock(seed):
    """Only reported slivers are lost, and no blocks overlap; the toe of the slope bends inwards."""
    blocks, _edge_sets, _merged, dropped = cut(SLOPE, [FLAT, STEEP], seed, min_width=0.25)
    shapes = [Polygon(block) for block in blocks]
    assert all(find_shape_error(block) is None for block in blocks)
    lost = sum(sliver.area for sliver in dropped)
    assert lost < 0.05
    # Merging fills gaps of 1e-7 of the rock's size at most.
    assert sum(s.area for s in shapes) == pytest.approx(Polygon(SLOPE).area - lost, abs=1e-4)
    for i, shape in enumerate(shapes):
        assert (
            max((shape.intersection(alternative).area for alternative in shapes[:i]), default=0)
            < 1e-5
        )
    for block in blocks:
        edge = np.roll(block, -1, axis=0) - block
        normal = np.stack([-edge[:, 1], edge[:, 0]]) / np.hypot(*edge.T)
        assert np.ptp(block @ normal, axis=0).min() >= 0.25


def test_persistence_is_the_share_of_length_that_is_a_joint():
    """Vertical joints between 40 beds: 40 x 79 pieces of equal length, each present or absent."""
    outline = SQUARE * [8.0, 4.0]
    sets = [JointSet(0.0, 1.0, "bed"), JointSet(90.0, 1.0, "cross", persistence=0.3)]
    blocks, _edge_sets, _merged, _dropped = cut(outline, sets, seed=5, min_width=0.1)
    fraction = (len(blocks) - 40) / (40 * 79)
    assert fraction == pytest.approx(0.3, abs=3 * np.sqrt(0.3 * 0.7 / (40 * 79)))  # three sigma
    assert len(cut(outline, [sets[0]], 5, 0.1)[0]) == 40


def test_joint_sets_cut_the_rock_around_its_openings():
    """An opening that no joint meets is cut through at its corners; one at the rim is a notch."""
    holes = [
        [[1.2, 1.2], [1.8, 1.2], [1.5, 1.8]],
        [[9.0, 4.5], [11.0, 4.5], [11.0, 6.5], [9.0, 6.5]],
    ]
    sets = [JointSet(0.0, 5.0, "a"), JointSet(60.0, 5.0, "b", through=(5.0, 5.0))]
    blocks, _, _, dropped = cut(SQUARE, sets, 0, 0.01, [np.array(hole) for hole in holes])
    shapes = [Polygon(block) for block in blocks]
    openings = [Polygon(hole) for hole in holes]
    assert all(find_shape_error(block) is None for block in blocks)
    assert max(s.intersection(hole).area for s in shapes for hole in openings) < 1e-6
    # 0.18 m2 and the part of 2 m2 inside the rock
    assert sum(s.area for s in shapes) + sum(s.area for s in dropped) == pytest.approx(
        100 - 0.18 - 2, abs=1e-4
    )
    for outline, hole in ((SQUARE + 5.0, holes[0]), (SQUARE, SQUARE)):
        with pytest.raises(ValueError, match=r"hole\[0\] must take a part of the rock away"):
            cut(outline, sets, 0, 0.01, [np.array(hole)])


def test_a_sliver_merges_with_a_neighbour_or_is_dropped():
    """A joint 0.1 m from the side: a strip that only its neighbour can take."""
    sets = [JointSet(90.0, 9.9, "a", through=(9.9, 0.0))]
    blocks, _, merged, _ = cut(SQUARE, sets, seed=0, min_width=0.2)
    assert (len(blocks), merged) == (1, 1)
    assert Polygon(blocks[0]).area == pytest.approx(100.0, abs=1e-9)
    # With this seed the joint between the beds does not cut the strip. Merged with either bed it
    # would not be convex, so each bed takes a part, and the joint is extended through the strip.
    beds = JointSet(0.0, 6.0, "b", through=(0.0, 5.0), persistence=0.5)
    blocks, edge_sets, merged, dropped = cut(SQUARE, [*sets, beds], seed=6, min_width=0.2)
    assert (len(blocks), merged, dropped) == (2, 2, [])
    assert [Polygon(block).area for block in blocks] == pytest.approx([50.0, 50.0], abs=1e-9)
    assert [(numbers == 1).sum() for numbers in edge_sets] == [1, 1]
    # Between an opening and the side of the rock no neighbour can take it.
    hole = np.array([[1.0, 1.0], [9.95, 1.0], [9.95, 9.0], [1.0, 9.0]])
    cross = [JointSet(0.0, 5.0, "a", through=(0.0, 1.0)), JointSet(90.0, 20.0, "b")]
    blocks, _, _, dropped = cut(SQUARE, cross, 0, 0.2, [hole])
    assert sum(s.area for s in dropped) > 0
    rest = Polygon(SQUARE).area - Polygon(hole).area - sum(s.area for s in dropped)
    assert sum(Polygon(block).area for block in blocks) == pytest.approx(rest, abs=1e-9)


def test_cuts_through_inward_corners_are_not_joints():
    """A notch in a corner of the rock, far from all joints: one cut, of both blocks beside it."""
    notched = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 7.0], [7.0, 7.0], [7.0, 10.0], [0.0, 10.0]])
    blocks, edge_sets, _, _ = cut(notched, [JointSet(0.0, 4.0, "a", through=(0.0, 2.0))], 0, 0.1)
    assert sum((numbers == INWARD_CUT).sum() for numbers in edge_sets) == 2
    cuts = [block[numbers == INWARD_CUT] for block, numbers in zip(blocks, edge_sets, strict=True)]
    assert np.concatenate(cuts)[:, 1] == pytest.approx([7.0, 7.0])
