"""Sections 4.1 and 4.2, closure and initial shear stiffness: Fig. 11 to 13."""

from dataclasses import replace
from functools import cache
from math import log

import numpy as np
import pytest
from paper_laws import preset
from scipy.optimize import brentq

from jointlaw.laws.joint_law import JointLaw
from jointlaw.paper.secant import secant

GRANITE = SMOOTH, ROUGH = preset("westerly-smooth"), preset("westerly-rough")


def test_closure():
    """Fig. 11: the smooth interface is stiffer in closure
    In part: beyond a crossing at 0.159 µm (total form 0.156 µm, formation "individual" 0.383 µm);
    softer before it, as fewer of its asperities touch at zero closure. At 50 MPa it has closed
    0.426 µm, the rough one 0.508 µm

    Fig. 11: the smooth interface hardens more with closure
    Holds: dF₁/dδ₁ grows by a factor 3.80 (smooth) and 2.37 (rough) from 0.1 to 0.4 µm

    Section 4.1: narrow heights and concentrated orientations both stiffen
    Holds: at 0.4 µm the heights of the smooth interface alone × 1.228, its orientations × 1.059
    """

    def crossing(pair, stress):
        return brentq(lambda u: stress(pair[0], u) / stress(pair[1], u) - 1, 2e-8, 2e-6, xtol=1e-12)

    alone = [replace(law, heights=replace(law.heights, formation="individual")) for law in GRANITE]
    total = crossing(GRANITE, lambda law, u: secant(law, [u, 0.0, 0.0]).F[0])
    found = total, *(crossing(pair, JointLaw.normal_stress) for pair in (GRANITE, alone))
    # virgin curves are exact but for the 12 inclinations
    assert found == pytest.approx([0.156e-6, 0.159e-6, 0.383e-6], rel=5e-3)
    closed = [law.closure(50e6) for law in GRANITE]
    assert closed == pytest.approx([0.426e-6, 0.508e-6], rel=2e-3)
    at = np.array([0.1e-6, 0.4e-6])
    slopes = [law.normal_stress(at * 1.0001) - law.normal_stress(at * 0.9999) for law in GRANITE]
    growth = [high / low / 4 for low, high in slopes]  # steps in proportion to closure
    assert growth == pytest.approx([3.80, 2.37], rel=2e-3)
    other = [replace(ROUGH, heights=SMOOTH.heights), replace(ROUGH, orientation=SMOOTH.orientation)]
    gain = [law.normal_stress(0.4e-6) / ROUGH.normal_stress(0.4e-6) for law in other]
    assert gain == pytest.approx([1.228, 1.059], abs=2e-3)


@cache
def initial_stiffness(law, stress, axis=1):
    """dF/d(shear) along an axis at zero shear: total form, incremental law."""
    delta = np.array([law.closure(stress), 0.0, 0.0])
    joint = law.joint(normal_stress=stress)
    slip = np.zeros(3)
    slip[axis] = 1e-6 * delta[0]
    tangent = joint.trial(slip)[1][axis, axis]
    return np.array([secant(law, delta + slip).F[axis] / slip[axis], tangent])


def test_initial_shear_stiffness():
    """Fig. 12a: the smooth interface has the higher initial shear stiffness
    In part: smooth over rough at 0.1, 1, 10, 50 MPa is 1.37, 1.42, 1.59, 1.85 in the total form,
    0.96, 1.03, 1.26, 1.59 in the incremental law, where it is softer below about 0.5 MPa

    Fig. 12a: shear stiffness grows ever more slowly with normal stress
    Holds: its slope (1/µm) between 1, 5, 10, 20, 50 MPa is 4.7, 2.8, 2.0, 1.4 in the total form,
    7.2, 4.7, 3.7, 2.8 in the incremental law
    """
    stresses = (0.1e6, 1e6, 10e6, 50e6)
    smooth, rough = (np.array([initial_stiffness(x, s) for s in stresses]) for x in GRANITE)
    total, ours = np.transpose(smooth / rough)
    assert total == pytest.approx([1.37, 1.42, 1.59, 1.85], abs=0.01)
    assert ours == pytest.approx([0.96, 1.03, 1.26, 1.59], abs=0.01)
    stress = np.array([1e6, 5e6, 10e6, 20e6, 50e6])
    values = np.array([initial_stiffness(SMOOTH, s) for s in stress])
    total, ours = 1e-6 * np.diff(values, axis=0).T / np.diff(stress)
    assert total == pytest.approx([4.7, 2.8, 2.0, 1.4], abs=0.1)
    assert ours == pytest.approx([7.2, 4.7, 3.7, 2.8], abs=0.1)


def test_contacts_form_early():
    """Section 4.2: most new contacts form at low normal stress
    Holds: of those new up to 50 MPa, by 12.5 and 25 MPa have formed 44 % and 67 % (smooth), 41 %
    and 64 % (rough)
    """
    for law, shares in ((SMOOTH, (0.44, 0.67)), (ROUGH, (0.41, 0.64))):
        start = law.asperity_density * law.heights.cdf(law.heights.overlap)
        formed = law.contacts(law.closure([12.5e6, 25e6, 50e6])) - start
        assert formed[:2] / formed[2] == pytest.approx(shares, abs=0.01)


def test_forming_of_contacts_does_not_bend_the_stiffness():
    """Section 4.2: the nonlinearity comes from the forming of contacts
    Fails: stiffness goes with stress to the power 0.52 at 10 MPa; without any forming of contacts
    to the power 0.33 (Hertz: 1/3), slower still, so forming straightens it
    """
    laws = (SMOOTH, replace(SMOOTH, heights=None))
    ends = [[initial_stiffness(law, s)[1] for s in (9e6, 11e6)] for law in laws]
    powers = [log(high / low) / log(11 / 9) for low, high in ends]
    # the depth nodes, which are fixed lengths, move the exponent by a few thousandths
    assert powers == pytest.approx([0.52, 1 / 3], abs=0.01)


def test_initial_shear_stiffness_depends_on_direction():
    """Fig. 13: initial shear stiffness of the replica depends on direction
    Holds: axis 2 over axis 3 is 1.833 in the total form, 1.253 in the incremental law, the same at
    every stress. Axis 2 is stiffer though c < 0, because λ = 0.33 makes K_s > K_n
    """
    for stress in (0.5e6, 2e6, 10e6):
        along, across = (initial_stiffness(preset("jing-replica"), stress, axis) for axis in (1, 2))
        assert along / across == pytest.approx([1.833, 1.253], rel=0.01)  # by the depth cells
