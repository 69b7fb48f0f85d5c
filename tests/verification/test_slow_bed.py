"""Accuracy that is promised is kept: on random paths against the slow bed, and tolerances. In small
cycles: many depth cells against a closed form, what named resolutions miss, what is forgotten."""

from dataclasses import replace

import numpy as np
import pytest
from builders import increments, law, random_corners
from extremes.laws import SCALE, build
from scipy.integrate import trapezoid
from slow_bed import SlowBed

import jointlaw as jl
from jointlaw.accuracy.suite import reference_resolution, relative_errors, standard_suite, tractions
from jointlaw.accuracy.tolerance import find_coarsest_resolution

pytestmark = pytest.mark.slow


# bed: its inclinations, azimuths and springs; bounds: what "fine" and "reference" promise, and the
# bed errs by 0.05 %; parts: whether joints part wholly and touch again
USUAL = {"paths": 5, "steps": 30, "bed": (8, 24, 200), "bounds": (1e-2, 3e-3), "parts": True}
LAW = {"a": 3.0, "b": 0.5, "c": 0.1, "mu": 0.4, "formation": "population"}
# facets that were pressed flat touch all at once: a coarser bed misses more than `reference`; on 20
# paths of 0.05, of 0.1 and of 0.3 ranges: 2.7, 1.4 and 1.3 %, 0.41, 0.27 and 0.18 %
YIELDS = USUAL | {"paths": 2, "bed": (24, 60, 60), "bounds": (3e-2, 5e-3)}
FADES = YIELDS | {"paths": 1, "steps": 200}
CASES = {
    "population": (USUAL, LAW | {"mu": 0.3}, 0),
    "individual": (
        USUAL, {"a": 1.4, "b": 0.0, "c": 0.2, "mu": 0.5, "formation": "individual"}, 1,
    ),
    "uniform": (USUAL, {"a": 2.0, "b": 1.0, "c": -0.1, "mu": 0.6, "lam": 1.0, "eta": 0.3}, 2),
    "smooth": (USUAL, {"a": 6.0, "b": -0.5, "c": 0.3, "mu": 0.7, "formation": "population"}, 3),
    # near 90 degrees the closure grows as the tangent: more inclinations; facets see closures far
    # beyond the depth nodes, and never all part
    "wild": (
        USUAL | {"bed": (20, 32, 200), "bounds": (3e-2, 9e-3), "parts": False},
        {"a": 1.0, "b": -0.5, "c": -0.2, "mu": 0.4, "lam": 0.8, "formation": "individual"}, 4,
    ),
    "yields late": (YIELDS, LAW | {"damage": {"yield_interference": 0.3}}, 30),
    "yields": (YIELDS, LAW | {"damage": {"yield_interference": 0.1}}, 10),
    "yields soon": (YIELDS, LAW | {"formation": None, "damage": {"yield_interference": 0.05}}, 5),
    "yields and fades": (
        FADES, LAW | {"damage": {"yield_interference": 0.1}, "mating_length": 0.6}, 10,
    ),
    "fades": (FADES | {"bounds": (1.5e-2, 3e-3)}, LAW | {"mating_length": 0.6}, 50),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_tractions_agree_with_the_slow_bed(name):
    case, parameters, seed = CASES[name]
    d = increments(random_corners(np.random.default_rng(seed), case["paths"]), case["steps"])
    beds = [SlowBed(law(**parameters), path, *case["bed"]) for path in np.cumsum(d, axis=1)]
    exact, energy = (np.array(part) for part in zip(*(bed.follow() for bed in beds), strict=True))
    peak = np.linalg.norm(exact, axis=2).max(axis=1)
    for resolution, bound in zip(("fine", "reference"), case["bounds"], strict=True):
        joints, rows = law(**parameters, resolution=resolution).joints(len(d)), []
        for step in np.moveaxis(d, 1, 0):
            F, _ = joints.update(step, tangent=False)
            rows.append((F, joints.stored_energy, joints.measures().separated > 1.0 - 1e-12))
        F, stored, apart = (np.stack(part, axis=1) for part in zip(*rows, strict=True))
        # the paths do what they claim
        assert (apart[:, :-1] & ~apart[:, 1:]).any() == case["parts"]
        error = np.linalg.norm(F - exact, axis=2).max(axis=1) / peak
        assert error.max() < bound, (resolution, error)
        # energy is quadratic in the force: twice its error
        gap = np.abs(stored - energy).max(axis=1) / energy.max(axis=1)
        assert gap.max() < 2.0 * bound
        # the bed takes the mean squeeze of a step: first order in the step
        np.testing.assert_allclose(joints.plastic_work, [bed.crushed for bed in beds], rtol=0.05)


def test_reference_of_the_suite_agrees_with_the_slow_bed():
    law = jl.JointLaw(
        orientation=jl.Orientation(4.0, 0.5, 0.1),
        asperity=jl.Asperity(K=1.0, lam=1.2, eta=0.5, mu=0.5),
        asperity_density=1.0,
        closure_range=1.0,
    )
    suite = standard_suite(law)
    paths = np.moveaxis(np.cumsum(suite.d, axis=0), 1, 0)
    F = np.stack([SlowBed(law, path, 6, 16, 120).follow()[0] for path in paths], axis=1)
    # the bed's own orientations (0.12 % here) and springs, and the reference's uncertainty
    assert relative_errors(F, suite.F).max() < 2.5e-3
    assert suite.uncertainty[: len(paths)].max() < 5e-4
    # and the paths do what they say: the normal stress is kept while sheared
    held = [i for i, name in enumerate(suite.names) if name.startswith(("shear", "reversal"))]
    stress = float(law.normal_stress(1.0)) / 2
    np.testing.assert_allclose(suite.F[15:, held, 0], stress, rtol=2e-2)


def test_depth_cells_converge_beyond_the_closure_range():
    """Cells that end with the range leave an error that no number of them takes away."""
    law = replace(jl.presets.load("biegel-rough"), plane=0.0)
    suite = standard_suite(law)
    far = suite.d[:, [suite.names.index("far")]]
    found = [
        tractions(replace(law, resolution=jl.Resolution(8, 7, depth)), far)
        for depth in (16, 32, 128)
    ]
    coarse, fine = (relative_errors(F, found[-1])[0] for F in found[:2])
    assert fine < 6e-4
    assert coarse > 2.8 * fine  # second order: 4; it is 2 where the cells end with the range


def test_reference_is_refined_in_the_direction_that_errs():
    law = jl.JointLaw(  # nearly linear: all slip begins at once, and azimuths decide
        orientation=jl.Orientation(2.0, -0.4, -0.35),
        asperity=jl.Asperity(K=1.0, lam=1.4, eta=0.02, mu=0.36),
        asperity_density=1.0,
        closure_range=1.0,
        plane=0.0,
    )
    usual, bound = reference_resolution(law), 6e-4
    assert standard_suite(law).uncertainty.max() > bound  # too coarse a judge
    found, reached = find_coarsest_resolution(law, bound)
    fine = standard_suite(law, replace(usual, phi=2 * usual.phi))
    assert found is not None
    assert reached <= bound
    # half of the bound may be the judge's own error
    assert fine.errors(replace(law, resolution=found)).traction.max() < 1.5 * bound


def test_what_cannot_be_met_is_refused_with_what_was_reached():
    law = replace(jl.presets.load("linear-a6"), plane=0.0)
    with pytest.raises(ValueError, match=r"tolerance = 1e-07 cannot be met .* the smallest error"):
        law.at_tolerance(1e-7)


def ratios(made, law, count, tolerance):
    """Errors (paths,) of a law with cells of its own on random paths within the closure range, over
    the tolerance."""
    corners = law.closure_range * random_corners(np.random.default_rng(2), count)[:, :, :2]
    d = np.ascontiguousarray(np.moveaxis(increments(corners, 20), 1, 0))
    truth = tractions(replace(law, resolution=reference_resolution(law)), d)
    return relative_errors(tractions(made, d), truth) / tolerance


@pytest.mark.parametrize("name", ["westerly-smooth", "biegel-rough", "nonlinear-a6"])
def test_tolerances_are_kept_on_paths_never_seen(name):
    law, sliders = replace(jl.presets.load(name), plane=0.0), []
    for tolerance in (0.05, 0.02):
        made = law.at_tolerance(tolerance)
        assert replace(made, resolution=law.resolution) == law
        sliders.append(made.resolution.sliders)
        found = ratios(made, law, 6, tolerance)
        # never twice the tolerance, and on these six paths the tolerance but for one at most
        assert found.max() < 2.0
        assert np.sort(found)[-2] <= 1.0
    assert sliders == sorted(sliders)


def test_closure_only_takes_closures_alone():
    law = replace(jl.presets.load("westerly-rough"), closure_only=True)
    made = law.at_tolerance(0.01)
    assert made.closure_only
    assert made == law.at_tolerance(0.01)
    assert [row.traction_error.shape for row in law.tradeoff(["fast"], joints=0).rows] == [(4,)]


@pytest.mark.parametrize("name", ["westerly-smooth", "nonlinear-a6"])
def test_tolerances_are_kept_at_all_stresses_of_a_range(name):
    """Cells for the closure range alone err by up to 17 % within a hundredth of it."""
    law, stress = replace(jl.presets.load(name), plane=0.0), (1e4, 5e6)
    made = law.at_tolerance(0.02, stress=stress)
    assert made.closure_range == pytest.approx(law.closure(5e6), rel=1e-12)
    for most in np.geomspace(*stress, 5):
        near = replace(law, closure_range=float(law.closure(most)))
        assert ratios(made, near, 12, 0.02).max() <= 1.0


MU, LAM = 0.4, 1.2
CLOSURE, CYCLES, STEPS = 0.7, 4, 8  # of the closure range; that is measured; of a quarter cycle
LIMIT = MU * LAM * CLOSURE  # shear at which all slips
AMPLITUDES = 10.0 ** np.linspace(-3.0, 0.0, 25)


def loops(one, amplitude):
    """Loss (J/m2) and secant (Pa/m) of the fourth cycle of shear of each amplitude (n,) in m."""
    batch, way = one.joints(len(amplitude)), np.array([0.0, 1.0])
    batch.update(np.tile([CLOSURE * one.closure_range, 0.0], (len(amplitude), 1)), tangent=False)
    quarter = amplitude[:, None] / STEPS * way

    def sheared(sign, quarters):
        for _ in range(quarters * STEPS):
            F, _ = batch.update(sign * quarter, tangent=False)
        return F[:, 1]

    sheared(1.0, 1)
    for _ in range(CYCLES):
        before = batch.dissipated_energy + batch.stored_energy
        low, high = sheared(-1.0, 2), sheared(1.0, 2)
    loss = batch.dissipated_energy + batch.stored_energy - before
    return loss, (high - low) / (2.0 * amplitude)


def test_cells_as_thin_as_the_cycle_keep_its_loss():
    """Hertz contacts of one orientation; docs/limits.md asks for more depth cells. The branches of
    a cycle are twice the first loading of Eq. 35 (Masing)."""
    coarse, fine, finest = [], [], []
    left = np.maximum(1.0 - AMPLITUDES / LIMIT, 0.0)  # of the way to full slip
    end, area = 1.0 - left**1.5, AMPLITUDES - LIMIT * 0.4 * (1.0 - left**2.5)
    exact = np.array([8.0 * area - 4.0 * AMPLITUDES * end, end / AMPLITUDES])
    for found, depth in ((coarse, 8), (fine, 100), (finest, 1000)):
        nodes = jl.Resolution(1, 3, depth)
        one = law(a=1e9, b=0.0, c=0.0, mu=MU, lam=LAM, plane=0.0, resolution=nodes)
        found += list(loops(one, AMPLITUDES) / (MU * one.normal_stress(CLOSURE) * exact) - 1.0)
    large = AMPLITUDES > 0.3
    assert np.abs(coarse[0][large]).max() < 0.1
    assert np.abs(coarse[0][~large]).max() > 0.5
    assert np.abs(fine[0][AMPLITUDES > 0.02]).max() < 0.1
    assert np.abs(finest[0]).max() < 0.25
    assert np.abs(finest[1]).max() < 1e-3


PAGE = {  # loss at amplitudes 0.1 and 0.32, shear kept after 100 openings by 0.01 and 0.1
    "balanced": ((1.20, 1.05), (0.848, 0.786)),
    "fine": ((1.11, 1.01), (0.952, 0.883)),
}


def test_small_cycles_of_named_resolutions_are_as_the_page_says():
    """The figures of docs/limits.md, "Damping in small cycles", against the slow bed."""
    one = replace(jl.presets.load("westerly-rough"), plane=0.0)
    R, exact = one.closure_range, []
    amplitudes = AMPLITUDES[[16, 20]] * R
    for amplitude in amplitudes:
        quarter = np.linspace(0.0, amplitude, 41)[1:]
        back = np.concatenate([quarter[::-1][1:], [0.0], -quarter])
        shear = np.concatenate([[0.0], quarter, np.tile([*back, *-back], CYCLES)])
        path = np.column_stack([np.full(len(shear), CLOSURE * R), shear, 0.0 * shear])
        F, _ = SlowBed(one, path, 6, 16, 300).follow()
        last = slice(-2 * len(back) - 1, None)
        exact.append(trapezoid(F[last, 1], shear[last]))
    for name, (ratios, kept) in PAGE.items():
        made = replace(one, resolution=name)
        # 300 springs, orientations and the trapezoids of 40 steps a quarter, each below 1 %
        np.testing.assert_allclose(loops(made, amplitudes)[0] / exact, ratios, rtol=2e-2)
        joints = made.joints(2)
        joints.update(np.tile([CLOSURE * R, 0.0], (2, 1)))
        locked, _ = joints.update(np.tile([0.0, 0.1 * R], (2, 1)))
        opening = CLOSURE * R * np.array([[0.01, 0.0], [0.1, 0.0]])
        for _ in range(100):
            joints.update(-opening, tangent=False)
            left, _ = joints.update(opening, tangent=False)
        np.testing.assert_allclose(left[:, 1] / locked[:, 1], kept, atol=1e-3)


@pytest.mark.parametrize(
    ("depth", "eta"),
    [(1, 0.0), (3, 0.0), (1, 1.0), (3, 1.0), *((n, 0.5) for n in (1, 2, 3, 10, 24))],
)
def test_small_normal_cycles_forget_locked_in_shear_at_a_known_rate(eta, depth, record):
    """A cell is one slider: unloading takes a share of all it holds, not of what touched last.

    With c = (zeta/y)^eta of the cell in which the closure y lies, that cell keeps kappa1/kappa0 =
    [(1 - amplitude)^eta - c]/(1 - c) of its part 1 - c each cycle; the cells above keep theirs.
    """
    amplitude, counts = 1e-2, (1, 10, 100, 1000, 10_000)
    # flat faces that hardly slip
    one = build(resolution=jl.Resolution(1, 3, depth), a=1e6, mu=10.0, eta=eta)
    nodes = one.tables.asperities.depth[0]
    zeta = nodes[nodes < SCALE * (1.0 - amplitude)].max() / SCALE
    c = zeta**eta if zeta > 0.0 else 0.0
    share = 1.0 - c if eta > 0.0 else 0.0  # at eta = 0 one spring holds all, and keeps it
    kept = ((1.0 - amplitude) ** eta - c) / (1.0 - c) if eta > 0.0 else 1.0
    expected = [1.0 - share + share * kept**n for n in counts]
    joint, d, left = one.joint(), np.array([amplitude * SCALE, 0.0, 0.0]), []
    joint.update([SCALE, 0.0, 0.0])
    locked = joint.update([0.0, 0.1 * SCALE, 0.0])[0]
    for more in np.diff(counts, prepend=0):
        for _ in range(more):
            joint.update(-d, tangent=False)
            F = joint.update(d, tangent=False)[0]
        left.append(F[1] / locked[1])
    # F carries rounding of each of 300 products; the facets of a = 1e6 lean by 1e-6; and sliders of
    # a cell are at their caps together where the springs last touched alone would be
    np.testing.assert_allclose(left, expected, atol=1e-5)
    if eta == 0.5:
        record("forgetting", depth, *left)
