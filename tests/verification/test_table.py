"""Joint tables against their law: exact in first loading, stated errors elsewhere."""

import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

import jointlaw as jl

SPECIMEN = Path(__file__).parents[1] / "unit" / "specimens" / "table.txt"


@pytest.fixture(scope="module")
def law():
    return jl.presets.load("jing-replica")  # anisotropic: b = -1, c = -0.3


@pytest.fixture(scope="module")
def table(law):
    """Table of the same law with a bond, which a table leaves out."""
    bonded = replace(law, bond=jl.Bond(1e10, 1e10, 1e6, 1e6))
    return jl.tabulate(bonded, shear_limit=2 * law.closure_range)


def test_normal_stress_is_within_the_stated_tolerance(law, table):
    """Between rows the error is 1e-3 of the stress, or of 1e-4 of the largest stress.

    The tangent is the slope: central differences of the law's curve have errors below 1e-6.
    """
    u = np.random.default_rng(0).uniform(0, 1, 3000) ** 3 * law.closure_range
    row = table.lookup(u)
    exact = law.normal_stress(u)
    tolerance = 1.05e-3 * np.maximum(exact, 1e-4 * exact.max())
    assert (np.abs(row.normal_stress - exact) < tolerance).all()
    assert np.allclose(row.normal_stress, row.kn_secant * u, rtol=1e-15)
    u = table.closure[5:-1]
    slope = (law.normal_stress(1.0001 * u) - law.normal_stress(0.9999 * u)) / (2e-4 * u)
    assert np.allclose(table.kn_tangent[5:-1], slope, rtol=1e-6)


def test_shear_stiffness_is_the_slope_at_small_shear(law, table):
    """At azimuths between the columns, by a probe of 1e-4 of the closure, few sliders slip."""
    u = 0.3 * law.closure_range
    for azimuth in (0.1, 1.0, 2.5):
        joint = law.joint()
        joint.update([u, 0, 0])
        probe = 1e-4 * u * np.array([0, math.cos(azimuth), math.sin(azimuth)])
        forward, _ = joint.trial(probe)
        backward, _ = joint.trial(-probe)
        stiffness = (forward - backward) @ probe / (2 * probe @ probe)
        assert table.lookup(u, azimuth).shear_stiffness == pytest.approx(stiffness, rel=2e-3)
    assert table.metadata["azimuth_fit_error"] < 1e-6  # stiffness over azimuth is a matrix


def test_friction_agrees_with_a_shear_test(law, table):
    """`direct_shear` with twice the steps has the same peak within 0.5 % at three azimuths."""
    for azimuth in (0.0, math.pi / 3, math.pi / 2):
        u = 0.5 * law.closure_range
        record = jl.direct_shear(
            law.joint(), 2 * law.closure_range, normal=float(law.normal_stress(u)),
            azimuth=azimuth, steps=120,
        )  # fmt: skip
        row = table.lookup(u, azimuth)
        peak = np.tan(np.radians(record.peak_friction_angle))
        assert row.peak_friction == pytest.approx(peak, rel=5e-3)
        assert row.mobilised_friction <= row.peak_friction
        rate = -np.diff(record.closure)[-1] / np.diff(record.shear)[-1]
        assert row.dilation == pytest.approx(rate, rel=0.05)  # over the last, longer step


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"closure": -1.0}, "closure = -1"),
        ({"tolerance": 0.0}, "tolerance = 0"),
        ({"azimuths": 7}, "azimuths = 7"),
        ({"steps": 1}, "steps = 1"),
        ({"shear_limit": math.nan}, "shear_limit"),
    ],
)
def test_invalid_options_are_named(law, options, words):
    with pytest.raises(ValueError, match=words):
        jl.tabulate(law, **options)


def test_the_file_keeps_every_digit_and_is_read_by_genfromtxt(table, tmp_path):
    """Column names are in the first line; secant and tangent have names of their own."""
    table.save(tmp_path / "joint.txt")
    assert [path.name for path in tmp_path.iterdir()] == ["joint.txt"]
    loaded = jl.load_table(tmp_path / "joint.txt")
    for field in fields(table):
        np.testing.assert_equal(getattr(loaded, field.name), getattr(table, field.name))
    data = np.genfromtxt(tmp_path / "joint.txt", names=True)
    assert data.dtype.names[:7] == ("un", "sn", "kn_secant", "kn_tangent", "mu", "kt_000", "kt_015")
    assert np.array_equal(data["kt_090"], table.shear_stiffness[:, 6])


def test_a_table_of_version_1_is_read():
    """A table of `linear-a3`, compared with the law in its metadata."""
    table = jl.load_table(SPECIMEN)
    law = jl.JointLaw.from_text(table.metadata["law"])
    u = np.linspace(0, law.closure_range, 9)[1:]
    assert np.allclose(table.lookup(u).normal_stress, law.normal_stress(u), rtol=1e-3)


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("missing", None, "", "not a joint table: .* No such file"),
        ("joint.txt", "# metadata: ", "# ", "it has no line '# metadata:'"),
        ("joint.txt", '"version": 1', '"version": 9', "version 9 .* is not 1: tabulate the law"),
        ("joint.txt", " mu_060 ", " mu ", "mu_060"),
        ("joint.txt", "_060 ", "_050 ", "azimuths be three or more, evenly spaced"),
    ],
)
def test_an_invalid_table_file_is_refused_by_name(tmp_path, name, old, new, words):
    path = tmp_path / name
    text = SPECIMEN.read_text()
    if old is not None:
        assert old in text
        path.write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=words):
        jl.load_table(path)


def test_a_table_of_a_law_that_degrades_by_stress_has_the_stated_errors(law):
    """Of the normal stress 1e-3, of the initial shear stiffness and the peak 0.5 %."""
    end = law.closure_range
    stress = 0.3 * float(law.normal_stress(end))
    changes = {"mating_length": 20 * end, "degradation_stress": stress, "closure_range": end}
    degrading = replace(law, **changes)
    table = jl.tabulate(degrading, shear_limit=2 * end)
    assert table.metadata["degradation"].startswith("first loading only")
    u = np.random.default_rng(0).uniform(0, 1, 3000) ** 3 * end
    exact = degrading.normal_stress(u)
    tolerance = 1.05e-3 * np.maximum(exact, 1e-4 * exact.max())
    assert (np.abs(table.lookup(u).normal_stress - exact) < tolerance).all()
    u = 0.5 * end
    joint = degrading.joint(float(degrading.normal_stress(u)))
    assert joint.slope_retention < 0.7
    probe = np.array([0.0, 1e-4 * u, 0.0])
    stiffness = (joint.trial(probe)[0] - joint.trial(-probe)[0])[1] / (2 * probe[1])
    row = table.lookup(u)
    assert row.shear_stiffness == pytest.approx(stiffness, rel=2e-3)
    record = jl.direct_shear(joint, 2 * end, normal=float(joint.F[0]), steps=120)
    peak = np.tan(np.radians(record.peak_friction_angle))
    assert row.peak_friction == pytest.approx(peak, rel=5e-3)


def test_report_states_the_errors_of_a_table(law, table):
    """Pure closure is exact; unloading, coupling and reversal show as errors.

    The metadata name the bond that is left out. The law of this report has none.
    """
    assert table.metadata["bond"] == "left out: this is the joint without its bond"
    report = table.report(law)
    assert report["closure"].largest < 1.1e-3
    assert report["closure, unloading"].normal > 0.05  # hysteresis
    assert report["shear at 0 deg, constant closure"].normal > 0.05  # shear changes normal stress
    assert report["shear at 45 deg, constant closure"].across > 0.05  # off-diagonal terms
    assert report["shear and reversal"].along > 0.2  # path dependence
    assert [line[:34].strip() for line in str(report).splitlines()] == ["path", *report]


def test_follow_agrees_with_an_elastic_frictional_law_written_with_matrices(table):
    """Closure, shear, reversal, opening, renewed contact; values of each point from `lookup`.

    The difference is the rounding of some 400 steps, 1e-12 of the peak.
    """
    end = table.closure[-1]
    corners = end * np.array([
        [0.5, 0, 0], [0.5, 0.3, 0.2], [0.5, -0.3, 0.1], [0.1, -0.2, 0.1], [-0.1, 0, 0.3],
        [0.6, 0.1, 0.3], [1.3, 0.4, 0.3],
    ])  # fmt: skip
    path = np.array([np.interp(np.arange(361), 60 * np.arange(7), c) for c in corners.T]).T
    f = np.zeros(2)
    previous_point = np.zeros(3)
    previous_K = np.zeros((2, 2))
    exact = np.zeros_like(path)
    for k, point in enumerate(path):
        at_0, at_45, at_90 = table.lookup(point[0], np.radians([0, 45, 90])).shear_stiffness
        K23 = at_45 - (at_0 + at_90) / 2
        K = np.array([[at_0, K23], [K23, at_90]])
        if np.trace(K) < np.trace(previous_K):
            f = K @ np.linalg.solve(previous_K, f)
        f = f + K @ (point - previous_point)[1:]
        row = table.lookup(point[0], np.arctan2(f[1], f[0]))
        limit = row.peak_friction * row.normal_stress
        if np.hypot(*f) > limit:
            f = f / np.hypot(*f) * limit
        exact[k] = (row.normal_stress, *f)
        previous_point = point
        previous_K = K
    assert np.abs(exact[:, 1:]).max() > 0.1 * exact.max()
    assert np.abs(table.follow(path) - exact).max() < 1e-12 * exact.max()


def test_the_shear_traction_turns_with_the_contact(table):
    """The traction before a step turns by the whole spin, the new traction by half of it."""
    closure = table.closure[-1:] / 2
    spin = np.array([0.3])
    K22, K33, K23 = K = table.shear_matrix(*table.locate(closure)[:2])
    size = 0.01 * table.lookup(closure).normal_stress  # far below the friction limit
    f = size * np.array([[0.6], [0.8]])
    d = size / K22 * np.array([[0.0], [0.5], [-0.2]])
    F, _ = table.step(f, K, d, closure, spin)
    increment = K22 * d[1] + K23 * d[2] + 1j * (K23 * d[1] + K33 * d[2])
    exact = np.exp(1j * spin) * (f[0] + 1j * f[1]) + np.exp(0.5j * spin) * increment
    np.testing.assert_allclose(F[1] + 1j * F[2], exact, rtol=1e-12)
