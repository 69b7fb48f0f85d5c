"""Files of laboratories: read correctly, or refused with the option that helps."""

import re
from itertools import product

import numpy as np
import pytest

from jointlaw.calibration import datasets
from jointlaw.calibration.datasets import load, names, read_closure, read_peaks, read_shear
from jointlaw.calibration.envelopes import envelope_strength
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
    stress, closure, notes = read(tmp_path, text, read_closure)
    assert not notes
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
        ("us [mm],tau [MPa]\n0,0\n1,2\n2,inf\n", "line 4 holds 'inf', which is no number"),
        ("us [mm],tau\n" + rows(U, TAU), 'gives no unit; name it, .* "tau:MPa"'),
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
