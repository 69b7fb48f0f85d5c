"""Numbers with units in reports and messages: each against the value in SI units that was given.

Functions that write reports get results that are known in advance. `quantities` reads the numbers
of a text with their units, and converts them by a table of this file. Angles are between 1 and 89
degrees, where degrees and radians differ.
"""

import csv
import json
import math
import re
from dataclasses import replace
from inspect import signature
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from kinds import FITTED
from scipy.stats import norm

import jointlaw as jl
from dem_demo import SceneError, cli
from dem_demo.cli import main as run_blocks
from dem_demo.contact.joints import tabulate_first_loading
from dem_demo.output.record import bolt_summary, format_blocks
from dem_demo.studies import ablate, compare
from jointlaw.accuracy import slip as slip_tests
from jointlaw.accuracy import suite, tradeoff
from jointlaw.calibration import comparison, datasets, estimates, field, noise
from jointlaw.calibration.aperture import FlowConditions, FlowFit, FlowTest, read_flow
from jointlaw.calibration.fit import Fit
from jointlaw.calibration.meaning import describe
from jointlaw.calibration.measured import ShearCurve
from jointlaw.cli import card, scan
from jointlaw.cli import field as field_command
from jointlaw.cli import fit as fit_command
from jointlaw.cli.main import main
from jointlaw.parameters import rock
from jointlaw.parameters.about import About
from jointlaw.parameters.aperture import Aperture
from jointlaw.surface.faces import CompositeSurface
from jointlaw.tables import tabulate
from jointlaw.tables.joint_table import JointTable

SI = {
    "m": 1.0, "mm": 1e-3, "um": 1e-6, "m2": 1.0, "Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa/m": 1e9,
    "kN": 1e3, "ml/min": 1e-6 / 60, "mPa s": 1e-3, "%": 0.01, "deg": math.radians(1),
    "degrees": math.radians(1), "°": math.radians(1),
}  # fmt: skip
UNIT = "|".join(sorted(map(re.escape, SI), key=len, reverse=True))
NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
LAW = replace(FITTED, resolution="fast")
UNITS_OF_PEAKS = "MPa", "mm", "MPa", "mm", "MPa"


def quantities(text):
    """Numbers of a text with their units, in SI units, in their order."""
    found = re.findall(rf"({NUMBER}) ?({UNIT})(?![\w/])", text)
    return [float(number) * SI[unit] for number, unit in found]


def cells_in_si(lines):
    """Rows of the first table of Markdown lines, numbers in SI units by the heads of columns."""
    rows = [line.strip("| ").split("|") for line in lines if "|" in line]
    units = [re.findall(r"\(([^()]+)\)", head) for head in rows[0]]
    result = []
    for row in rows[2:]:
        numbers = [re.findall(NUMBER, cell) for cell in row]
        result.append(
            [
                [float(one) * SI[unit[min(k, len(unit) - 1)]] for k, one in enumerate(cell)]
                for cell, unit in zip(numbers, units, strict=False)
                if unit
            ]
        )
    return result


# ------------------------------------------------------------------------------- cards and meaning


def test_properties_on_a_card():
    text = card.describe(LAW, About(), "law").partition("## Properties")[2].partition("## ")[0]
    for row, stress in zip(cells_in_si(text.splitlines()), (1e5, 1e6, 1e7), strict=True):
        closure = float(LAW.closure(stress))
        assert row[0] == [pytest.approx(stress)]
        assert row[1] == [pytest.approx(closure, rel=1e-3)]
        assert row[2] == pytest.approx(LAW.secant_stiffness(stress), rel=1e-3)
        assert row[2][0] == pytest.approx(stress / closure, rel=1e-3)
    (valid, _) = card._limits(LAW)
    closure = LAW.closure_range
    expected = [closure, float(LAW.normal_stress(closure))]
    assert quantities(valid) == pytest.approx(expected, rel=1e-3)


def test_stresses_on_a_card_that_plastic_asperities_do_not_reach():
    def refuse(stress):
        raise ValueError("not reached")

    rows = card._properties(SimpleNamespace(closure=refuse))
    assert rows == [f"{stress} | not reached | " for stress in ("0.1", "1", "10")]


def test_meaning_of_a_law():
    lines = describe(LAW, [1e6, 4e6], assumed_stiffness=(40e9, 3e6))
    distance = 1e6**-0.5
    assert quantities(lines[0]) == pytest.approx([distance, distance], rel=1e-2)
    for row, stress in zip(cells_in_si(lines[1:6]), (1e6, 4e6), strict=True):
        closure = float(LAW.closure(stress))
        step = 1e-4 * closure
        rise = LAW.normal_stress(closure + step) - LAW.normal_stress(closure - step)
        assert [cell[0] for cell in row] == pytest.approx(
            [
                stress,
                closure,
                rise / (2 * step),
                LAW.secant_stiffness(stress)[1],
                LAW.contact_fraction(closure),
            ],
            rel=1e-2,
        )
    (assumed,) = (line for line in lines if "assumed normal stiffness" in line)
    assert quantities(assumed)[:2] == pytest.approx([40e9, 3e6])


# -------------------------------------------------------------------------- values from the field


def test_given_field_values_in_degrees_and_radians():
    assert signature(jl.from_field).parameters["basic_friction"].default == pytest.approx(np.pi / 6)
    values = {"jcs": 100e6, "length": 0.1, "normal_stress": 1e6, "normal_stiffness": 30e9}
    with pytest.raises(ValueError, match="roughness angle") as refused:
        jl.from_field(jrc=30.0, basic_friction=np.radians(35), **values)
    numbers = re.search(
        rf"roughness angle of ({NUMBER}) degrees above ({NUMBER}): it must be 1 to ({NUMBER})",
        str(refused.value),
    ).groups()
    assert [*map(float, numbers)] == pytest.approx([60.0, 35.0, 80.0 - 35.0])  # 30 log10(100)


def test_peak_that_no_law_has(monkeypatch):
    def fail(*_):
        raise ValueError("not reached")

    monkeypatch.setattr(field, "shear_past_peak", fail)
    values = {"jcs": 100e6, "length": 0.1, "normal_stress": 1e6, "normal_stiffness": 30e9}
    with pytest.raises(ValueError, match="no law has this") as refused:
        jl.from_field(jrc=10.0, basic_friction=np.radians(30), **values)
    text = str(refused.value).partition("a peak of")[2]
    displacement = 0.1 / 500 * (10.0 / 0.1) ** 0.33  # Barton & Bandis 1982
    assert quantities(text) == pytest.approx([np.radians(50), displacement], rel=1e-2)


def test_first_law_from_field_values():
    law = field._initial_law(np.radians(30), 20.0, 2e6, 1e-3)
    assert law.orientation.a == pytest.approx(90 / 20)
    assert law.asperity.mu == pytest.approx(np.tan(np.pi / 6))
    work = 1.25 * law.mating_length * 2e6 * np.tan(np.radians(50))
    assert law.slope_wear == pytest.approx(work)


def test_command_of_field_values(in_an_empty_folder, monkeypatch, capsys):
    record = SimpleNamespace(
        peak_friction_angle=47.3, peak_dilation_angle=12.4, plot=lambda path: path.touch(),
        summary=dict,
    )  # fmt: skip
    result = SimpleNamespace(record=record, peak_displacement=0.83e-3, normal_stiffness=29.2e9)
    monkeypatch.setattr(field_command, "from_field", lambda **_: LAW)
    monkeypatch.setattr(field_command, "shear_past_peak", lambda *_: result)
    words = "field --jrc 8 --jcs 100MPa --length 20cm --normal-stress 2MPa --basic-friction 31deg"
    assert main([*words.split(), "--normal-stiffness", "30GPa/m", "--out", "out"]) == 0
    lines = capsys.readouterr().out.splitlines()
    roughness = 8 * math.log10(100 / 2)  # degrees
    barton_displacement = 0.2 / 500 * (8 / 0.2) ** 0.33
    expected = {
        "Joint of": [0.2, 2e6],
        "- peak friction angle": np.radians([47.3, 31.0 + roughness]),
        "- shear displacement": [0.83e-3, barton_displacement],
        "- largest dilation": np.radians([12.4, roughness / 2]),
        "- normal stiffness": [29.2e9],
    }
    for start, values in expected.items():
        (line,) = (line for line in lines if line.startswith(start))
        line = re.sub(rf"({UNIT}) \(({NUMBER})\)", r"\1 (\2 \1)", line)  # the unit stands once
        assert quantities(line) == pytest.approx(values, rel=1e-2), start
    warnings = json.loads(Path("out/summary.json").read_text())["warnings"]
    assert quantities(" ".join(warnings))[0] == pytest.approx(2e6)


# ------------------------------------------------------------------------------- scans and flow


def test_alignment_of_two_faces():
    z = 1e-5 * np.array([[1.0, -1.0], [-1.0, 1.0]])  # 10 um rms
    composite = CompositeSurface(z, "rows", (2e-3, -3e-3), math.radians(1.5), 0.9)
    text = composite.describe()
    expected = [-3e-3, 2e-3, math.radians(1.5), 1e-5]
    assert quantities(text) == pytest.approx(expected)
    assert "-3 mm along the rows and 2 mm along the columns" in text
    assert "correlation of the faces is 0.900" in text


def test_summary_of_the_scans_of_two_faces(monkeypatch):
    faces = CompositeSurface(np.zeros((2, 2)), "rows", (2e-3, -3e-3), math.radians(1.5), 0.9)
    fit = SimpleNamespace(
        parameters={"a": 3.0}, estimates={"a": SimpleNamespace(standard_error=0.2)},
        asperities=SimpleNamespace(size=4e-4), not_identifiable={"b": "no reason"},
        report=lambda: "", plot=None,
    )  # fmt: skip
    known = {
        "read_scan": np.zeros((2, 2)), "join_faces": faces, "from_surface": fit,
        "require_rock": None, "_report_friction": "", "_surface_toml": "", "_origin": {},
        "_warnings": [], "new_about": About(),
    }  # fmt: skip
    for name, result in known.items():
        monkeypatch.setattr(scan, name, lambda *_, result=result: result)
    written = []
    monkeypatch.setattr(scan, "write_results", lambda *arguments: written.append(arguments[2]))
    options = SimpleNamespace(
        file="lower.npy", upper="upper.npy", height_unit="um", spacing=1e-4, decimal=None,
        mirror=None, sampling_length=None,
    )  # fmt: skip
    scan._run(options)
    assert written == [
        {
            "parameters_SI": {"a": 3.0}, "standard_error_SI": {"a": 0.2},
            "sampling_length_m": 4e-4, "not_identifiable": {"b": "no reason"}, "warnings": (),
            "faces": {
                "mirror": "rows", "shift_m": (2e-3, -3e-3), "rotation_rad": math.radians(1.5),
                "correlation": 0.9,
            },
        }
    ]  # fmt: skip


def test_report_of_a_scan(monkeypatch):
    lengths = []

    def resample(z, spacing, length):
        lengths.append(length)
        return SimpleNamespace(orientation=SimpleNamespace(a=3.0), length=length)

    monkeypatch.setattr(scan, "from_surface", resample)
    monkeypatch.setattr(scan, "_friction_angles", lambda fit: "31.0° | 35.0°")
    fit = SimpleNamespace(
        asperities=SimpleNamespace(size=0.4e-3), spacing=1e-4, warnings=[], not_identifiable={}
    )
    text = scan._report_friction(fit, None)
    introduction, *_ = (line for line in text.splitlines() if "Friction angle" in line)
    assert quantities(introduction)[0] == pytest.approx(1e6)
    rows = cells_in_si([line for line in text.splitlines() if "|" in line])
    assert [row[0][0] for row in rows] == pytest.approx(lengths)
    assert lengths[0] == 0.4e-3
    (warning,) = scan._warnings(fit)
    assert quantities(warning) == [pytest.approx(0.4e-3)]


def test_lengths_of_a_scan_at_which_no_asperities_are_fitted(monkeypatch):
    lengths = []

    def refuse(z, spacing, length):
        lengths.append(length)
        raise ValueError("too few summits")

    monkeypatch.setattr(scan, "from_surface", refuse)
    fit = SimpleNamespace(asperities=SimpleNamespace(size=0.4e-3), spacing=1e-4)
    table = [line for line in scan._report_friction(fit, None).splitlines() if "|" in line]
    assert [row[0][0] for row in cells_in_si(table)] == pytest.approx(lengths)
    assert all("too few summits" in line for line in table[2:])


def test_friction_angles_of_a_scan_are_at_the_stress_of_the_report(monkeypatch):
    used = []

    def shear(joint, to, normal, steps):
        used.append((to, normal))
        return SimpleNamespace(peak_friction_angle=40.0 + len(used))

    monkeypatch.setattr(scan, "direct_shear", shear)
    fit = SimpleNamespace(
        asperities=SimpleNamespace(size=0.4e-3),
        law=lambda rock, plane: LAW,
        orientation_is_representative=True,
    )
    assert scan._friction_angles(fit) == "41.0° | 42.0°"
    assert used == [(0.4e-3, pytest.approx(1e6))] * 2


def test_conditions_of_flow():
    radial = FlowConditions.radial((5e-3, 40e-3), rate=1e-8, outlet_pressure=2e4)
    assert quantities(radial.description) == pytest.approx([5e-3, 40e-3])
    linear = FlowConditions.linear(0.12, 0.05, rate=1e-8, outlet_pressure=2e4)
    assert quantities(linear.description) == pytest.approx([0.12, 0.05])


def test_report_and_summary_of_a_flow_test():
    stress = np.array([1e6, 2e6, 4e6, 8e6, 2e6])
    aperture = np.array([40e-6, 30e-6, 20e-6, 10e-6, 15e-6])
    a = Aperture(hydraulic=38e-6, at=7e-6, length=11e-6)
    curves = {"map of the law's closure": 1.25 * aperture, "Bandis": 0.9 * aperture}
    is_fitted = np.array([True, True, True, False, False])
    test = FlowTest(stress, aperture, None, "flow.csv")
    fit = FlowFit(test, np.zeros(5), is_fitted, a, curves)
    text = fit.report()
    sentences = [line for line in text.splitlines() if line and "|" not in line]
    assert quantities(sentences[1]) == pytest.approx([4e6])
    assert quantities(sentences[2]) == pytest.approx([38e-6, 7e-6, 11e-6])
    table = [line for line in text.splitlines() if "|" in line]
    assert "error at 8 MPa (%)" in table[0]
    assert "rms error on unloading (%)" in table[0]
    cells = [re.findall(NUMBER, line) for line in table[2:]]
    assert [[*map(float, row)] for row in cells] == [[25.0, 25.0], [-10.0, 10.0]]
    summary = fit.summary()
    assert summary["aperture_SI"] == {"hydraulic": 38e-6, "at": 7e-6, "length": 11e-6}
    assert {*summary["aperture_errors"]} == {*curves}
    errors = summary["aperture_errors"]["Bandis"]
    assert errors == {
        "at_largest_stress": pytest.approx(-0.1), "unloading_rms": pytest.approx(0.1)
    }  # fmt: skip


# ------------------------------------------------------------------------------------- shear tests


def test_table_of_peaks_and_interval_of_the_opening():
    shear = np.array([0.0, 1e-3, 2e-3, 4e-3])
    curve = ShearCurve(
        shear,
        np.array([0.0, 2.5e6, 2.2e6, 1.9e6]),
        3e6,
        opening=np.array([0.0, 1e-4, 2e-4, 3e-4]),
        name="a",
    )
    law = SimpleNamespace(
        shear=shear, stress=np.array([0.0, 2.0e6, 2.4e6, 1.8e6]), opening=np.linspace(0, 2e-4, 4)
    )
    fit = SimpleNamespace(
        problem=SimpleNamespace(shears=[curve]), predict_shear=lambda *_: [law],
        discretisation_error=0.02, has_trade_off=True,
        opening_interval=((1e-4, np.tan(np.radians(3.0))), (5e-4, np.tan(np.radians(12.0)))),
    )  # fmt: skip
    lines = Fit._peak_table(fit)
    table = [line for line in lines if "|" in line]
    heads = [re.findall(r"\((\w+)\)", head) for head in table[0].strip("|").split("|")]
    cells = [re.findall(NUMBER, cell) for cell in table[2].strip("|").split("|")]
    units = [None, ["MPa", "mm"], ["MPa", "mm"], ["MPa"], ["MPa"], ["mm"], ["mm"]]
    # a head without a unit continues the one before
    assert [head for head in heads if head] == [["MPa", "mm"], ["MPa"], ["mm"]]
    values = [
        [float(one) * SI[unit] for one, unit in zip(cell, names, strict=True)]
        for cell, names in zip(cells[1:], units[1:], strict=True)
    ]
    expected = [[2.5e6, 1e-3], [2.4e6, 2e-3], [1.9e6], [1.8e6], [3e-4], [2e-4]]
    for actual, value in zip(values, expected, strict=True):
        assert actual == pytest.approx(value)
    change, opening = (line for line in lines if "%" in line)
    assert quantities(change) == [pytest.approx(0.02)]
    numbers = re.search(
        rf"opening is ({NUMBER}) to ({NUMBER}) mm, and of the largest dilation angle ({NUMBER}) "
        rf"to ({NUMBER}) degrees",
        opening,
    ).groups()
    assert [*map(float, numbers)] == pytest.approx([0.1, 0.5, 3.0, 12.0])


def test_bands_of_stresses_above_a_hundredth_of_the_largest_are_logarithmic(monkeypatch):
    stress = np.array([1e4, 1e6, -3e6])
    curve = SimpleNamespace(stress=stress, opening=np.zeros(3))
    monkeypatch.setattr(estimates, "simulate_curves", lambda *_: [curve])
    fit = SimpleNamespace(
        predict_shear=lambda *_: [curve], parameters=None, problem=SimpleNamespace(settings=None),
        _derivative=lambda model: None,
    )  # fmt: skip
    small, values, _ = estimates.Estimates._linear_test(fit, curve)
    assert small == pytest.approx(3e4)
    np.testing.assert_allclose(small * np.sinh(values[0]), stress)


def test_columns_of_points_beside_the_law():
    """Each column has a value of its own."""
    one = comparison.Comparison(
        "a", "shear stress", True, displacement=np.array([1e-3]), normal=np.array([2e6]),
        measured=np.array([3e6]), law=np.array([4e6]), band=np.array([[5e6], [6e6]]),
        specimen_band=np.array([[0.0], [9e6]]), residual=np.array([0.07]), scale=np.array([8e6]),
        sigma=np.array([0.01]),
    )  # fmt: skip
    (row,) = csv.DictReader(comparison.to_csv([one]).splitlines())
    texts = {"test": "a", "use": "fitted", "quantity": "shear stress", "unit": "MPa"}
    assert {name: row.pop(name) for name in texts} == texts
    assert {name: float(text) for name, text in row.items()} == pytest.approx(
        {
            "displacement_mm": 1.0, "normal_stress_MPa": 2.0, "measured": 3.0, "law": 4.0,
            "low": 5.0, "high": 6.0, "residual_percent": 7.0,
        }
    )  # fmt: skip


def test_notes_and_messages_of_shear_files():
    gauges = [SimpleNamespace(title="left"), SimpleNamespace(title="right")]
    mean, note = datasets._mean_of_gauges(gauges, [np.array([0, 2e-3]), np.array([0, 3e-3])])
    np.testing.assert_allclose(mean, [0.0, 2.5e-3])
    assert quantities(note) == [pytest.approx(1e-3)]
    readings = {
        "shear": np.array([0.0, 1e-3, 2e-3, 3e-3, 0.2e-3, 1e-3]),
        "stress": np.array([0.0, 1e6, 2e6, 2e6, 0.0, 1e6]),
    }
    table = SimpleNamespace(name="shear.csv")
    with pytest.raises(ValueError, match=r"returns from 3 to 0\.2 mm"):
        datasets._require_one_test(readings, [*range(2, 8)], table)
    readings["stress"][4] = -0.4e6  # a fifth of the largest stress drives the joint back
    datasets._require_one_test(readings, [*range(2, 8)], table)


def test_names_of_shear_tests_have_their_normal_stress(tmp_path):
    slip = np.array([0.0, 0.2, 0.5, 1.0, 2.0, 3.0])
    stress = np.array([0.0, 1.0, 1.6, 1.5, 1.4, 1.4])
    for scatter, is_constant in ((0.01, True), (0.08, False)):  # within 5 % in all it is constant
        normal = 2.5 * (1 + scatter * np.linspace(-1.0, 1.0, 6))
        header = "us [mm],tau [MPa],sn [MPa]"
        np.savetxt(tmp_path / "lab.csv", np.column_stack([slip, stress, normal]), delimiter=",",
                   header=header, comments="")  # fmt: skip
        (test,) = datasets.read_shear(tmp_path / "lab.csv")
        assert test.name.startswith("lab.csv, ")
        assert quantities(test.name) == [pytest.approx(2.5e6)]
        assert (np.ptp(test.normal) == 0.0) == is_constant
    titles = [quantity.aliases[0] for quantity in (*datasets.PEAKS, datasets.NORMAL)]
    header = ",".join(
        f"{title} [{unit}]" for title, unit in zip(titles, UNITS_OF_PEAKS, strict=True)
    )
    (tmp_path / "peaks.csv").write_text(f"{header}\n1.25,0.05,0.8,9.9,2.5\n")
    (test,) = datasets.read_peaks(tmp_path / "peaks.csv")
    assert quantities(test.name) == [pytest.approx(2.5e6)]


def test_conditions_of_a_flow_test_are_noted(tmp_path):
    conditions = FlowConditions.linear(
        0.2, 0.1, rate=5e-6 / 60, outlet_pressure=2e5, viscosity=1.3e-3
    )
    rows = "\n".join(f"{stress},{pressure}" for stress, pressure in ((1, 210), (2, 220), (3, 260)))
    (tmp_path / "flow.csv").write_text(f"stress [MPa],p_in [kPa]\n{rows}\n")
    (note,) = read_flow(tmp_path / "flow.csv", conditions).notes
    assert quantities(note.partition(conditions.description)[2]) == pytest.approx(
        [5e-6 / 60, 1.3e-3, 2e5]
    )


def test_summaries_of_predictions():
    held_out = SimpleNamespace(stress=np.array([3e6, 6e6]))
    text = fit_command._report_held_out(held_out, np.array([0.02, -0.05]))
    assert "-5.0 % at the largest, 6 MPa" in text
    curves = [SimpleNamespace(normal=normal) for normal in (1e6, 4e6)]
    with pytest.raises(ValueError, match="at 1MPa, 4MPa: name two"):
        fit_command._split_shear_tests(curves, [1e6])


# --------------------------------------------------------------------------------------- accuracy


@pytest.mark.parametrize("azimuth", [0.0, 25.0, 90.0])
def test_angles_of_slip_tests(azimuth, monkeypatch):
    """A joint of known tractions, which opens by half of its slip forwards."""
    sheared = []

    def joints(n, **_):
        def update(step, tangent):
            sheared.append(step[:, 1:])
            sense = np.sign(step[:, 1:] @ direction)[:, None]
            return np.column_stack([np.full(n, 2e6), sense * 1e6 * direction]), None

        return SimpleNamespace(update=update)

    direction = np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))])
    law = SimpleNamespace(tables=SimpleNamespace(dim=3), mating_length=1e-3, joints=joints)
    monkeypatch.setattr(
        slip_tests,
        "closing_increments",
        lambda batch, step, *_: -0.5 * np.linalg.norm(step[:, 1:], axis=1),
    )
    tests = np.array([(1.0, azimuth, 1.0)])
    results = slip_tests.run_slip_tests(law, 1e-4, 2e6, tests)
    np.testing.assert_allclose(results.friction, np.degrees(np.arctan2(1e6, 2e6)))
    np.testing.assert_allclose(results.dilation, np.degrees(np.arctan(0.5)))
    total = np.sum(sheared[: slip_tests.STEPS_PER_LEG], axis=0)[0]
    np.testing.assert_allclose(total, slip_tests.max_slip(1e-3, 1e-4) * direction, atol=1e-15)


def test_angles_of_the_accuracy_suite():
    law = SimpleNamespace(
        asperity=SimpleNamespace(mu=np.tan(np.radians(31))), orientation=SimpleNamespace(a=5.0)
    )
    assert suite.limit_friction_angle(law) == pytest.approx(31.0 + 18.0)
    path = suite._in_space(np.array([[0.1, 2.0]]), 30.0)
    np.testing.assert_allclose(path, [[0.1, 2 * np.cos(np.pi / 6), 1.0]])
    law = SimpleNamespace(closure_range=1e-4, mating_length=1e-3, closure=lambda stress: 5e-5)
    quarter = SimpleNamespace(uniform=lambda low, high: low + (high - low) / 4)
    path = suite.random_slip_path(law, quarter, 1e6, np.linspace(0.0, 1.0, 11))
    assert np.abs(path[:, 1]).max() < 1e-12  # a quarter of a turn from the first direction
    assert path[:, 2].max() > 0.1


def test_time_of_an_update_is_in_nanoseconds(monkeypatch):
    """5 us for 10 joints."""
    timer = SimpleNamespace(timeit=lambda count: 5e-6, repeat=lambda *_: [7e-6, 5e-6, 6e-6])
    monkeypatch.setattr(tradeoff, "Timer", lambda update: timer)
    assert tradeoff._time_update(LAW, 10, True, 1e-3) == pytest.approx(500.0)


# ----------------------------------------------------------------------------------------- blocks


def test_laws_of_a_comparison_are_printed_in_degrees_and_millimetres(monkeypatch, capsys):
    law = jl.CoulombLaw(
        friction=np.tan(np.radians(40)), residual_friction=np.tan(np.radians(30)), weakening=2.5e-3,
        normal_stiffness=1e9, shear_stiffness=1e9,
    )  # fmt: skip
    row = {
        "laws": {"rock": law}, "stopped": "", "seed": 1, "law": "Coulomb", "time_s": 1.0,
        "rock": "slab", "state": "stable", "displacement_m": 0.0,
    }  # fmt: skip
    monkeypatch.setattr(compare, "compare", lambda *_: [row])
    monkeypatch.setattr("dem_demo.cli.format_outcome", lambda row: "")
    scene = SimpleNamespace(rocks=["slab"])
    monkeypatch.setattr("dem_demo.cli._load_in_plane", lambda options: scene)
    run_blocks(["compare", "slope"])
    line = capsys.readouterr().out.splitlines()[0]
    assert "40.0 degrees at the peak, 30.0 after 2.5 mm" in line


@pytest.mark.parametrize(("carried", "is_warned"), [(0.5, True), (0.95, False)])
def test_warning_of_a_bond_that_breaks_first(carried, is_warned, monkeypatch, capsys):
    """A friction angle of 40 degrees, of which the asperities carry a fraction."""
    carried_stress = carried * 2e6 * np.tan(np.radians(40))
    monkeypatch.setattr(cli, "friction_angle", lambda *_: 40.0)
    monkeypatch.setattr(
        cli, "direct_shear", lambda *_, **__: SimpleNamespace(shear_stress=[0.0, carried_stress])
    )
    law = replace(LAW, bond=jl.Bond(1e9, 1e9, 1e6, 1e6))
    cli._warn_of_bond("rock", law, 2e6)
    assert ("50% of the friction at 2e+06 Pa" in capsys.readouterr().out) == is_warned


def test_warning_of_a_closure_range_for_far_larger_stresses(capsys):
    """From a tenth of the stress of the cells down."""
    cell_stress = float(LAW.normal_stress(LAW.closure_range * LAW.resolution.lowest))
    cli._warn_of_closure_range("rock", LAW, 0.12 * cell_stress)
    assert capsys.readouterr().out == ""
    cli._warn_of_closure_range("rock", LAW, 0.08 * cell_stress)
    message = capsys.readouterr().out
    assert f"carry {0.08 * cell_stress:.2g} Pa" in message
    assert f"for {cell_stress:.2g} Pa" in message
    assert f"closure_range = {LAW.closure(0.16 * cell_stress):.2g}" in message


def test_listed_blocks_have_their_centroids():
    listed = [
        {"block": "a", "x_m": 1.0, "y_m": 2.5, "z_m": -3.0},
        {"block": "b", "x_m": 4.0, "y_m": 5.0},
    ]
    assert format_blocks(listed) == "a (1.00, 2.50, -3.00), b (4.00, 5.00)"


def test_forces_of_a_bolt_in_the_summary():
    """The largest force is before the end."""
    bolt = SimpleNamespace(ends=[(0.0, 1.0), (2.0, 3.0)], capacity=9e4)
    frames = [
        {"tension_N": np.array([tension]), "yielding_m": np.array([yielding])}
        for tension, yielding in ((1e4, 0.0), (5e4, 1e-3), (2e4, 2e-3))
    ]
    run = SimpleNamespace(bolts=frames, scene=SimpleNamespace(bolts=[bolt]))
    assert bolt_summary(run) == [
        {
            "from": [0.0, 1.0], "to": [2.0, 3.0], "capacity_N": 9e4, "force_N": 2e4,
            "largest_force_N": 5e4, "yielding_m": 2e-3,
        }
    ]  # fmt: skip


def test_row_of_a_comparison(monkeypatch):
    monkeypatch.setattr(compare, "outcomes", lambda record: [{"state": "failed"}])
    row = compare._row(SimpleNamespace(times=[0.0, 1.5]), "a message")
    assert row == {"state": "failed", "time_s": 1.5, "stopped": "a message"}


def test_mean_stresses_of_a_comparison():
    """Each closed joint of a law has the weight of its force; 100 kPa without closed joints."""
    joints = {
        "law": np.array([0, 0, 0, 1, 2]),
        "normal_stress_Pa": np.array([1e5, 3e5, -2e4, 4e5, 0.0]),
        "length_m": np.array([2.0, 1.0, 7.0, 0.3, 5.0]),
    }
    scene = SimpleNamespace(laws=dict.fromkeys(("rough", "smooth", "open")))
    means = compare._mean_stresses(SimpleNamespace(joints=[joints], scene=scene))
    rough = (1e5 * 2e5 + 3e5 * 3e5) / (2e5 + 3e5)
    np.testing.assert_allclose(means, [rough, 4e5, 1e5])


def test_results_of_an_ablation(tmp_path):
    scene = SimpleNamespace(
        shear=[(0, 1)], blocks=[SimpleNamespace(name="slab")], rocks=["slab"], title="whole"
    )
    series = {"slab: normal_Pa": np.array([2e6, 2e6]), "slab: shear_Pa": np.array([0.0, -2e6])}
    record = SimpleNamespace(
        scene=scene, series=lambda name: series[name], distances=np.array([0.5, np.nan, 2.0])
    )
    summary = {
        "slip": [{"block": "slab", "slip_angle": 31.0}],
        "rocks": [{"rock": "slab", "state": "failed", "displacement_m": 0.3}],
        "energy_J": {"friction": 4200.0}, "max_energy_error": 1e-5,
    }  # fmt: skip
    results = ablate._results(record, summary)
    assert results == {
        "slab, slips at_deg": 31.0,
        "slab, peak friction_deg": pytest.approx(45.0),
        "slab, state": "failed",
        "slab, displacement_m": 0.3,
        "largest displacement_m": 2.0,
        "friction_kJ": 4.2,
        "energy error_1": 1e-5,
    }
    row = {"variant": "whole scene", "note": "", "cpu_s": 2.0, "time_ratio": 1.0, "steps": 7}
    row |= results | {"time_step_s": 1e-4}
    printed = ablate.write([row | {ablate.DISTANCE: 3.0}], tmp_path)
    assert "3 mm from the whole scene" in printed
    with (tmp_path / "ablation.csv").open(newline="") as file:
        (written,) = csv.DictReader(file)
    assert [*written] == [
        "variant", *results, "distance of the ends_mm", "steps", "time_step_s", "cpu_s",
        "time_ratio", "note",
    ]  # fmt: skip
    assert float(written["time_step_s"]) == 1e-4
    assert written["steps"] == "7"


def test_row_of_a_variant_that_cannot_be_built():
    def refuse():
        raise SceneError("no joints")

    row, run = ablate._run("without joints", refuse, None)
    assert run is None
    assert np.isnan([row.pop("time_step_s"), row.pop("cpu_s")]).all()
    assert row == {"variant": "without joints", "steps": 0, "note": "stopped: no joints"}


def test_distance_of_a_variant_is_in_millimetres(monkeypatch):
    def run(name, build_variant, until):
        motion = np.zeros((1, 3, 2))
        motion[0, :2, 1] = [0.0, 0.0] if "whole" in name else [3e-3, 4e-3]
        return {"variant": name, "cpu_s": 1.0, "note": ""}, SimpleNamespace(motion=motion)

    monkeypatch.setattr(ablate, "_run", run)
    monkeypatch.setattr(ablate, "variants", lambda *_: [("without water", None)])
    _, variant, _ = ablate.ablate(None, None)
    assert variant["distance of the ends_mm"] == pytest.approx(5.0)


# ------------------------------------------------------------------------------- plausible values

PLAUSIBLE = {  # of rock, in SI units, and the same or another value in a wrong unit
    "mu": ([0.0, 0.7], [35.0]),
    "friction": ([0.0, 0.7], [35.0]),
    "normal_stiffness": ([1e10], [10.0]),
    "shear_stiffness": ([1e9], [1.0]),
    "stiffness at 1 MPa": ([3e10], [30.0]),
    "beta": ([1e-9, 1e-4], [0.0, 0.1]),
    "overlap": ([0.0, 1e-4, 0.1], [0.3]),
    "K": ([1e5, 2e10], [20.0]),
    "asperity_density": ([0.1, 1e6], [1e-4]),
    "a": ([1.5, 4.0], [0.5]),
    "closure": ([5e-9, 50e-6], [0.05, 50.0]),
    "shear displacement": ([1e-3, 0.5], [5e-9, 5.0]),
    "shear stress": ([1e6, 1e9], [1.0, 1e10]),
    "stress": ([1e6, 1e9], [1.0, 1e10]),
    "normal stress": ([1e6, 1e9], [1.0, 1e10]),
    "peak shear stress over normal stress": ([0.7, 10.0], [1e-3, 1e3]),
    "opening over shear displacement": ([0.0, 0.3], [30.0]),
    "plane": ([0.0, 1.57, -3.0], [90.0]),
}
UNITS_OF_RANGES = {
    "m": ("beta", "overlap", "closure", "shear displacement"),
    "Pa": ("stress", "shear stress", "normal stress"),
    "Pa/m": ("normal_stiffness", "shear_stiffness", "stiffness at 1 MPa"),
    "/m2": ("asperity_density",), "rad": ("plane",), "Pa m^(1-eta)": ("K",),
}  # fmt: skip


@pytest.mark.parametrize("name", rock.RANGES)
def test_plausible_values_of_rock(name):
    accepted, refused = PLAUSIBLE[name]
    for value in accepted:
        rock.require_rock({name: value})
    units = [unit for unit, names in UNITS_OF_RANGES.items() if name in names]
    for value in refused:
        with pytest.raises(ValueError, match=re.escape(name)) as error:
            rock.require_rock({name: value})
        bounds = rf"({NUMBER}) to ({NUMBER})" + "".join(f" {re.escape(unit)}" for unit in units)
        assert re.search(bounds, str(error.value)), str(error.value)


# ------------------------------------------------------------------------- curves of blocks, noise


def test_curves_of_blocks_end_beyond_the_strength_of_rock():
    """0.5 GPa is the strength of the strongest rock; far beyond it cells of the curve are wide."""
    stress = tabulate_first_loading(LAW)["stress"]
    assert 1e9 <= stress[-1] <= 5e9
    assert (np.diff(stress) > 0).all()


@pytest.mark.parametrize(("source", "factor"), [("load cell", 30.0), ("displacement", 4.0)])
def test_range_of_the_levels_of_noise(source, factor):
    """95 % of a normal density of the logarithm: from 1/4 to 4 times, of a load cell 1/30 to 30."""
    assert noise._level_sd(source) == pytest.approx(np.log(factor) / norm.ppf(0.975), rel=1e-3)


# ----------------------------------------------------------------------------------- joint tables


def test_friction_angle_error_of_a_table_is_in_degrees(monkeypatch):
    """The friction at the end of shear is 0.6 at the resolution of the law, and 0.5 at the fine
    one."""

    def known_friction(law, u, psi, limit, steps):
        ratio = 0.6 if law.resolution == LAW.resolution else 0.5
        return np.broadcast_to(np.reshape([0.9, ratio, 0.1], (3, 1, 1)), (3, len(u), len(psi)))

    monkeypatch.setattr(tabulate, "_friction", known_friction)
    table = tabulate.tabulate(replace(LAW, plane=None), tolerance=0.5, azimuths=4)
    error = math.degrees(math.atan(0.6)) - math.degrees(math.atan(0.5))  # 4.4 degrees
    assert table.metadata["resolution_error_friction_angle"] == pytest.approx(error)


def test_columns_of_a_table_file(tmp_path):
    """Each column by its documented name, with azimuths in degrees at the end of the name."""
    n, p = 4, 6
    by_row = {name: np.arange(n) + 10.0 * k for k, name in enumerate(("un", "sn", "sec", "tan"))}
    values = {
        name: 100.0 * (k + 1) + np.arange(n * p).reshape(n, p)
        for k, name in enumerate(("kt", "mu", "mob", "dil"))
    }
    table = JointTable(
        by_row["un"], by_row["sn"], by_row["sec"], by_row["tan"], np.pi / p * np.arange(p),
        values["kt"], values["mu"], values["mob"], values["dil"], {},
    )  # fmt: skip
    table.save(tmp_path / "joint.txt")
    written = np.genfromtxt(tmp_path / "joint.txt", names=True)
    expected = {
        "un": by_row["un"], "sn": by_row["sn"], "kn_secant": by_row["sec"],
        "kn_tangent": by_row["tan"], "mu": values["mu"].mean(axis=1),
    }  # fmt: skip
    for name, columns in values.items():
        expected |= {f"{name}_{30 * k:03d}": column for k, column in enumerate(columns.T)}
    assert {*written.dtype.names} == {*expected}
    for name, column in expected.items():
        np.testing.assert_allclose(written[name], column, err_msg=name)
