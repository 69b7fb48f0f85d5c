"""Blocks in space computed by hand: every number that their files hold, as in the plane.

A slab overhangs the corner of a fixed base. Four springs at the corners of the contact carry its
weight, a load and seismic forces: displacement and rotation follow from the sums of forces and
moments about the middle of the contact. Another block hangs in the air; its displacement means
nothing. A column, field or key without an expected value fails.
"""

import json

import meshio
import numpy as np
import pytest
from by_hand import columns, compare
from scene_text import block, coulomb, lines

from dem_demo.cli import main
from dem_demo.space.output import SUMMARY_VERSION

NORMAL = 1e9  # Pa/m
SHEAR = 5e8
SECOND_ORDER = 1e-4  # relative: rotation of 3e-5 rad, and moments of forces that it displaces
G = 10.0
DENSITY = 2000.0
SEISMIC = np.array([0.02, -0.01, 0.0])
LOAD = np.array([300.0, 200.0, -500.0])
BASE = np.array([4.0, 4.0, 1.0])
BASE_CENTRE = np.array([-1.8, -1.6, -0.5])
SLAB = np.array([1.0, 2.0, 0.6])
SLAB_CENTRE = np.array([0.0, 0.0, 0.3])
LOOSE = np.array([0.5, 0.4, 0.3])
LOOSE_CENTRE = np.array([9.0, 8.0, 7.0])
TEXT = (
    lines(title="overhang", gravity=[0.0, 0.0, -G], seismic=SEISMIC, law="other", rough=30.0)
    + f"[laws.other]\n{coulomb()}[laws.unused]\n{coulomb(0.1)}"
    + f"[laws.bed]\n{coulomb(0.5, NORMAL, SHEAR)}"
    + block("base", box=BASE, at=BASE_CENTRE, fixed=True)
    + block("slab", box=SLAB, at=SLAB_CENTRE, density=DENSITY, load=LOAD)
    + block("loose", box=LOOSE, at=LOOSE_CENTRE)
    + "[[joint]]\n"
    + lines(between=["base", "slab"], law="bed", rough=30.0)
)
# The contact reaches from two faces of the slab to two faces of the base
LOW = SLAB_CENTRE[:2] - SLAB[:2] / 2
HIGH = BASE_CENTRE[:2] + BASE[:2] / 2
AREA = (HIGH - LOW).prod()
MIDDLE = np.array([*(LOW + HIGH) / 2, 0.0])
HALF_X, HALF_Y = (HIGH - LOW) / 2
WEIGHT = DENSITY * SLAB.prod() * G
FORCE = WEIGHT * SEISMIC + LOAD - [0.0, 0.0, WEIGHT]
MOMENT = np.cross(SLAB_CENTRE - MIDDLE, FORCE)
TRANSLATION = FORCE / AREA / [SHEAR, SHEAR, NORMAL]  # m, of the middle of the contact
ROTATION = MOMENT / AREA  # rad
ROTATION /= [NORMAL * HALF_Y**2, NORMAL * HALF_X**2, SHEAR * (HALF_X**2 + HALF_Y**2)]
ROUGH = np.array([-np.sin(np.radians(30.0)), np.cos(np.radians(30.0)), 0.0])  # north is y
STABLE = [0, 1]


def displacement_of_slab(points):
    """Displacements (m) of points (..., 3) of the slab."""
    return TRANSLATION + np.cross(ROTATION, points - MIDDLE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Files of the equilibrium."""
    place = tmp_path_factory.mktemp("overhang")
    (place / "overhang.toml").write_text(TEXT)
    words = [str(place / "overhang.toml"), "--no-pictures", "--vtk", "--out", str(place / "out")]
    assert main(words) == 0
    return place / "out"


def close(values, scale):
    """Values with the tolerance of second order of their scale."""
    return values, SECOND_ORDER * scale


DISPLACEMENT = displacement_of_slab(SLAB_CENTRE)
ARMS = np.array([[x, y, 0.0] for y in (-HALF_Y, HALF_Y) for x in (-HALF_X, HALF_X)])
CORNERS = MIDDLE + ARMS
CLOSURE = -displacement_of_slab(CORNERS)[:, 2]
SLIP = displacement_of_slab(CORNERS) * [1.0, 1.0, 0.0]


def test_files_are_the_known_ones(folder):
    actual = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    assert actual == {"summary.json", "blocks.csv", "vtk/blocks.vtu", "vtk/contacts.vtu"}


def test_every_column_of_blocks(folder):
    actual = columns(folder / "blocks.csv")
    assert actual.pop("block") == ("base", "slab", "loose")
    numbers = {name: np.array(texts, float) for name, texts in actual.items()}
    places = np.array([BASE_CENTRE, SLAB_CENTRE, LOOSE_CENTRE])
    expected = {
        "volume_m3": ([BASE.prod(), SLAB.prod(), LOOSE.prod()], 1e-12),
        "fixed": ([1, 0, 0], 0),
        "unstable": ([0, 0, 1], 0),
    }
    for i, axis in enumerate("xyz"):
        expected[f"{axis}_m"] = places[:, i], 1e-12
        expected[f"displacement_{axis}_m"] = close([0, DISPLACEMENT[i]], 3e-5)
        expected[f"rotation_{axis}_deg"] = close([0, np.degrees(ROTATION[i])], 2e-3)
    for name in numbers:
        if name.startswith(("displacement", "rotation")):
            numbers[name] = numbers[name][STABLE]
    compare(numbers, expected, "blocks.csv")


def test_every_field_of_blocks_in_vtk(folder):
    mesh = meshio.read(folder / "vtk" / "blocks.vtu")
    displaced = mesh.point_data.pop("displacement_m")
    assert not mesh.point_data
    of_slab = slice(8, 16)  # eight corners of a block follow each other
    corners = mesh.points[of_slab]
    np.testing.assert_allclose(np.abs(corners - SLAB_CENTRE), [SLAB / 2] * 8, atol=1e-12)
    assert len({*map(tuple, np.sign(corners - SLAB_CENTRE))}) == 8
    np.testing.assert_allclose(
        displaced[of_slab], displacement_of_slab(corners), rtol=0, atol=SECOND_ORDER * 6e-5
    )
    actual = {name: np.concatenate(parts) for name, parts in mesh.cell_data.items()}
    for name in ("displacement_m", "rotation_rad"):
        actual[name] = actual[name][STABLE]
    nothing = np.zeros(3)
    expected = {
        "block": ([0, 1, 2], 0),
        "displacement_m": close([nothing, DISPLACEMENT], 3e-5),
        "rotation_rad": close([nothing, ROTATION], 3e-5),
        "fixed": ([1, 0, 0], 0),
        "unstable": ([0, 0, 1], 0),
    }
    compare(actual, expected, "blocks.vtu")


def test_every_field_of_contacts_in_vtk(folder):
    mesh = meshio.read(folder / "vtk" / "contacts.vtu")
    order = np.lexsort(mesh.points[:, :2].round(6).T)
    np.testing.assert_allclose(mesh.points[order], CORNERS, rtol=0, atol=1e-12)
    assert [cells.type for cells in mesh.cells] == ["polygon"]
    actual = {name: values[order] for name, values in mesh.point_data.items()}
    expected = {
        "closure_m": close(CLOSURE, 4e-5),
        "normal_stress_Pa": close(NORMAL * CLOSURE, 4e4),
        # the slab drags the base along
        "shear_stress_Pa": close(SHEAR * SLIP, 4e4),
        "rough_direction": ([ROUGH] * 4, 1e-12),
    }
    compare(actual, expected, "points of contacts.vtu")
    cells = {name: np.concatenate(parts) for name, parts in mesh.cell_data.items()}
    expected = {"block_a": ([0], 0), "block_b": ([1], 0), "law": ([2], 0), "area_m2": (AREA, 1e-12)}
    compare(cells, expected, "cells of contacts.vtu")


def test_every_key_of_summary(folder):
    actual = json.loads((folder / "summary.json").read_text(), parse_constant=pytest.fail)
    x, y, z = LOOSE_CENTRE
    assert actual == {
        "version": SUMMARY_VERSION,
        "scene": "overhang",
        "equilibrium": "without equilibrium",
        "unstable": [
            {"block": "loose", "x_m": x, "y_m": y, "z_m": pytest.approx(z, abs=1e-12)},
        ],
        "free_blocks": 2,
        "contacts": 1,
        "contact_points": 4,
        "max_unbalanced_ratio": pytest.approx(0.0, abs=1e-6),
        "max_settlement_m": pytest.approx(np.linalg.norm(DISPLACEMENT), rel=SECOND_ORDER),
        "max_normal_stress_Pa": pytest.approx(NORMAL * CLOSURE.max(), rel=SECOND_ORDER),
        "files": ["blocks.csv", "vtk/blocks.vtu", "vtk/contacts.vtu"],
    }
