"""CSV files as laboratories write them: read right, or refused with the option that cures it."""

import re
from pathlib import Path

import numpy as np
import pytest

from jointlaw.calibration.datasets import read_closure, read_shear

U = np.array([0.0, 0.05, 0.1, 0.2, 0.5, 1.0])  # mm
TAU = np.array([0.0, 0.8, 1.25, 1.5, 1.625, 1.5])  # MPa
CURVE = list(zip(U, TAU, strict=True))
NAN = float("nan")


def rows(*columns, mark=",", decimal="."):
    """Lines of a file; an empty cell for NaN."""

    def cell(x):
        return "" if isinstance(x, float) and np.isnan(x) else str(x).replace(".", decimal)

    table = zip(*(np.asarray(c).tolist() for c in columns), strict=True)
    return "\n".join(mark.join(map(cell, row)) for row in table)


READ = {  # the file, and the normal stress (MPa) of each curve in it
    "commas and brackets": ("us [mm],tau [kPa]\n" + rows(U, 1e3 * TAU), [NAN]),
    "semicolons and decimal commas": (
        "Shear displacement (mm);Shear stress (MPa)\n" + rows(U, TAU, mark=";", decimal=","),
        [NAN],
    ),
    "tabs, units after a stroke": ("us /mm\ttau /MPa\n" + rows(U, TAU, mark="\t"), [NAN]),
    "a row of units": ("us;tau;sn\nmm;MPa;kPa\n" + rows(U, TAU, 0 * U + 2e3, mark=";"), [2.0]),
    "a row of units in brackets": (
        "No,us,tau\n[-],[mm],[N/mm2]\n" + rows(range(6), U, TAU),
        [NAN],
    ),
    "lines above the names": (
        "Project;A 7\nDate;2021-03-04\n\nus [mm];tau [MPa]\n" + rows(U, TAU, mark=";"),
        [NAN],
    ),
    "blanks, empty rows and a last word": (
        "us [mm] ; tau [MPa] ;;\n" + rows(U, TAU, mark=" ; ") + "  ;;\n\n ;;;\nend of test\n",
        [NAN],
    ),
    "stress in the titles, columns of two lengths": (
        "us [mm],tau at 1 MPa [MPa],tau at 3 MPa [MPa]\n"
        + rows(np.append(U, 2.0), np.append(TAU, NAN), np.append(TAU, 1.5)),
        [1.0, 3.0],
    ),
    "stress in the titles, in kPa, with a decimal comma": (
        "us_mm;tau_MPa sn = 0,5 MPa\n" + rows(U, TAU, mark=";", decimal=","),
        [0.5],
    ),
    "a normal stress that is measured": (
        "us [mm],tau [bar],normal stress [bar]\n"
        + rows(U, 10 * TAU, 20 + np.array([0.1, -0.1, 0.2, 0.0, -0.2, 0.0])),
        [2.0],
    ),
    "three tests under each other": (
        "us [mm],tau [MPa],sigma_n [MPa]\n"
        + "\n".join(rows(U, TAU, 0 * U + level) for level in (1, 3, 5)),
        [1.0, 3.0, 5.0],
    ),
    "a column pair for each test": (
        "u1 [mm],u [mm],tau at 1 MPa [MPa],u [mm],tau at 3 MPa [MPa]\n"
        + rows(0 * U, U, TAU, U, TAU),
        [1.0, 3.0],
    ),
    "other columns, quotes, times": (
        '"time","remark","us, mm","tau in MPa"\n'
        + "\n".join(
            f'"12:0{k}","ok","{u}","{t}"' for k, (u, t) in enumerate(zip(U, TAU, strict=1))
        ),
        [NAN],
    ),
    "blanks and decimal commas": ("us_mm tau_MPa\n" + rows(U, TAU, mark="  ", decimal=","), [NAN]),
    "Windows": ("\ufeffus [mm],tau [MPa]\r\n" + rows(U, TAU).replace("\n", "\r\n"), [NAN]),
    "sheared backwards": ("us [mm],tau [MPa]\n" + rows(-U, -TAU), [NAN]),
    "a gauge that does not begin at zero": ("us [mm],tau [MPa]\n" + rows(12.5 + U, TAU), [NAN]),
}


@pytest.mark.parametrize("name", READ)
def test_read_right(name, tmp_path):
    text, normals = READ[name]
    (tmp_path / "lab.csv").write_text(text, encoding="utf-8", newline="")
    found = read_shear(tmp_path / "lab.csv")
    stated = [test.normal for test in found]
    assert stated == pytest.approx([1e6 * n for n in normals], nan_ok=True)
    for test in found:
        sense = np.sign(test.shear[-1])
        np.testing.assert_allclose(sense * test.shear[: U.size], 1e-3 * U, atol=1e-15)
        np.testing.assert_allclose(sense * test.shear_stress[: U.size], 1e6 * TAU, atol=1e-9)


REFUSED = {  # the file, and by which numbers its stress is written
    "no names": rows(U, TAU),
    "no unit of the displacement": "us,tau [MPa]\n" + rows(U, TAU),
    "no unit of the stress": "us [mm],tau at 3 MPa\n" + rows(U, TAU),
    "per cent of the peak": "us [mm],tau (% of peak)\n" + rows(U, 100 * TAU / 3.2),
    "reversed sign": "us [mm],tau [MPa]\n" + rows(U, -TAU),
    "a unit in small letters": "us [mm],tau [mpa]\n" + rows(U, TAU),
    "names of its own": "way [mm],resistance [MPa]\n" + rows(U, TAU),
    "decimal commas between commas": "us [mm],tau [MPa]\n" + rows(U, 1 + TAU, decimal=","),
}
OWN = {"NAME:mm": "way:mm", "NAME:MPa": "resistance:MPa"}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_the_cure(name, tmp_path):
    """The options that the messages name, taken one after the other, read the file."""
    path, given, message = tmp_path / "lab.csv", {}, ""
    path.write_text(REFUSED[name])
    for _ in range(3):
        try:
            (test,) = read_shear(path, **given)
            break
        except ValueError as error:
            message = str(error)
        assert str(path) in message
        if "separate the columns by semicolons" in message:
            path.write_text("us [mm];tau [MPa]\n" + rows(U, TAU, mark=";", decimal=","))
            continue
        what, cure = re.search(r'--(shear|shear-stress)-column "(.*?)"', message).groups()
        if name == "no names" and what == "shear-stress":
            cure = "2:MPa"  # which of the columns it is, only the reader knows
        given[what.removeprefix("shear-")] = OWN.get(cure, cure)
    assert message
    np.testing.assert_allclose(test.shear, 1e-3 * U, atol=1e-15)
    np.testing.assert_allclose(test.shear_stress, 1e6 * TAU, atol=1e-9)


def test_closure_is_read_alike(tmp_path):
    (tmp_path / "c.csv").write_text("Disp;sigmaZ\n/mm;/kPa\n" + rows(U, 1e3 * U, mark=";"))
    stress, closure = read_closure(tmp_path / "c.csv")
    np.testing.assert_allclose(closure, 1e-3 * U)
    np.testing.assert_allclose(stress, 1e6 * U)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "has no row of two numbers or more"),
        ("us [mm],tau [MPa]\n", "has no row of two numbers or more"),
        ("us [mm],tau [MPa]\n1,2\n", "has 1 rows with both numbers; give 3 or more"),
        ("us [mm],u [mm],us [mm],tau [MPa]\n1,1,2,3\n2,2,3,4\n3,3,4,5\n", "2 columns of shear"),
        ("us [mm],tau [MPa]\n0,0\n1,2\n2,inf\n", "line 4 holds 'inf', which is no number"),
    ],
)
def test_what_cannot_be_read(text, told, tmp_path):
    (tmp_path / "lab.csv").write_text(text)
    with pytest.raises(ValueError, match=told):
        read_shear(tmp_path / "lab.csv")


def test_no_file():
    with pytest.raises(ValueError, match=r"nowhere\.csv: cannot be read .*; give a CSV file"):
        read_shear(Path("nowhere.csv"))
