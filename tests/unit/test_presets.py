"""The presets hold the numbers that the paper prints, in its own units, converted here."""

import re

import numpy as np
import pytest

import jointlaw as jl

UM, MM, GPA = 1e-6, 1e-3, 1e9

# K in GPa um^(1/2) (section 4.1 to 4.3), r0 and beta in um unless noted, N in 1/um2
HERTZ_200 = {"K": 200, "lam": 1.2, "eta": 0.5}
SMOOTH = {"alpha": 3.82, "beta": 1.15, "overlap": 2.0}
ROUGH = {"alpha": 6.14, "beta": 3.52, "overlap": 12.0}
PRINTED = {
    "westerly-smooth": ((6.0, 0.0, 0.0), HERTZ_200, SMOOTH, UM),
    "westerly-rough": ((3.0, 0.0, 0.0), HERTZ_200, ROUGH, UM),
    "biegel-smooth": ((3.0, 0.5, 0.0), HERTZ_200 | {"mu": 0.3}, SMOOTH, UM),
    "biegel-rough": ((2.5, 2.0, 0.0), HERTZ_200 | {"mu": 0.3}, ROUGH, UM),
    "jing-replica": (
        (3.0, -1.0, -0.3), {"K": 300, "lam": 0.33, "eta": 0.5, "mu": 0.47},
        SMOOTH | {"overlap": 3.0}, MM,
    ),
    "linear-a2": ((2.0, 0.0, 0.0), {"lam": 1.0, "eta": 0.0, "mu": 0.6}, None, UM),
    "linear-a3": ((3.0, 0.0, 0.0), {"lam": 1.0, "eta": 0.0, "mu": 0.6}, None, UM),
    "linear-a6": ((6.0, 0.0, 0.0), {"lam": 1.0, "eta": 0.0, "mu": 0.6}, None, UM),
    "linear-a9": ((9.0, 0.0, 0.0), {"lam": 1.0, "eta": 0.0, "mu": 0.6}, None, UM),
    "nonlinear-a3": ((3.0, 0.0, 0.0), {"K": 100, "lam": 1.0, "eta": 0.5, "mu": 0.6}, None, UM),
    "nonlinear-a6": ((6.0, 0.0, 0.0), {"K": 100, "lam": 1.0, "eta": 0.5, "mu": 0.6}, None, UM),
}  # fmt: skip


def test_every_printed_set_is_a_preset_and_every_preset_is_printed():
    assert jl.presets.names() == sorted(PRINTED)


@pytest.mark.parametrize("name", PRINTED)
def test_numbers_of_the_paper(name):
    shape, asperity, heights, length = PRINTED[name]
    law = jl.presets.load(name)
    assert law.orientation == jl.Orientation(*shape)
    # K in GPa um^(1/2), for every length scale of the heights
    sizes = {"K": GPA * UM**0.5, "beta": length, "overlap": length}
    for part, values in ((law.asperity, asperity), (law.heights, heights or {})):
        printed = {key: value * sizes.get(key, 1.0) for key, value in values.items()}
        assert {key: getattr(part, key) for key in values} == pytest.approx(printed, rel=1e-12)
    if heights is None:
        assert (law.heights, law.closure_range) == (None, 1 * UM)  # the closure of Fig. 14 to 16
    else:
        assert law.heights.formation == "population"


@pytest.mark.parametrize("name", PRINTED)
def test_each_is_a_file_with_its_source_and_closes_and_shears(name):
    law = jl.presets.load(name)
    assert jl.JointLaw.from_text(jl.presets.text(name)) == law
    assert re.match(r"Misra 1999, .*section 4\.", jl.presets.about(name)["source"])
    F, C = law.joint().update([law.closure_range, 0.1 * law.closure_range, 0.0])
    assert (F[:2] > 0).all()
    assert np.isfinite(C).all()
