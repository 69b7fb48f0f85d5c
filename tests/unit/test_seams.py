"""Every declared parameter of every element, off its default, in every place that it must reach.

No parameter is named here: a new one is tested by being declared.
"""

import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from kinds import PARAMETERS, off_default

import jointlaw as jl
from jointlaw.calibration.forward import build_law, log_stress, parameters_of_law
from jointlaw.kernels import reference

STEP = 2e-7  # m


@pytest.fixture(scope="module", params=PARAMETERS)
def pair(request):
    """A law with a parameter off its default, and the same law without."""
    return off_default(request.param)


def steps(law, count=20):
    """A path with closing, shear to the strength and beyond, opening, and closing again."""
    d = STEP * np.random.default_rng(5).normal(size=(count, law.dim))
    d[:4, 0] = 0.5 * STEP
    d[4:13] = 0.75 * STEP
    d[4:13, 0] = 0.02 * STEP
    d[13, 0] = -6.0 * STEP
    d[14:, 0] = 1.5 * STEP
    return d


def test_it_acts(pair):
    """Another value is another joint, but for the azimuth of a plane of a law without any."""
    tractions = []
    for law in pair:
        joint, alternative = law.joint(), law.joint()
        way = [joint.update(d)[0].tolist() for d in steps(law)]
        opens = np.outer(STEP * np.array([-0.15, -0.15, -0.5]), np.eye(law.dim)[0])
        tractions.append([*way, *(alternative.update(d)[0].tolist() for d in opens)])
    law, base = pair
    isotropic = law.tables.asperities is None and law.plane != base.plane
    assert (tractions[0] != tractions[1]) != isotropic


def test_files_fingerprint_and_copies_have_it(pair):
    law, base = pair
    assert law != base
    assert jl.JointLaw.from_text(law.to_toml()) == law
    assert pickle.loads(pickle.dumps(law)) == law
    with pytest.raises(ValueError, match="other parameters"):
        base.joint().restore(law.joint().snapshot())


def test_kernels_measures_and_bounds_agree(pair):
    law, _ = pair
    joints, state = law.joints(3), np.zeros((law.state_size, 1))
    k, damage = law.tables, np.zeros(3)
    for d in steps(law):
        F, C = joints.update(np.tile(d, (3, 1)))
        state, F_slow, C_slow = reference.step(k, state, d[:, None], True)
        size = np.abs(F_slow).max() + 1.0
        assert np.abs(F[0] - F_slow[:, 0]).max() <= 1e-12 * size
        assert np.abs(C[0] - C_slow[..., 0]).max() <= 1e-9 * np.abs(C_slow).max()
        assert np.abs(joints.F - F).max() <= 1e-9 * size  # a slider at its limit is cut again
        assert np.abs(reference.traction(k, state) - F_slow).max() <= 1e-9 * size
        slow = reference.measures(k, state)
        for mine, alternative in zip(joints.measures(), slow, strict=True):
            assert mine[0] == pytest.approx(alternative[0], rel=1e-9, abs=1e-12)
        assert joints.max_stiffness()[0] == pytest.approx(reference.stiffness(k, state)[0])
        if (joints.damage == damage).all() or (damage == 1).all():  # while it weakens it is steeper
            norm, here = np.linalg.norm(C[0], 2) * (1.0 - 1e-9), joints.delta[0]
            if d[0] > 0.0:  # where it opens the tangent is that of the way there
                assert norm <= joints.max_stiffness()[0]
            assert norm <= law.max_stiffness(here[0] + abs(d[0]), np.linalg.norm(here[1:]) + STEP)
        damage = joints.damage


def test_a_step_reads_none_of_the_rows_that_it_writes(pair):
    law, _ = pair
    k = law.tables
    state = np.zeros((law.state_size, 1))
    for d in steps(law)[:9]:
        state, _, _ = reference.step(k, state, d[:, None], False)
    delta = state[: law.dim]
    first_row = law.dim + 1
    for element in k.elements:
        rows = state[first_row : first_row + sum(element.rows.values())]
        first_row += len(rows)
        written = rows.copy()
        unset = np.full_like(rows, np.nan)
        d = steps(law)[9][:, None]
        expected = element.step(delta, d, rows, written, False)
        response = element.step(delta, d, rows, unset, False)
        np.testing.assert_array_equal(response.F, expected.F)
        np.testing.assert_array_equal(unset, written)


def test_first_loading(pair):
    """In one step or in many.

    Few cells slip later where asperities yield, by up to 0.2 %. Where slopes decrease by stress,
    one step turns the planes once for all of their change: its friction differs by up to 3 %, which
    is 0.3 % of the normal stress.
    """
    law, _ = pair
    facets = law.tables.asperities
    degrades = facets is not None and facets.degrades_by_stress
    for closure, parts in ((0.3e-6, 1), (1e-6, 1), (1e-6, 7)):
        joint, start = law.joint(), np.eye(law.dim)[0]
        for _ in range(parts):
            F, _ = joint.update(closure / parts * start)
        sparse = 5e-3 if degrades else 2e-3 if law.tables.yields else 1e-9
        assert F[0] == pytest.approx(law.normal_stress(closure), rel=sparse)
        assert law.closure(law.normal_stress(closure)) == pytest.approx(closure, rel=1e-9)


def test_energy(pair):
    """Stored and lost are the work of fine steps, to the second order of a step."""
    law, _ = pair
    joint, work, parts = law.joint(), 0.0, 400
    before, peak = np.zeros(law.dim), 0.0
    for d in steps(law):
        for _ in range(parts):
            F, _ = joint.update(d / parts, tangent=False)
            work += 0.5 * (before + F) @ d / parts
            before = F
        peak = max(peak, joint.stored_energy)
    assert joint.dissipated_energy >= 0.0
    assert joint.stored_energy + joint.dissipated_energy == pytest.approx(work, abs=5e-3 * peak)


def test_a_fit_keeps_it_or_refuses(pair):
    law, _ = pair
    if not isinstance(law, jl.JointLaw):
        with pytest.raises(ValueError, match=r"^law: .* cannot be fitted"):
            parameters_of_law(law)
        return
    values, settings = parameters_of_law(law)
    assert build_law(values, settings, law.plane) == law
    closure = np.array([0.3e-6, 1e-6])
    stress = [law.normal_stress(u) for u in closure]
    assert np.exp(log_stress(values, closure, settings)) == pytest.approx(stress, rel=1e-6)


def test_pages_tell_it():
    """The theory, or a page of how to use it, names every parameter."""
    docs = Path(__file__).parents[2] / "docs"
    text = "\n".join(page.read_text(encoding="utf-8") for page in docs.glob("*.md"))
    names = {path: rf"`(bond\.)?{path.rpartition('.')[2]}\b" for _, path, _ in PARAMETERS.values()}
    missing = [path for path, name in names.items() if not re.search(name, text)]
    assert not missing, f"no page of docs names {missing}"
