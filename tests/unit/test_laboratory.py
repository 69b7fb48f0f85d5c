"""Simulated laboratory tests: normal condition, reversal points, unloading, early stops; and their
records: columns, files, figures, and summaries against values computed by hand."""

import math

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.laboratory.record import UNITS

NORMAL_STRESS = 10e6  # Pa


@pytest.mark.parametrize(("stress", "spring"), [(1.0, 0.0), (10e6, 0.0), (1e9, 0.0), (10e6, 2e13)])
def test_normal_condition_is_met(any_sheared_law, stress, spring):
    """At constant normal stress (CNL), and at constant normal stiffness (CNS)."""
    law = any_sheared_law
    record = jl.direct_shear(law.joint(), [5e-7, -2e-7], stress, stiffness=spring, steps=30)
    prescribed = stress + spring * (record.closure[0] - record.closure)
    # 1e-9, or the stress of one rounding error of a closure of about 5e-7 m in the stiffest joint
    rounding = 2e-16 * 1e-6 * law.max_stiffness(1e-6)
    np.testing.assert_allclose(record.F1, prescribed, rtol=1e-9, atol=rounding)
    dilates = law.tables.asperities is not None
    assert (np.ptp(record.F1) > 0.001 * stress) == (spring > 0 and dilates)


@pytest.mark.parametrize("azimuth", [math.radians(30), -2.5])
def test_shear_reaches_the_reversal_points(law, azimuth):
    to = [6e-7, -4e-7, 0.0, 2e-7]
    joint = law.joint()
    record = jl.direct_shear(joint, to, NORMAL_STRESS, azimuth=azimuth, steps=25)
    assert len(record) == 1 + 25 * len(to)
    # 1e-12 of the longest leg: 25 equal increments are summed
    np.testing.assert_allclose(record.shear[25::25], to, atol=1e-18)
    across = record.shear_3 * math.cos(azimuth) - record.shear_2 * math.sin(azimuth)
    np.testing.assert_allclose(across, 0.0, atol=1e-18)
    np.testing.assert_allclose(joint.delta[1:], [record.shear_2[-1], record.shear_3[-1]])
    assert (np.diff(record.dissipated) >= 0).all()


def test_a_law_with_a_plane_is_recorded_in_three_dimensions(make_law):
    record = jl.direct_shear(make_law(plane=0.4).joint(), 5e-7, NORMAL_STRESS, steps=10)
    assert record.azimuth == 0.4
    assert record.shear_3[-1] == pytest.approx(5e-7 * math.sin(0.4))


def test_closure_test_loads_and_unloads(any_law):
    joint = any_law.joint()
    record = jl.closure_test(joint, 20e6, steps=30)
    assert record.F1[[0, 30, -1]] == pytest.approx([0.0, 20e6, 0.0], abs=20e6 * 1e-9)
    assert (np.diff(record.F1[:31]) > 0).all()
    assert (np.diff(record.F1[30:]) < 0).all()
    assert (np.diff(record.dissipated) >= 0).all()
    # summed in another order, both round in the last digits of the largest stress
    np.testing.assert_allclose(joint.F[0], record.F1[-1], atol=20e6 * 1e-14)


def test_path_error_holds_the_record_so_far(law):
    """The third reversal point is so far away that the tractions overflow."""
    joint = law.joint()
    with pytest.raises(jl.PathError, match="stopped after 21 rows") as error:
        jl.direct_shear(joint, [1e-7, -1e-7, 1e301], NORMAL_STRESS, steps=10)
    record = error.value.record
    assert len(record) == 21
    assert record.shear[-1] == pytest.approx(-1e-7)
    # rounding: the record holds the traction of the update, joint.F is summed from the state
    last_traction = [record.F1[-1], record.F2[-1], record.F3[-1]]
    np.testing.assert_allclose(joint.F, last_traction, rtol=0, atol=1e-14 * NORMAL_STRESS)


def record_of_known_figures(azimuth=0.0, sense=1.0):
    """Shear to 4 um at 10 MPa: friction angle 45 degrees at 2 um, 30 at the end; dilation 1:2."""
    shear = np.array([0.0, 1e-6, 2e-6, 3e-6, 4e-6])
    stress = 10e6 * np.array([0.0, 0.5, 1.0, 0.8, math.tan(math.radians(30))])
    closure = np.array([1.0, 1.1, 1.0, 0.5, 0.25]) * 1e-6
    columns = dict.fromkeys(UNITS, np.zeros(5)) | {
        "closure": closure,
        "shear_2": sense * shear * math.cos(azimuth),
        "shear_3": sense * shear * math.sin(azimuth),
        "F1": np.full(5, 10e6),
        "F2": sense * stress * math.cos(azimuth),
        "F3": sense * stress * math.sin(azimuth),
        "stored": np.linspace(1.0, 2.0, 5),
        "dissipated": np.linspace(0.0, 3.0, 5),
    }
    return jl.TestRecord(columns, azimuth)


@pytest.mark.parametrize(("azimuth", "sense"), [(0.7, 1.0), (math.pi, -1.0)])
def test_summary_figures(azimuth, sense):
    record = record_of_known_figures(azimuth, sense)
    assert record.peak_friction_angle == pytest.approx(45.0, rel=1e-12)
    assert record.residual_friction_angle == pytest.approx(30.0, rel=1e-12)
    # the largest is between 2 and 3 um: 0.5 um of opening over 1 um of shear
    assert record.peak_dilation_angle == pytest.approx(math.degrees(math.atan(0.5)), rel=1e-9)
    assert record.dilation_angle.shape == record.friction_angle.shape == (5,)
    assert "shear displacement to 4e-06 m, peak friction angle 45.0 deg, largest dilation" in repr(
        record
    )
    assert record.secant_stiffness == pytest.approx(10e6 / 2e-6, rel=1e-12)
    np.testing.assert_allclose(record.shear, sense * np.arange(5) * 1e-6, atol=1e-20)
    assert record.summary() == {
        "rows": 5,
        "largest_closure_m": 1.1e-6,
        "largest_normal_stress_Pa": 10e6,
        "stored_J_per_m2": 2.0,
        "dissipated_J_per_m2": 3.0,
        "peak_friction_angle_deg": record.peak_friction_angle,
        "has_peak": True,
        "residual_friction_angle_deg": record.residual_friction_angle,
        "peak_dilation_angle_deg": record.peak_dilation_angle,
        "secant_shear_stiffness_Pa_per_m": record.secant_stiffness,
    }


@pytest.mark.parametrize(
    ("shear", "stress", "peak"),
    [
        ([0, 1, 2, 3], [0, 2, 3, 3], False),  # increases or stays constant to the end
        ([0, 1, 2, 3], [0, 3, 2, 2], True),
        ([0, 1, 2, 1, 0], [0, 2, 3, 1, 0], False),  # decreases only after the shear reversal
        ([0, 1, 2, 1, 0], [0, 3, 2.5, 1, 0], True),
        ([0, -1, -2, -1], [0, -3, -2.9, -1], True),
        ([0, 1, 2, 3], [0, 3, 2.999, 2.999], False),  # less than 0.1 % is rounding
    ],
)
def test_has_peak(shear, stress, peak):
    columns = {name: np.zeros(len(shear)) for name in UNITS}
    test = {"shear_2": shear, "F1": np.full(len(shear), 10), "F2": stress}
    columns |= {name: np.array(column, float) for name, column in test.items()}
    assert jl.TestRecord(columns).has_peak is peak


def test_csv_round_trip(tmp_path):
    record = record_of_known_figures(0.3)
    record.to_csv(tmp_path / "r.csv")
    table = np.genfromtxt(tmp_path / "r.csv", delimiter=",", names=True)
    derived = ("shear_stress_Pa", "opening_m", "friction_angle_deg", "dilation_angle_deg")
    assert table.dtype.names[-6:] == ("stored_Jm2", "dissipated_Jm2", *derived)
    for title, name in zip(table.dtype.names, UNITS, strict=False):  # twelve digits are written
        assert title.startswith(name)
        np.testing.assert_allclose(table[title], record.columns[name], rtol=1e-11)
    np.testing.assert_allclose(table["friction_angle_deg"], record.friction_angle, rtol=1e-11)
    np.testing.assert_allclose(table["opening_m"], record.closure[0] - record.closure, rtol=1e-11)
    assert set(UNITS.values()) == {"m", "Pa", "J/m2", "1"}
    with pytest.raises(ValueError, match="'1furlong' is not a quantity in m"):
        record.to_csv(tmp_path / "r.csv", length="furlong")


@pytest.mark.parametrize(("backend", "open_figures", "size"), [("agg", 1, 0.0), ("inline", 0, 1.0)])
def test_figure_has_labels_and_a_notebook_shows_it_once(backend, open_figures, size, monkeypatch):
    """A notebook cell shows the figure that it returns, and every figure that is not closed."""
    pyplot = pytest.importorskip("matplotlib.pyplot")
    monkeypatch.setattr(pyplot, "get_backend", lambda: f"module://matplotlib_{backend}")
    pyplot.close("all")
    columns = record_of_known_figures().columns
    axes = jl.TestRecord(columns | {"shear_2": size * columns["shear_2"]}).plot().axes
    assert len(pyplot.get_fignums()) == open_figures
    assert len(axes) == (4 if size else 2)
    assert all(axis.get_ylabel() for axis in axes)
    assert all(axis.get_legend() for axis in axes if len(axis.lines) > 1)
    pyplot.close("all")
