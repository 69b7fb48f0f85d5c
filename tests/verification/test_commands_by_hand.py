"""Every key and column that `jointlaw closure`, `shear` and `fit` write, computed here.

Closure of a law with linear asperities has a closed form. A shear test is driven here, too, and its
energies are the work of its stresses. The fit is of points made by a known law.
"""

import csv
import hashlib
import json

import numpy as np
import pytest
from by_hand import columns, compare

import jointlaw as jl
from jointlaw.cli.command import SUMMARY_VERSION
from jointlaw.cli.main import main
from jointlaw.support.version import __version__

STRESS = 10e6  # Pa
SIZES = {"m": 1.0, "mm": 1e-3, "Pa": 1.0, "MPa": 1e6, "1": 1.0, "J/m2": 1.0}


@pytest.fixture
def run(tmp_path, monkeypatch):
    """run(words): the folder of the results of a command, and its summary."""
    monkeypatch.chdir(tmp_path)

    def measure(words):
        assert main([*words.split(), "--out", "out"]) == 0
        text = (tmp_path / "out" / "summary.json").read_text()
        return tmp_path / "out", json.loads(text, parse_constant=pytest.fail)

    return measure


def read(path):
    return {name: np.array(texts, float) for name, texts in columns(path).items()}


UNITS = {
    **dict.fromkeys(("closure", "shear_2", "shear_3"), "m"),
    **dict.fromkeys(("F1", "F2", "F3"), "Pa"),
    **dict.fromkeys(("sliding", "separated"), "1"),
    **dict.fromkeys(("stored", "dissipated"), "J/m2"),
}


def settings(command, **more):
    return {
        "command": command, "law": "linear-a3", "default_rock": False, "resolution": None,
        "format": "png", "steps": 4, "units": "mm,MPa",
    } | more  # fmt: skip


def test_closure(run):
    """The closure of linear asperities is the stress over a constant stiffness."""
    words = "closure linear-a3 --normal-stress 10MPa --steps 4 --units mm,MPa"
    folder, summary = run(words)
    stiffness = STRESS / jl.presets.load("linear-a3").closure(STRESS)
    share = np.array([0, 1, 2, 3, 4, 3, 2, 1, 0]) / 4
    closure = share * STRESS / stiffness
    energy = 0.5 * stiffness * closure**2
    zero = (np.zeros(9), 1e-9)
    expected = {
        "closure_mm": (1e3 * closure, 1e-15),
        "F1_MPa": (1e-6 * stiffness * closure, 1e-9),
        "stored_J/m2": (energy, 1e-9),
        "dissipated_J/m2": zero,
        **dict.fromkeys(("shear_2_mm", "shear_3_mm", "F2_MPa", "F3_MPa", "sliding"), zero),
    }
    actual = read(folder / "closure.csv")
    separated = actual.pop("separated")
    assert separated[0] == 1.0  # before contact
    assert not separated[1:8].any()
    compare(actual, expected, "closure.csv")
    assert summary == {
        "version": SUMMARY_VERSION,
        "settings_SI": settings("closure", normal_stress=[STRESS]),
        "result": {
            "rows": 9,
            "largest_closure_m": pytest.approx(closure.max()),
            "largest_normal_stress_Pa": pytest.approx(STRESS),
            "stored_J_per_m2": pytest.approx(0.0, abs=1e-9),
            "dissipated_J_per_m2": pytest.approx(0.0, abs=1e-9),
        },
        "units": UNITS,
        "warnings": [],
        "files": ["closure.csv", "law.toml", "closure.png"],
    }


def test_shear(run):
    """At constant normal stress: work of the shear stress is stored or dissipated, less the work
    against the normal stress; along one axis nothing moves or pulls across it."""
    words = "shear linear-a3 --normal-stress 10MPa --to 2um --steps 40 --units mm,MPa"
    folder, summary = run(words)
    actual = read(folder / "shear.csv")
    slip = np.linspace(0.0, 2e-6, 41)
    law = jl.presets.load("linear-a3")
    record = jl.direct_shear(law.joint(), 2e-6, normal=STRESS, steps=40)
    stress = actual["F2_MPa"]
    opening = actual["opening_mm"]
    start = law.closure(STRESS)
    expected = {
        "closure_mm": (1e3 * start - opening, 1e-12),
        "shear_2_mm": (1e3 * slip, 1e-12),
        "shear_3_mm": (0 * slip, 1e-15),
        "F1_MPa": (10.0 + 0 * slip, 1e-6),
        "F2_MPa": (1e-6 * record.F2, 1e-6),
        "F3_MPa": (0 * slip, 1e-9),
        "sliding": (record.sliding, 1e-9),
        "separated": (record.separated, 1e-9),
        "stored_J/m2": (record.stored, 1e-6),
        "dissipated_J/m2": (record.dissipated, 1e-6),
        "shear_stress_MPa": (stress, 1e-9),
        "opening_mm": (1e3 * (start - record.closure), 1e-12),
        "friction_angle_deg": (np.degrees(np.arctan2(stress, 10.0)), 1e-5),
        "dilation_angle_deg": (
            np.degrees(np.arctan2(np.diff(opening, prepend=0.0), np.r_[1.0, np.diff(1e3 * slip)])),
            1e-4,
        ),
    }
    compare(actual, expected, "shear.csv")
    energy = actual["stored_J/m2"] + actual["dissipated_J/m2"]
    middle = 0.5 * (stress[1:] + stress[:-1])
    work = 1e6 * np.cumsum(middle * np.diff(slip)) - STRESS * 1e-3 * opening[1:]
    np.testing.assert_allclose(energy[1:] - energy[0], work, atol=0.03 * energy.max())
    assert (np.diff(actual["dissipated_J/m2"]) >= 0).all()
    assert (actual["sliding"] + actual["separated"] <= 1 + 1e-9).all()
    friction = actual["friction_angle_deg"]
    peak = friction.argmax()
    assert summary == {
        "version": SUMMARY_VERSION,
        "settings_SI": settings(
            "shear", normal_stress=STRESS, to=2e-6, reverse=[], azimuth=0.0, normal_stiffness=0.0,
            steps=40,
        ),
        "result": {
            "rows": 41,
            "largest_closure_m": pytest.approx(1e-3 * actual["closure_mm"].max()),
            "largest_normal_stress_Pa": pytest.approx(STRESS, rel=1e-6),
            "stored_J_per_m2": pytest.approx(actual["stored_J/m2"][-1]),
            "dissipated_J_per_m2": pytest.approx(actual["dissipated_J/m2"][-1]),
            "peak_friction_angle_deg": pytest.approx(friction[peak]),
            "has_peak": bool(friction[-1] < 0.999 * friction[peak]),
            "residual_friction_angle_deg": pytest.approx(friction[-1]),
            "peak_dilation_angle_deg": pytest.approx(actual["dilation_angle_deg"].max()),
            "secant_shear_stiffness_Pa_per_m": pytest.approx(1e6 * stress[peak] / slip[peak]),
        },
        "units": UNITS,
        "warnings": [],
        "files": ["shear.csv", "law.toml", "shear.png"],
    }  # fmt: skip


def test_fit(run, tmp_path):
    """Points of a law with twice the density of asperities of the one that is fitted, and a last
    one that is predicted."""
    law = jl.presets.load("westerly-smooth")
    closure = np.linspace(0.1, 1.0, 12) * law.closure(8e6)
    stress = 2.0 * np.array([law.normal_stress(one) for one in closure])
    rows = "".join(
        f"{1e-6 * s:.10g},{1e3 * u:.10g}\n" for s, u in zip(stress, closure, strict=True)
    )
    (tmp_path / "table.csv").write_text("stress_MPa,closure_mm\n" + rows)
    limit = 1e-6 * (stress[-2] + stress[-1]) / 2
    words = f"fit table.csv --law westerly-smooth --free asperity_density --up-to {limit:.6g}MPa"
    folder, summary = run(words)
    density = 2.0 * law.asperity_density
    parameters = summary.pop("parameters_SI")
    assert parameters["asperity_density"] == pytest.approx(density, rel=1e-3)
    assert parameters["preload_closure"] == pytest.approx(0.0, abs=1e-3 * closure[-1])
    for table, names in ((law.orientation, "abc"), (law.asperity, ("K", "lam", "eta", "mu"))):
        for name in names:
            assert parameters[name] == getattr(table, name)
    for name in ("alpha", "beta", "overlap"):
        assert parameters[name] == getattr(law.heights, name)
    low, high = summary.pop("interval_95_SI")["asperity_density"]
    assert low < density < high
    noise = summary.pop("noise")
    assert {*noise} == {"levels", "autocorrelation", "spread"}
    assert noise["spread"] == 0.0
    correlation = np.array(summary.pop("correlation"))
    assert np.diag(correlation) == pytest.approx(np.ones(len(correlation)))
    assert np.abs(correlation).max() <= 1 + 1e-9
    provenance = summary.pop("provenance")
    assert provenance.pop("date").startswith("20")
    assert provenance == {
        "command": f"jointlaw {words} --out out",
        "version": f"jointlaw {__version__}",
        "sha256": {"table.csv": hashlib.sha256((tmp_path / "table.csv").read_bytes()).hexdigest()},
        "columns": {"table.csv": "normal stress: stress_MPa; closure: closure_mm"},
    }
    warnings = summary.pop("warnings")
    assert warnings[0] == f"fitted to normal stresses up to {1e-6 * stress[-2]:.4g} MPa"
    assert summary == {
        "version": SUMMARY_VERSION,
        "data": "table.csv",
        "identifiable": ["asperity_density"],
        # the test began at zero stress: the preload has no lower bound
        "not_identifiable": {"preload_closure": "its 95 % interval is unbounded"},
        "shape_differs": {"table.csv, stress": False},
        "spacing_of_asperities_m": pytest.approx(density**-0.5, rel=1e-3),
        "points_in_band": [11, 11],
        "error_at_largest_stress": pytest.approx(0.0, abs=1e-3),
        "files": ["points.csv", "fit.png", "law.toml", "report.md"],
    }
    with (folder / "points.csv").open(newline="") as file:
        points = list(csv.DictReader(file))
    assert len(points) == 12
    for point, u, s in zip(points, closure, stress, strict=True):
        low, value, high = (float(point.pop(name)) for name in ("low", "law", "high"))
        assert low < value < high
        assert value == pytest.approx(1e-6 * s, rel=1e-3)
        residual = 100 * (value / (1e-6 * s) - 1)
        assert float(point.pop("residual_percent")) == pytest.approx(residual, abs=1e-2)
        for name, expected in (
            ("displacement_mm", 1e3 * u), ("normal_stress_MPa", 1e-6 * s), ("measured", 1e-6 * s)
        ):  # fmt: skip
            assert float(point.pop(name)) == pytest.approx(expected, rel=1e-5)
        use = "fitted" if s < stress[-1] else "predicted"
        assert point == {
            "test": "table.csv",
            "use": use,
            "quantity": "normal stress",
            "unit": "MPa",
        }
