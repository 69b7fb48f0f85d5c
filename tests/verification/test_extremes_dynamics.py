"""One mass on one joint under explicit integration at 0.95 of the critical time step."""

import extremes.dynamics
import numpy as np
import pytest
from extremes import FULL
from extremes.dynamics import AREA, CASES, LOSSLESS, LOSSLESS_IMPACTS, MASS, SHORT, Mass, swing

pytestmark = pytest.mark.slow
STEPS = 1_000_000 if FULL else SHORT


@pytest.fixture
def swung(record, monkeypatch):
    """`swing`, whose figures are recorded."""
    if FULL:
        monkeypatch.setattr(extremes.dynamics, "EVERY", 97)  # looks at the energy cost most

    def run(case, steps, share=0.95, n=4):
        found = swing(case, steps, n, share)
        record("dynamics", case, share, steps, *found)
        return found

    return run


@pytest.mark.parametrize("case", [c for c in CASES if c not in (*LOSSLESS, *LOSSLESS_IMPACTS)])
def test_with_friction_energy_never_rises_above_the_first(case, swung):
    """At 0.95 of the critical step, impacts from opening and a friction of 0.01 included: no more
    than the rounding of the sums that energy is."""
    above, growth, reached = swung(case, STEPS)
    assert reached <= 1.0
    assert max(above, growth) <= 1e-12


@pytest.mark.parametrize("case", LOSSLESS)
def test_lossless_lasting_contact_keeps_its_energy(case, swung):
    """Leapfrog keeps that of a linear spring to rounding; that of a Hertz contact at 0.95 of its
    critical step comes and goes by 1 %, and after a tenth of the run no farther than before."""
    above, growth, reached = swung(case, STEPS)
    assert reached <= 1.0 or "linear" in case  # which is as stiff at any closure
    assert above <= (0.02 if case == "Hertz, no friction" else 1e-12)
    assert growth <= (1e-3 if case == "Hertz, no friction" else 1e-12)


@pytest.mark.parametrize("case", LOSSLESS_IMPACTS)
def test_lossless_impacts_hardly_drift_at_a_fifth_of_the_critical_step(case, swung):
    above, _, reached = swung(case, STEPS if FULL else 2 * SHORT, share=0.2)
    assert reached <= 1.0
    assert above < (0.05 if FULL else 0.02)  # without friction it grows, slowly


@pytest.mark.parametrize("case", LOSSLESS_IMPACTS)
def test_lossless_impacts_pass_their_bound_near_the_critical_step(case, swung):
    _, _, reached = swung(case, 20_000 if FULL else 2 * SHORT, n=16)
    assert reached > 1.0


def test_beyond_the_critical_step_a_linear_joint_breaks_loose():
    """The bound is no idle one: the sum of A/c1 in it is the stiffness to the mean of cos^2, so
    1.2 times its step is too long. Opening ends the growth: a factor, not an overflow."""
    mass = Mass("linear, no friction")
    critical = mass.law.critical_time_step(MASS, AREA, mass.rest)
    calm, _ = Mass("linear, no friction").run(300, 0.95 * critical)
    wild, _ = mass.run(300, 1.2 * critical)
    assert np.abs(wild[-1]).max() > 1e3 * np.abs(calm).max()
