"""Which blocks of a scene in space stand, beside LMGC90 (contact dynamics, rigid contacts).

It needs `pip install compas_lmgc90`; without it the tests are skipped.
"""

import numpy as np
import pytest
from scene_text import block, coulomb
from wedges import WEDGES, wedge_text

from dem_demo.space import Statics, parse

compas = pytest.importorskip("compas.datastructures")
lmgc90 = pytest.importorskip("compas_lmgc90.solver")

pytestmark = pytest.mark.slow
TIME_STEP = 1e-3  # s
STEPS = 500
MOVED = 1e-3  # m: what stands has moved by rounding, what falls by centimetres
DENSITY = 2600.0  # kg/m3


def moves_in_lmgc90(solids, is_fixed, friction):
    """Whether each free solid has moved in half a second, gravity along -z."""
    meshes = [
        compas.Mesh.from_vertices_and_faces(solid.vertices.tolist(), [[*f] for f in solid.faces])
        for solid in solids
    ]
    solver = lmgc90.Solver(dt=TIME_STEP, density=DENSITY)
    solver.geometry_from_mesh(meshes)
    for i in np.flatnonzero(is_fixed).tolist():
        solver.v_drvdof[i] = {axis: np.zeros(STEPS + 1) for axis in range(1, 7)}
    solver.supports = [bool(fixed) for fixed in is_fixed]
    solver.contact_law("IQS_CLB", friction)
    solver.preprocess()
    solver.run(1)
    start = np.array([mesh.centroid() for mesh in solver.trimeshes])
    solver.run(STEPS - 1)
    end = np.array([mesh.centroid() for mesh in solver.trimeshes])
    solver.finalize()
    return np.linalg.norm(end - start, axis=1) > MOVED


@pytest.mark.parametrize("angle", [30.8, 31.1])
def test_a_block_on_an_incline(angle):
    """Friction 0.6: the limit is 30.96 degrees."""
    tilt = np.radians(angle)
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    text = "[laws.joint]\n" + coulomb(0.6)
    for name, size, center in (
        ("base", [6, 4, 0.5], [1, 0, -0.25]),
        ("block", [1, 1, 1], [0, 0, 0.5]),
    ):
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        corners = (0.5 * signs * size + center) @ turn.T
        text += block(name, corners=corners, fixed=name == "base")
    statics = Statics(parse(text))
    unstable = statics.solve().unstable
    moves = moves_in_lmgc90(statics.surfaces.solids, ~statics.is_free, 0.6)
    assert moves.tolist() == unstable.tolist() == [False, angle > 30.964]


@pytest.mark.parametrize("number", [0, 2])
def test_which_of_two_wedges_falls(number):
    """At 30 degrees of friction the factors are 1.435 and 0.839."""
    friction = np.tan(np.radians(30.0))
    statics = Statics(parse(wedge_text(WEDGES[number], coulomb(friction))))
    unstable = statics.solve().unstable
    moves = moves_in_lmgc90(statics.surfaces.solids, ~statics.is_free, friction)
    assert moves.tolist() == unstable.tolist()
    assert unstable.any() == (number == 2)
