"""Text files of laboratories: read right, or refused with the option that cures it."""

import numpy as np
import pytest

from jointlaw.calibration.datasets import load, names, read_closure, read_shear

U = np.array([0.0, 0.05, 0.1, 0.2, 0.5, 1.0])  # mm
TAU = np.array([0.0, 0.875, 1.25, 1.75, 1.625, 1.5])  # MPa
NORMAL = {"normal_stress": 2e6}


def rows(*columns, mark=",", decimal="."):
    """Lines of a file."""
    table = zip(*(np.asarray(c).tolist() for c in columns), strict=True)
    return "\n".join(mark.join(str(x).replace(".", decimal) for x in row) for row in table)


READ = {  # the file, and what `read_shear` is told of it
    "commas and brackets": ("us [mm],tau (kPa)\n" + rows(U, 1e3 * TAU), NORMAL),
    "semicolons, decimal commas, a sign that is typeset": (
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
    "a normal stress that is measured, a gauge that does not begin at zero": (
        "us [mm],tau [bar],normal stress [bar]\n"
        + rows(U + 12.5, 10 * TAU, 20 + np.array([0.1, -0.1, 0.2, 0.0, -0.2, 0.0])), {},
    ),
    "other columns, empty cells": (
        '"time","us, mm","tau in MPa"\n"12:03",,\n'
        + "\n".join(f'"12:0{k}","{u}","{t}"' for k, (u, t) in enumerate(zip(U, TAU, strict=1))),
        NORMAL,
    ),
    "thousands that one number shows, on ordinary paper of Europe": (
        "us [mm];tau [kPa]\n"
        + rows(U, ["0", "875", "1.250,0", "1.750", "1.625", "1.500"], mark=";").replace("0.", "0,")
        .replace("1.0;", "1,0;"), NORMAL,
    ),
    "the same of America": (
        "us [mm]\ttau [kPa]\n"
        + rows(U, ["0", "875", "1,250.0", "1,750", "1,625", "1,500"], mark="\t"), NORMAL,
    ),
    "names and signs of its own": (
        "way,resistance [MPa]\n" + rows(U, -TAU),
        NORMAL | {"shear": "way:mm", "stress": "resistance:-1MPa"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", READ)
def test_read_right(name, tmp_path):
    text, told = READ[name]
    (tmp_path / "lab.csv").write_text(text, encoding="utf-8", newline="")
    found = read_shear(tmp_path / "lab.csv", **told)
    assert found.normal == pytest.approx(2e6)
    sense = np.sign(found.shear[-1])
    np.testing.assert_allclose(sense * found.shear, 1e-3 * U, atol=1e-15)
    np.testing.assert_allclose(sense * found.shear_stress, 1e6 * TAU, atol=1e-9)


def test_closure_is_read_alike(tmp_path):
    (tmp_path / "c.csv").write_text("Disp;sigmaZ\n/mm;/kPa\n" + rows(U, 1e3 * U, mark=";"))
    stress, closure = read_closure(tmp_path / "c.csv")
    np.testing.assert_allclose(closure, 1e-3 * U)
    np.testing.assert_allclose(stress, 1e6 * U)
    assert all(load(name)[0].max() > 1e6 for name in names())


THOUSANDS = "us [mm]\ttau [kPa]\n0.0\t0\n0.1\t875\n0.2\t1,201\n0.3\t1,305\n"


@pytest.mark.parametrize(
    "text",
    [
        THOUSANDS,
        THOUSANDS.replace("\t", ";"),
        "us [mm],tau [kPa]\n0,0\n1,1.201\n2,1.305\n",
        THOUSANDS.replace("0.", "0,").replace("1,", "1."),  # decimal commas, points for thousands
        'us [mm],tau [kPa]\n0.0,0\n0.1,875\n0.2,"1,201"\n',
    ],
)
def test_what_may_be_thousands_is_refused(text, tmp_path):
    """1,201 kPa is 1.2 MPa or 1.2 kPa: a factor of 1000 that no later check may see."""
    (tmp_path / "lab.csv").write_text(text)
    with pytest.raises(ValueError, match=r"may have a mark between its thousands.*--decimal comma"):
        read_shear(tmp_path / "lab.csv", **NORMAL)


def test_decimal_commas_are_read_where_a_number_or_the_caller_shows_them(tmp_path):
    path, text = tmp_path / "lab.csv", "us [mm];tau [MPa]\n0;0\n1,1;1,125\n2,2;1,201\n"
    path.write_text(text)
    assert read_shear(path, **NORMAL).shear_stress[2] == 1.201e6
    path.write_text(text.replace("1,1;", "1;").replace("2,2;", "2;"))
    assert read_shear(path, **NORMAL, decimal="comma").shear_stress[2] == 1.201e6
    with pytest.raises(ValueError, match="line 3 holds '1,125'"):
        read_shear(path, **NORMAL)
    for mark, value in (("comma", 1.201e6), ("point", 1201e6)):
        path.write_text("us [mm];tau [MPa]\n0;0\n1;1,200\n2;1,201\n")
        assert read_shear(path, normal_stress=5e7, decimal=mark).shear_stress[2] == value


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (None, r"lab\.csv: cannot be read .*; give a CSV file"),
        ("", "must hold a line of names with units"),
        (rows(U, TAU), "must hold a line of names with units"),
        ("us [mm],tau [MPa]\n1,2\n2,\n3,\n", "has 1 rows with both numbers; give 3 or more"),
        ("us [mm],us [mm],tau [MPa]\n1,2,3\n2,3,4\n3,4,5\n", "has 2 columns of one name"),
        ("us [mm],tau [MPa]\n0,0\n1,2\n2,inf\n", "line 4 holds 'inf', which is no number"),
        ("us [mm],tau\n" + rows(U, TAU), 'gives no unit; name it, .* "tau:MPa"'),
        ("us [mm],tau [mpa]\n" + rows(U, TAU), "has the unit 'mpa', none of Pa"),
        ("us [mm],tau [MPa]\n" + rows(U, TAU, decimal=","), "has 4 cells .* columns by semicolons"),
        ("us [mm];tau [MPa]\n1;2;3\n2;3;4\n", "has 3 cells under 2 names; give each column a name"),
        ("us [mm],tau [MPa]\n" + rows(U, -TAU), 'turn its sign: .* "tau:-1MPa"'),
    ],
)
def test_what_cannot_be_read(text, told, tmp_path):
    if text is not None:
        (tmp_path / "lab.csv").write_text(text)
    with pytest.raises(ValueError, match=told):
        read_shear(tmp_path / "lab.csv", **NORMAL)
