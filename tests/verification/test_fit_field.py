"""A law from field values against the relations of Barton that it stands for."""

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.cli.main import main

GIVEN = {"jcs": 100e6, "length": 0.1, "normal_stress": 1e6, "normal_stiffness": 30e9}


@pytest.mark.parametrize(
    ("jrc", "jcs"), [(4.0, 100e6), (10.0, 100e6), (16.0, 100e6), (20.0, 200e6)]
)
def test_the_peak_is_that_of_barton(jrc, jcs):
    """Angle by 30 + JRC log10(JCS/stress), displacement within a tenth (a peak is flat)."""
    law = jl.from_field(**{**GIVEN, "jrc": jrc, "jcs": jcs})
    slip = 0.1 / 500 * (jrc / 0.1) ** 0.33
    record = jl.direct_shear(law.joint(), 4 * slip, 1e6)
    assert record.peak_friction_angle == pytest.approx(30 + jrc * np.log10(jcs / 1e6), abs=0.1)
    assert record.shear[np.argmax(record.shear_stress)] == pytest.approx(slip, rel=0.1)
    for stress in (2e6, 5e6) if jrc == 10 else ():  # as docs/field.md says
        peak = jl.direct_shear(law.joint(), 4 * slip, stress, steps=200).peak_friction_angle
        assert peak == pytest.approx(30 + jrc * np.log10(100e6 / stress), abs=0.7)
    _, C = law.joint().update([law.closure(1e6), 0.0, 0.0])
    assert C[0, 0] == pytest.approx(30e9, rel=0.02)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"jcs": 1e6}, "climb by 0 degrees above 30"),
        ({"jrc": 40.0}, "climb by 80 degrees above 30: it must be 1 to 50"),
        ({"normal_stiffness": 1e8}, "a joint too soft"),
        ({"jrc": 20.0, "length": 1.0, "normal_stiffness": 1e11}, "misses .* its displacement by -"),
        ({"length": 0.0}, "length = 0.0 is out of bounds"),
    ],
)
def test_what_no_law_has_is_named(change, told):
    with pytest.raises(ValueError, match=told):
        jl.from_field(**{"jrc": 10.0, **GIVEN, **change})


def test_the_command_says_what_it_assumed(tmp_path, capsys):
    values = "--jrc 10 --jcs 100MPa --length 10cm --normal-stress 1MPa --normal-stiffness 30GPa/m"
    assert main(f"field {values} --out {tmp_path}".split()) == 0
    printed = capsys.readouterr().out
    assert "angle 50.0 deg at a shear displacement of 0.914 mm (Barton: 0.914)" in printed
    assert "dilation angle 16.6 deg (Barton: 10.0)" in printed
    assert "Assumed, for no field value tells them" in printed
    assert jl.JointLaw.from_toml(tmp_path / "law.toml").asperity.mu == pytest.approx(3**-0.5)
