"""Files of laboratories: read correctly, or refused with the option that helps."""

import re
from itertools import product

import numpy as np
import pytest

from jointlaw.calibration import datasets
from jointlaw.calibration.datasets import load, names, read_closure, read_peaks, read_shear
from jointlaw.calibration.envelopes import envelope_strength, normal_at_peak_and_last
from jointlaw.calibration.measured import ClosureCurve, ShearCurve, first_loading

U = np.array([0.0, 0.05, 0.1, 0.2, 0.5, 1.0])  # mm
TAU = np.array([0.0, 0.875, 1.25, 1.75, 1.625, 1.5])  # MPa
NORMAL = {"normal_stress": 2e6}


def read(folder, text, reader=read_shear, encoding="utf-8", **options):
    """Write a text to a file and read it."""
    (folder / "lab.csv").write_text(text, encoding=encoding, newline="")
    return reader(folder / "lab.csv", **options)


def rows(*columns, mark=",", decimal="."):
    """Rows of a file from its columns."""
    table = zip(*(np.asarray(c).tolist() for c in columns), strict=True)
    return "\n".join(mark.join(str(x).replace(".", decimal) for x in row) for row in table)


READABLE = {  # text of the file and options of `read_shear`
    "commas and brackets": ("us [mm],tau (kPa)\n" + rows(U, 1e3 * TAU), NORMAL),
    "semicolons, decimal commas, a typographic minus": (
        "us (mm);tau in MPa\n" + rows(-U, -TAU, mark=";", decimal=",").replace("-", "−"), NORMAL
    ),
    "tabs and strokes": ("# A 7\n\nus /mm\ttau /MPa\n" + rows(U, TAU, mark="\t"), NORMAL),
    "blanks and decimal commas": (
        "us_mm tau_MPa\n" + rows(U, TAU, mark="  ", decimal=","), NORMAL
    ),
    "a row of units, Windows": (
        "\ufeffNo;us;tau;sn\r\n[-];[mm];[N/mm2];[kPa]\r\n"
        + rows(range(6), U, TAU, 0 * U + 2e3, mark=";").replace("\n", "\r\n"), {},
    ),
    "measured normal stress, a displacement that does not begin at zero": (
        "us [mm],tau [bar],normal stress [bar]\n"
        + rows(U + 12.5, 10 * TAU, 20 + np.array([0.1, -0.1, 0.2, 0.0, -0.2, 0.0])), {},
    ),
    "other columns, empty cells": (
        '"time","us, mm","tau in MPa"\n"12:03",,\n'
        + "\n".join(f'"12:0{k}","{u}","{t}"' for k, (u, t) in enumerate(zip(U, TAU, strict=1))),
        NORMAL,
    ),
    "European thousands separators, shown by one number": (
        "us [mm];tau [kPa]\n"
        + rows(U, ["0", "875", "1.250,0", "1.750", "1.625", "1.500"], mark=";").replace("0.", "0,")
        .replace("1.0;", "1,0;"), NORMAL,
    ),
    "American thousands separators, shown by one number": (
        "us [mm]\ttau [kPa]\n"
        + rows(U, ["0", "875", "1,250.0", "1,750", "1,625", "1,500"], mark="\t"), NORMAL,
    ),
    "lines of a form above the names, a separator line of Excel": (
        "sep=;\nJoint 7, Grimsel; 12.3.2024\nOperator; A. B.\n\nus;tau;sn\n[mm];[MPa];[MPa]\n"
        + rows(U, TAU, 0 * U + 2, mark=";"), {},
    ),
    "Swiss and French thousands separators, units in lower case": (
        "us_mm;tau_kpa;sn [kPa]\n"
        + rows(U, ["0.0", "875.0", "1'250.0", "1 750.0", "1\u202f625.0", "1’500.0"], 0 * U + 2e3,
               mark=";"), {},
    ),
    "forces on an area that shrinks with slip": (
        "us [mm],shear force [kN],normal force [kN]\n"
        + rows(U, 10 * TAU * (1 - U / 100), 20 * (1 - U / 100)), {"area": 0.01, "side": 0.1},
    ),
    "other names and signs": (
        "u,resistance [MPa]\n" + rows(U, -TAU),
        NORMAL | {"shear": "u:mm", "stress": "resistance:-1MPa"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "cp1252"])
@pytest.mark.parametrize("name", READABLE)
def test_readable_files(name, encoding, tmp_path):
    text, options = READABLE[name]
    text = (
        text if encoding != "cp1252" else text.translate({0x2212: "-", 0x202F: "\xa0", 0xFEFF: ""})
    )
    (test,) = read(tmp_path, text, encoding=encoding, **options)
    assert test.normal == pytest.approx(2e6)
    sense = np.sign(test.shear[-1])
    np.testing.assert_allclose(sense * test.shear, 1e-3 * U, atol=1e-15)
    np.testing.assert_allclose(sense * test.shear_stress, 1e6 * TAU, atol=1e-9)


def test_closure_file(tmp_path):
    text = "Disp;sigmaZ\n/mm;/kPa\n" + rows(U, 1e3 * U, mark=";")
    stress, closure, notes, source = read(tmp_path, text, read_closure)
    assert not notes
    assert source == "normal stress: sigmaZ [kPa]; closure: Disp [mm]"
    np.testing.assert_allclose(closure, 1e-3 * U)
    np.testing.assert_allclose(stress, 1e6 * U)
    assert all(load(name)[0].max() > 1e6 for name in names())


OPENING = np.array([0.0, -0.01, 0.0, 0.05, 0.15, 0.25])  # mm
TWO_TESTS = {  # in one file
    "below": "\n".join(
        2 * ["us [mm],tau [MPa],sn [MPa],dn [mm]", rows(U, TAU, 0 * U + 2, OPENING)]
    ),
    "beside": "\n".join(
        f"{line},,{line}"
        for line in [
            "us [mm],tau [MPa],sn [MPa],dn [mm]",
            *rows(U, TAU, 0 * U + 2, OPENING).split(),
        ]
    ),
    "sheets": None,
}


@pytest.mark.parametrize("kind", TWO_TESTS)
def test_two_tests_of_one_file(kind, tmp_path):
    path = tmp_path / "lab.csv"
    text = TWO_TESTS[kind]
    if text is None:
        titles = ["us [mm]", "tau [MPa]", "sn [MPa]", "dn [mm]"]
        table = np.column_stack([U, TAU, 0 * U + 2, OPENING]).tolist()
        cells = [["Joint 7"], [], titles, *table]
        path = workbook(tmp_path / "lab.xlsx", A=cells, other=cells)
    else:
        path.write_text(text)
    tests = read_shear(path)
    assert len(tests) == 2
    for test in tests:
        np.testing.assert_allclose(test.shear_stress, 1e6 * TAU)
        np.testing.assert_allclose(test.opening, 1e-3 * OPENING)
        np.testing.assert_array_equal(test.normal, 2e6)


def test_table_of_peaks_has_one_test_per_row(tmp_path):
    """Titles as in a published data set of sandstone joints."""
    first, second = read(
        tmp_path,
        "curve_id,normal_stress_mpa,peak_shear_stress_mpa,peak_shear_displacement_mm,"
        "final_shear_stress_mpa,final_shear_displacement_mm\n"
        "JA_1,1.0,1.28,1.937,0.862,9.97\nJA_2,2.0,2.31,2.365,1.775,10.0\n",
        read_peaks,
    )
    np.testing.assert_allclose(second.shear, [0, 2.365e-3, 10e-3])
    np.testing.assert_allclose(first.shear_stress, [0, 1.28e6, 0.862e6])
    assert (first.normal[0], second.normal[0]) == (1e6, 2e6)


def workbook(path, **sheets):
    """A workbook with these rows of cells."""
    book = pytest.importorskip("openpyxl").Workbook()
    book.remove(book.active)
    for name, cells in sheets.items():
        sheet = book.create_sheet(name)
        for row in cells:
            sheet.append(row)
    book.save(path)
    return path


TITLES = ["us [mm]", "tau [kPa]", "sn [kPa]"]


@pytest.mark.parametrize(
    ("cell", "decimal", "stress"),
    [
        ("1,201", "comma", 1.201e3),
        ("1,201", "point", 1.201e6),
        ("1201,5", None, 1201.5e3),
        ("1,201.5", None, 1201.5e3),
        (1.201, None, 1.201e3),
        (1.201, "comma", 1.201e3),
    ],
)
def test_text_in_a_workbook_is_read_as_in_a_text_file(cell, decimal, stress, tmp_path):
    """Cells with numbers do not show the decimal mark of cells with text."""
    path = workbook(tmp_path / "lab.xlsx", A=[TITLES, [0, 0, 50], [1, 1.125, 50], [2, cell, 50]])
    (test,) = read_shear(path, decimal=decimal)
    np.testing.assert_allclose(test.shear_stress, [0, 1125, stress])


def test_ambiguous_thousands_are_refused_in_a_workbook(tmp_path):
    path = workbook(tmp_path / "lab.xlsx", A=[TITLES, [0, 0, 2], [1, 1.5, 2], [2, "1,201", 2]])
    with pytest.raises(ValueError, match=r"line 4 holds '1,201', which may .*--decimal comma"):
        read_shear(path)


def test_sheets_without_a_test_are_noted_and_skipped(tmp_path):
    summary = [["Test", "peak [kPa]"], ["A", 875.0]]
    table = [TITLES, *np.column_stack([U, 1e3 * TAU, 0 * U + 2e3]).tolist()]
    path = workbook(tmp_path / "lab.xlsx", Summary=summary, A=table, B=table)
    first, second = read_shear(path)
    assert first.notes == (f"{path}, sheet Summary: no test, not read",)
    assert not second.notes
    with pytest.raises(ValueError, match="sheet Summary: which column is the shear displ"):
        read_shear(workbook(path, Summary=summary))


def test_spreadsheets_without_values_and_of_other_formats_are_refused(tmp_path):
    path = workbook(tmp_path / "lab.xlsx", A=[TITLES, *([k, f"=A{k}*2", 2] for k in range(2, 6))])
    with pytest.raises(ValueError, match="formulas without their values; open it in"):
        read_shear(path)
    for head in (b"\xd0\xcf\x11\xe0", b"PK\x03\x04"):
        (tmp_path / "lab.xls").write_bytes(head + bytes(600))
        with pytest.raises(
            ValueError, match=r"lab.xls: is a spreadsheet, not text; save it as CSV"
        ):
            read_shear(tmp_path / "lab.xls")


CURVE = {
    datasets.SHEAR: U, datasets.SHEAR_STRESS: TAU, datasets.NORMAL: 0 * U + 2,
    datasets.OPENING: OPENING,
}  # fmt: skip
PEAK = {
    **dict(zip(datasets.PEAKS, ([1.25], [0.05], [0.8], [9.9]), strict=True)),
    datasets.NORMAL: [2.0],
}


@pytest.mark.parametrize(
    ("table", "quantity", "alias"),
    [
        (table, quantity, alias)
        for table in (CURVE, PEAK)
        for quantity in table
        for alias in quantity.aliases
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_every_alias_of_a_column_is_read(table, quantity, alias, tmp_path):
    titles = [alias.upper() if one is quantity else one.aliases[0] for one in table]
    units = [{"m": "mm", "Pa": "MPa"}[one.si_unit] for one in table]
    header = ",".join(f"{title} [{unit}]" for title, unit in zip(titles, units, strict=True))
    reader = read_peaks if table is PEAK else read_shear
    (test,) = read(tmp_path, f"{header}\n{rows(*table.values())}", reader)
    assert test.normal == pytest.approx(2e6)
    assert test.shear[1] == pytest.approx(0.05e-3)
    assert test.shear_stress[2 - (table is PEAK)] == pytest.approx(1.25e6)


def test_varying_normal_stress_is_used_row_by_row(tmp_path):
    (test,) = read(tmp_path, "us [mm],tau [MPa],sn [MPa]\n" + rows(U, TAU, 1 + U))
    np.testing.assert_allclose(test.normal, 1e6 * (1 + U))


def test_tare_is_subtracted_and_noted(tmp_path):
    """A reading of 0.1 MPa before the test; 1 % is scatter of the first row."""
    (test,) = read(tmp_path, "us [mm],tau [MPa]\n" + rows(U, TAU + 0.1), **NORMAL)
    np.testing.assert_allclose(test.shear_stress, 1e6 * TAU)
    assert "begins at 5.4 % of its largest value, which is subtracted" in test.notes[0]
    (test,) = read(tmp_path, "us [mm],tau [MPa]\n" + rows(U, TAU + 0.01), **NORMAL)
    np.testing.assert_allclose(test.shear_stress, 1e6 * TAU + 1e4)
    assert not test.notes


FINE = np.linspace(0, 1, 21)  # mm
OUTLIERS = {  # a file with an outlier, and its reason in the message
    "a sentinel": (rows(range(21), FINE, np.where(FINE == 0.5, -999, 2 * FINE)),
                   "line 12: tau [MPa] is -999.0"),
    "a jump": (rows(range(21), FINE, np.where(FINE == 0.5, 4, 2 * FINE)),
               "line 12: tau [MPa] jumps and returns"),
    "a jump of the displacement": (rows(range(21), np.where(FINE == 0.5, 3, FINE), 2 * FINE),
                            "line 12: us [mm] jumps and returns"),
    "a summary": (rows(range(21), FINE, 2 * FINE) + "\nMax,1,2", "line 23: No is 'Max'"),
}  # fmt: skip


@pytest.mark.parametrize("kind", OUTLIERS)
def test_outliers_are_refused_until_an_option_decides(kind, tmp_path):
    table, reason = OUTLIERS[kind]
    text = "No,us [mm],tau [MPa]\n" + table
    with pytest.raises(ValueError, match=rf"{re.escape(reason)}\. .*--outliers skip"):
        read(tmp_path, text, **NORMAL)
    (skipped,) = read(tmp_path, text, **NORMAL, outliers="skip")
    if kind != "a sentinel":
        (complete,) = read(tmp_path, text, **NORMAL, outliers="keep")
        assert complete.shear.size == skipped.shear.size + 1
    np.testing.assert_allclose(skipped.shear_stress, 2e9 * skipped.shear, atol=1e-6)
    assert reason in skipped.notes[0]


def test_lost_reading_in_an_incomplete_row_needs_no_option(tmp_path):
    text = "No,us [mm],tau [MPa]\n" + rows(range(21), FINE, 2 * FINE) + "\n21,-999,"
    assert read(tmp_path, text, **NORMAL)[0].shear.size == 21


LOGGER_SHEAR = np.linspace(0, 2, 41)  # mm
LOGGER_STRESS = np.round(1250 * (1 - np.exp(-LOGGER_SHEAR / 0.2)), 1)  # kPa
LOGGER_STRESS[0] -= 5.0  # scatter


def logger_file(tau, normal=1000.0):
    return "us [mm],tau [kPa],sn [kPa]\n" + rows(LOGGER_SHEAR, tau, normal + 0 * LOGGER_SHEAR)


@pytest.mark.parametrize(
    ("value", "lost_rows"),
    [
        *product([-99.0, 0.0], [[20, 21], [20, 21, 22, 23]]),
        *product([-999.0, -9999.99, 9999.0, 32767.0], [[20, 21], [20, 21, 22, 23], [39, 40], [40]]),
    ],
)
def test_lost_readings_of_a_logger_are_named(value, lost_rows, tmp_path):
    """Stresses in kPa are as large as the sentinel values; -99 is small for kPa."""
    tau = LOGGER_STRESS.copy()
    tau[lost_rows] = value
    with pytest.raises(ValueError, match=f"line {lost_rows[0] + 2}: tau .kPa. (is|jumps)"):
        read(tmp_path, logger_file(tau))
    (test,) = read(tmp_path, logger_file(tau), outliers="skip")
    np.testing.assert_allclose(test.shear_stress, 1e3 * np.delete(LOGGER_STRESS, lost_rows))


@pytest.mark.parametrize(
    ("tau", "normal"),
    [
        (LOGGER_STRESS, np.where(LOGGER_SHEAR == 1, 999.0, 1000.0)),
        (np.minimum(LOGGER_STRESS, 999.0), 1000.0),
        (
            LOGGER_STRESS,
            np.where(abs(LOGGER_SHEAR - 1) < 0.3, 2000.0, 1000.0),
        ),  # a stage of 11 rows
    ],
)
def test_measurements_equal_to_sentinels_are_read(tau, normal, tmp_path):
    assert read(tmp_path, logger_file(tau, normal))[0].shear.size == 41


def test_closing_in_shear_must_be_confirmed(tmp_path):
    text = "us [mm],tau [MPa],sn [MPa],dn [mm]\n" + rows(U, TAU, 0 * U + 10, -0.1 * U)
    with pytest.raises(ValueError, match=r'does close, write --opening-column "dn:1mm"'):
        read(tmp_path, text)
    (test,) = read(tmp_path, text, opening="dn:1mm")
    np.testing.assert_allclose(test.opening, -1e-4 * U)


@pytest.mark.parametrize("gauge", ["us", "dn"])
def test_record_that_begins_under_shear_needs_the_row_of_zero_stress(gauge, tmp_path):
    """63 % of the shear stress in the first row; a row of zero stress determines the offsets."""
    offset = {"us": 12.53, "dn": 12.53} if gauge == "us" else {"us": 0.01, "dn": 3.0}
    tau = np.maximum(TAU, 1.1)
    text = "us [mm],tau [MPa],sn [MPa],dn [mm]\n"
    table = rows(U + offset["us"], tau, 0 * U + 2, OPENING + offset["dn"])
    message = rf"column '{gauge} \[mm\]' begins at .* 63 % .*: add a first row"
    with pytest.raises(ValueError, match=message):
        read(tmp_path, text + table)
    (test,) = read(tmp_path, f"{text}{offset['us'] - 0.01},0,2,{offset['dn']}\n{table}")
    np.testing.assert_allclose(test.shear[1:], 1e-3 * (U + 0.01))
    np.testing.assert_allclose(test.opening[1:], 1e-3 * OPENING, atol=1e-15)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("1,1200,1.5,800,10", "line 3: peak shear stress over normal stress = 1200 is outside"),
        ("1,1.2,10,0.8,1.5", r"line 3: the peak, .* are columns exchanged\?"),
        ("1,0.8,1.5,1.2,10", r"line 3: the peak, .* are columns exchanged\?"),
        ("1,1.2,1.5,0.8,1.5", "line 3: the peak, .* must .* come before it"),
        ("1,1.2,1.5,,", "line 3: 'tau_r .MPa.' is empty or not > 0; give all five numbers"),
        ("1,1.2,0,0.8,10", "line 3: 'u_p .mm.' is empty or not > 0"),
        ("1,1.2,1.5,-999,-999", "line 3: u_r .mm. is -999.*--outliers skip"),
        ("0.000001,0.0000012,1.5,0.0000008,10", "line 3: shear stress = 1.2 Pa is outside"),
    ],
)
def test_invalid_rows_of_peaks_are_refused(row, message, tmp_path):
    valid = "sn [MPa],tau_p [MPa],u_p [mm],tau_r [MPa],u_r [mm]\n2,2.2,1.6,1.7,10\n"
    with pytest.raises(ValueError, match=rf"lab\.csv: {message}"):
        read(tmp_path, valid + row, read_peaks)
    if "-999" in row:
        assert len(read(tmp_path, valid + row, read_peaks, outliers="skip")) == 1


def test_steep_end_of_unloading_is_no_jump(tmp_path):
    """Unloading to zero stress reverses a third of the closure in one row."""
    stress = np.array([0.5, 2, 4, 2, 0.1, 0, 0.1, 2, 4, 8])
    text = "s [MPa],closure [um]\n" + rows(stress, 50 * stress**0.2)
    assert read(tmp_path, text, read_closure, stress="s:MPa")[0].size == 10


def test_first_loading_of_a_test_with_preload_cycles():
    stress = np.array([0.5, 2, 4, 2, 0.5, 2, 4, 6, 8, 4, 0.5, 4, 8, 10, 5, 1.0])
    first_stress, row = first_loading(stress, np.arange(16.0))
    np.testing.assert_array_equal(first_stress, [0.5, 2, 4, 6, 8, 10])
    np.testing.assert_array_equal(row, [0, 1, 2, 7, 8, 13])


def test_slack_before_any_load_is_no_closure():
    """0.3 mm at zero load: first contact is unknown, and the closure at preload is fitted."""
    stress = np.array([0, 0, 0, 1, 2, 4, 8])
    closure = np.array([0, 100, 300, 310, 315, 322, 331])
    curve = ClosureCurve(1e6 * stress, 1e-6 * closure)
    assert curve.preload_closure is None
    np.testing.assert_array_equal(curve.stress, 1e6 * stress[3:])
    assert "3 rows before any load are slack of 0.0003 m" in curve.notes[0]


@pytest.mark.parametrize(
    ("name", "strength"),
    [
        ("Coulomb", lambda s: 0.4e6 + s * np.tan(np.radians(35))),
        ("Barton", lambda s: s * np.tan(np.radians(30 + 8 * np.log10(60e6 / s)))),
        ("power law", lambda s: 2e3 * s**0.8),
    ],
)
def test_envelope_reproduces_strengths_of_its_own_form(name, strength):
    stresses = [1e6, 3e6, 5e6]
    tests = [ShearCurve([0, 1e-3, 1e-2], strength(s) * np.array([0, 1, 0.8]), s) for s in stresses]
    peak, residual = envelope_strength(name, tests, 4e6)
    assert peak == pytest.approx(strength(4e6), rel=1e-9)
    # Barton's form times 0.8 has another form
    assert residual == pytest.approx(0.8 * strength(4e6), rel=0.01)


@pytest.mark.parametrize("name", ["Coulomb", "Barton", "power law"])
def test_envelopes_of_a_coulomb_joint_under_constant_stiffness(name):
    """Dilation raises the normal stress five times: every row is on the line of Coulomb."""
    shear = np.linspace(0.0, 1e-2, 50)
    tests = []
    for initial in (0.5e6, 1e6, 2e6, 4e6):
        normal = initial * (1 + 400 * shear)
        tests.append(ShearCurve(shear, 0.7 * normal * np.minimum(1.0, shear / 1e-3), normal))
    predicted = tests.pop(2)
    rows = normal_at_peak_and_last(predicted)
    np.testing.assert_allclose(rows, 10e6)
    strength = envelope_strength(name, tests, rows)
    np.testing.assert_allclose(strength, 7e6, rtol=1e-9)


THOUSANDS = "us [mm]\ttau [kPa]\n0.0\t0\n0.1\t875\n0.2\t1,201\n0.3\t1,305\n"


# 1,201 kPa is 1.2 MPa or 1.2 kPa: later checks may not detect a factor of 1000
AMBIGUOUS_FILES = [
    THOUSANDS,
    THOUSANDS.replace("\t", ";"),
    "us [mm],tau [kPa]\n0,0\n1,1.201\n2,1.305\n",
    THOUSANDS.replace("0.", "0,").replace("1,", "1."),  # decimal commas, points for thousands
    'us [mm],tau [kPa]\n0.0,0\n0.1,875\n0.2,"1,201"\n',
]


@pytest.mark.parametrize(
    ("cells", "decimal", "stress"),
    [
        ("1,1;1,125\n2,2;1,201\n", None, 1.201e6),
        ("1;1,125\n2;1,201\n", "comma", 1.201e6),
        ("1;1,200\n2;1,201\n", "comma", 1.201e6),
        ("1;1,200\n2;1,201\n", "point", 1201e6),
    ],
)
def test_decimal_commas_are_read_if_a_number_or_the_caller_shows_them(
    cells, decimal, stress, tmp_path
):
    text = "us [mm];tau [MPa]\n0;0\n" + cells
    (test,) = read(tmp_path, text, normal_stress=5e7, decimal=decimal)
    assert test.shear_stress[2] == stress


@pytest.mark.parametrize(
    ("text", "message"),
    [
        *((text, "may have a mark between its thousands.*--decimal comma")
          for text in AMBIGUOUS_FILES),
        ("us [mm];tau [MPa]\n0;0\n1;1,125\n2;1,201\n", "line 3 holds '1,125'"),
        ("displacement [mm],u [mm],tau [MPa]\n" + rows(U / 9, U, TAU),
         "which column is the shear displacement"),
        (None, r"lab\.csv: cannot be read .*; give a CSV file"),
        ("", "must hold a line of names with units"),
        (rows(U, TAU), "must hold a line of names with units"),
        ("us [mm],tau [MPa]\n1,2\n2,\n3,\n", "has 1 rows with all numbers; give 3 or more"),
        ("us [mm],us [mm],tau [MPa]\n1,2,3\n2,3,4\n3,4,5\n", "has 2 columns of one name"),
        ("us [mm],tau [MPa]\n0,0\n1,2\n2,inf\n", r"line 4: tau .MPa. is 'inf'.*--outliers skip"),
        ("us [mm],tau\n" + rows(U, TAU), 'gives no unit; give the unit that .* "tau:MPa"'),
        ("us [mm],tau [psi]\n" + rows(U, TAU), "has the unit 'psi', none of Pa"),
        ("us [mm],tau [MPa]\n" + rows(U, TAU, decimal=","), "has 4 cells .* columns by semicolons"),
        ("us [mm];tau [MPa]\n1;2;3\n2;3;4\n", "has 3 cells under 2 names; give each column a name"),
        ("us [mm],tau [MPa]\n" + rows(U, -TAU), 'change its sign: .* "tau:-1MPa"'),
    ],
)  # fmt: skip
def test_unreadable_files_are_refused(text, message, tmp_path):
    if text is not None:
        (tmp_path / "lab.csv").write_text(text)
    with pytest.raises(ValueError, match=message):
        read_shear(tmp_path / "lab.csv", **NORMAL)


# ------------------------------------------------- kinds of files of loggers and spreadsheets

N = np.arange(12)
LONG_U = np.round(0.25 * N, 3)  # mm
LONG_TAU = np.round(1.8 * (1 - np.exp(-LONG_U / 0.3)), 4)  # MPa
LONG_DN = np.round(0.1 * LONG_U + 0.002, 4)  # mm
NAMES = "us [mm],tau [MPa],sn [MPa],dn [mm]\n"


def long_table(u=LONG_U, tau=LONG_TAU, dn=LONG_DN, normal=2.0):
    return rows(u, tau, np.broadcast_to(normal, np.shape(u)), dn) + "\n"


def assert_long_test(test):
    np.testing.assert_allclose(test.shear, 1e-3 * LONG_U, atol=1e-15)
    np.testing.assert_allclose(test.shear_stress, 1e6 * LONG_TAU)
    np.testing.assert_allclose(test.opening, 1e-3 * (LONG_DN - LONG_DN[0]), atol=1e-15)
    assert test.normal == pytest.approx(2e6)


def with_column(title, unit="", cells=N, last=False):
    """A table with one column more, and its units in a row below the names if `unit` is given."""
    table = [line.split(",") for line in long_table().split()]
    names = NAMES.strip().split(",")
    head = [[name.split()[0] for name in names], ["mm", "MPa", "MPa", "mm"]] if unit else [names]
    more = [[title, unit] if unit else [title], [str(cell) for cell in cells]]
    lines = []
    for row, cell in zip([*head, *table], [*more[0], *more[1]], strict=True):
        lines.append(";".join([*row, cell] if last else [cell, *row]))
    return "\n".join(lines)


@pytest.mark.parametrize("last", [False, True])
@pytest.mark.parametrize(
    "unit",
    [
        "s", "sec", "min", "h", "°C", "C", "deg C", "V", "mV/V", "%", "-", "mm/min", "hh:mm:ss",
        "Hz", "kN/s", "[s]", "mm",
    ],
)  # fmt: skip
def test_row_of_units_with_a_column_of_another_kind(unit, last, tmp_path):
    (test,) = read(tmp_path, with_column("other", unit, last=last))
    assert_long_test(test)


def test_row_of_units_above_the_names(tmp_path):
    text = "mm;MPa;MPa;mm\nus;tau;sn;dn\n" + long_table().replace(",", ";")
    assert_long_test(*read(tmp_path, text))


def test_index_column_without_a_name(tmp_path):
    """As pandas writes it."""
    assert_long_test(*read(tmp_path, with_column("").replace(";", ",")))


@pytest.mark.parametrize(
    ("stress", "factor"),
    [
        ("N/mm^2", 1), ("N/mm²", 1), ("MN/m2", 1), ("kN/m^2", 1e3), ("N/cm2", 100), ("MPA", 1),
        ("KPA", 1e3), ("mbar", 1e4), ("МПа", 1), ("Mpa.", 1),
    ],
)  # fmt: skip
def test_spellings_of_units(stress, factor, tmp_path):
    names = NAMES.replace("MPa", stress).replace("[mm]", "[MM]", 1)
    table = long_table(tau=factor * LONG_TAU, normal=2.0 * factor)
    assert_long_test(*read(tmp_path, names + table))


def test_names_and_units_in_capitals_and_full_width_brackets(tmp_path):
    names = "SHEAR_DISP_MM,SHEAR_STRESS_MPA,NORMAL_STRESS_MPA,DILATION（mm）\n"
    assert_long_test(*read(tmp_path, names + long_table()))


def test_exponents_of_fortran(tmp_path):
    table = ["  ".join(f"{x:.6E}" for x in row) for row in zip(LONG_U, LONG_TAU, strict=True)]
    text = "us[mm] tau[MPa]\n" + "\n".join(table).replace("E", "D")
    (test,) = read(tmp_path, text, **NORMAL)
    np.testing.assert_allclose(test.shear_stress, 1e6 * LONG_TAU)


@pytest.mark.parametrize(
    ("unit", "size", "option"),
    [
        ("psi", 6894.757, "tau:6.894757kPa"),
        ("kgf/cm2", 98066.5, "tau:98.0665kPa"),
        ("t/m^2", 9806.65, "tau:9.80665kPa"),
        ("kgf", None, None),
        ("zoll", None, None),
    ],
)
def test_remedy_for_an_unknown_unit_reads_right(unit, size, option, tmp_path):
    """The message gives the size of the unit, or nothing, and never another unit."""
    text = f"us [mm],tau [{unit}]\n" + rows(LONG_U, 1e6 * LONG_TAU / (size or 1e6))
    with pytest.raises(ValueError, match="none of Pa; ") as error:
        read(tmp_path, text, **NORMAL)
    written = re.findall(r'--shear-stress-column "(.*)"', str(error.value))
    assert written == ([option] if option else [])
    for one in written:
        (test,) = read(tmp_path, text, **NORMAL, stress=one)
        np.testing.assert_allclose(test.shear_stress, 1e6 * LONG_TAU, rtol=1e-6)
    if size:
        with pytest.raises(ValueError, match=r"the option names 'MPa'; write .*file$"):
            read(tmp_path, text, **NORMAL, stress="tau:MPa")


@pytest.mark.parametrize(
    "reader_and_text",
    [
        "Results Table 1\nSpecimen label,K3\nArea,100,cm2\n\n"
        'Time,us,tau,sn,dn\n(s),(mm),(MPa),(MPa),(mm)\n"{rows}',
        "Projekt;Tunnel Nord\nDurchmesser;100,0;mm\nDatum;01.05.2024\n\n"
        "Zeit;Scherweg;Scherspannung;Normalspannung;Vertikalweg\ns;mm;N/mm²;N/mm²;mm\n{rows}",
        "LabVIEW Measurement\t\nWriter_Version\t2\nDecimal_Separator\t.\n***End_of_Header***\t\n"
        "\t\nChannels\t4\t\t\t\nSamples\t12\t12\t12\t12\nX0\t0.0\t0.0\t0.0\t0.0\n"
        "Delta_X\t1\t1\t1\t1\n***End_of_Header***\t\t\t\t\n"
        "X_Value\tus [mm]\ttau [MPa]\tsn [MPa]\tdn [mm]\tComment\n{rows}",
    ],
    ids=["Instron", "Wille", "LabVIEW"],
)
def test_header_of_a_testing_machine(reader_and_text, tmp_path):
    """With values, and lines of several numbers, above the names."""
    mark = next(mark for mark in "\t;," if mark in reader_and_text)
    table = rows(N, LONG_U, LONG_TAU, 0 * LONG_U + 2, LONG_DN, mark=mark)
    if mark == ";":
        table = table.replace(".", ",")
    text = reader_and_text.replace('"{', "{").replace("{rows}", table)
    assert_long_test(*read(tmp_path, text))


REFUSED_ROWS = {  # rows that are no measurement: text, reason, number of rows
    "repeated rows": (
        NAMES + long_table() + "\n".join(long_table().splitlines()[-4:]) + "\n",
        "line 14: repeats line 10; line 15: repeats line 11", 4,
    ),
    "a summary under remarks": (
        with_column("Remark", cells=[""] * 12, last=True) + "\n3;1.8;2;0.3;Max\n1;1;2;0.1;Mean",
        "line 14: Remark is 'Max'; line 15: Remark is 'Mean'", 2,
    ),
    "a summary in the first column": (
        NAMES + long_table() + "Max,1.8,2,0.3\n", "line 14: us [mm] is 'Max'", 1,
    ),
    "an error": (
        NAMES + long_table() + "2.9,#DIV/0!,2,0.3\n", "line 14: tau [MPa] is '#DIV/0!'", 1,
    ),
    "an overflow": (NAMES + long_table() + "2.9,OL,2,0.3\n", "line 14: tau [MPa] is 'OL'", 1),
    "a line cut by a power failure": (
        with_column("n", cells=[f"{k}.000" for k in N], last=True) + "\n3;1.8;2;0.3;12.0",
        "line 14: n is '12.0', cut short", 1,
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", REFUSED_ROWS)
def test_rows_that_are_no_measurement(kind, tmp_path):
    text, reason, count = REFUSED_ROWS[kind]
    with pytest.raises(ValueError, match=re.escape(reason) + r".* Write --outliers skip to leave"):
        read(tmp_path, text)
    (test,) = read(tmp_path, text, outliers="skip")
    assert_long_test(test)
    assert f"{count} rows are left out as outliers ({reason}" in test.notes[0]
    if "is '#" in reason or "is 'OL" in reason or "[mm] is 'M" in reason:
        with pytest.raises(ValueError, match="which is no number: it cannot be kept"):
            read(tmp_path, text, outliers="keep")
    else:
        assert read(tmp_path, text, outliers="keep")[0].shear.size == 12 + count


def test_remark_at_the_peak_and_a_hold_are_measurements(tmp_path):
    remarks = ["", "", "Max", *[""] * 9]
    assert_long_test(*read(tmp_path, with_column("Remark", cells=remarks, last=True)))
    hold = rows([0, 1, 1, 1, 1, 2], [0, 1, 1, 1, 1, 1.2])
    assert read(tmp_path, "us [mm],tau [MPa]\n" + hold, **NORMAL)[0].shear.size == 6


def test_second_test_without_its_names_is_refused_with_its_line(tmp_path):
    second = long_table(tau=2 * LONG_TAU, normal=4.0)
    message = r"line 14: the shear displacement returns from 2\.75 to 0 mm .*: repeat the line of"
    with pytest.raises(ValueError, match=message):
        read(tmp_path, NAMES + long_table() + second)
    tests = read(tmp_path, NAMES + long_table() + NAMES + second)
    assert [test.normal[0] for test in tests] == [2e6, 4e6]


def test_few_rows_of_a_cycle_are_one_test(tmp_path):
    """Back to the start in one row, driven by a shear stress in this direction."""
    text = "us [mm],tau [MPa]\n0,0\n1,1.8\n3,1.5\n0,-1.4\n-3,-1.4\n0,1.4\n"
    assert read(tmp_path, text, **NORMAL)[0].shear.size == 6


@pytest.mark.parametrize("elastic", [0.0, 0.01, 0.05])
def test_unloading_at_the_end_is_left_out(elastic, tmp_path):
    """The shear stress falls to a tenth while the displacement returns by at most 0.05 mm."""
    end = LONG_U[-1] - elastic * np.array([0.3, 0.6, 1.0])
    tail = long_table(end, LONG_TAU[-1] * np.array([0.7, 0.4, 0.1]), LONG_DN[-1] + 0 * end)
    (test,) = read(tmp_path, NAMES + long_table() + tail)
    assert_long_test(test)
    assert "3 rows at the end are unloading" in test.notes[0]


def test_strength_lost_with_displacement_is_no_unloading(tmp_path):
    """The last rows fall to a third, but the joint slides on."""
    tau = np.where(N < 10, LONG_TAU, 0.6)
    assert read(tmp_path, NAMES + long_table(tau=tau))[0].shear.size == 12


def test_record_under_load_at_zero_displacement_begins_with_this_stress(tmp_path):
    """As before an injection: the normal stress falls, and the joint slides under its load."""
    text = NAMES + "0,1,4,0\n0.01,1,3,0.001\n0.1,1,2,0.01\n1,0.95,1.5,0.1\n"
    (test,) = read(tmp_path, text)
    assert test.initial_stress == 1e6
    assert (
        "begins at a shear stress of 1e+02 % of the largest: the joint is loaded" in test.notes[0]
    )
    with pytest.raises(ValueError, match=r"begins at 18 % .* against the shear"):
        read(tmp_path, NAMES + long_table(tau=np.where(N == 0, -0.32, LONG_TAU)))


def test_gauges_of_one_opening(tmp_path):
    names = "us [mm],tau [MPa],sn [MPa],A [mm],B [mm],C [um]\n"
    offset = [0.1, -0.3, 20]
    gauges = (LONG_DN + offset[0], 1.2 * LONG_DN + offset[1], 800 * LONG_DN + offset[2])
    text = names + rows(LONG_U, LONG_TAU, 0 * LONG_U + 2, *gauges)
    (alone,) = read(tmp_path, text)
    assert alone.opening is None
    assert "lengths that are not used: A [mm], B [mm], C [um]" in alone.notes[0]
    (test,) = read(tmp_path, text, opening="A,B,C")
    assert_long_test(test)
    # 0.4 of the opening, 0.275 mm
    assert (
        "the mean of 3 gauges, A [mm], B [mm], C [um]; they differ by up to 0.11 mm"
        in (test.notes[0])
    )
    without_units = text.replace(" [mm],B [mm],C [um]", ",B,C")
    (pair,) = read(tmp_path, without_units, opening="A,B:mm")
    np.testing.assert_allclose(pair.opening, 1.1e-3 * (LONG_DN - LONG_DN[0]), atol=1e-15)
    with pytest.raises(ValueError, match=r"which column is the opening.*--opening-column"):
        read(tmp_path, text, opening="A,D:mm")


def test_opening_beyond_the_displacement_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"opening over shear displacement = 100 is outside"):
        read(tmp_path, NAMES + long_table(dn=1000 * LONG_DN))


def test_normal_stress_of_zero_is_refused_with_the_file(tmp_path):
    names = "us [mm],sn [MPa],tau [MPa],dn [mm]\n"
    with pytest.raises(ValueError, match=r"lab\.csv: normal stress = 0 Pa .* columns exchanged"):
        read(tmp_path, names + long_table())


def test_closure_test_with_a_force(tmp_path):
    text = "Load [kN],closure [um]\n" + rows([0, 10, 20, 40, 80], [0, 20, 30, 40, 50])
    record = read(tmp_path, text, read_closure, area=0.01)
    np.testing.assert_allclose(record.stress, 1e6 * np.array([0, 1, 2, 4, 8]))
    assert record.notes == ["stress is force over an area of 100 cm2"]
    with pytest.raises(ValueError, match="has forces; give the area, --closure-area 100cm2"):
        read(tmp_path, text, read_closure)
    stresses = text.replace("Load [kN]", "stress [MPa]")
    with pytest.raises(ValueError, match="has stresses, not forces: leave --closure-area out"):
        read(tmp_path, stresses, read_closure, area=0.01)


def test_hidden_sheets_are_noted_and_hidden_rows_refused(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    table = [TITLES, *np.column_stack([U, 1e3 * TAU, 0 * U + 2e3]).tolist()]
    path = workbook(tmp_path / "lab.xlsx", A=table, old=table)
    book = openpyxl.load_workbook(path)
    book["old"].sheet_state = "hidden"
    book.save(path)
    (test,) = read_shear(path)
    assert test.notes == ("sheet old is hidden: it is not read",)
    book["A"].row_dimensions[5].hidden = True
    book.save(path)
    with pytest.raises(ValueError, match=r"sheet A: 1 rows are hidden, as by a filter, from row 5"):
        read_shear(path)
