"""Which heights the reading "population" admits: the virgin curve must be convex."""

import pytest

import jointlaw as jl

SMOOTH = {"alpha": 3.82, "beta": 1.15e-6, "overlap": 2e-6}
ROUGH = {"alpha": 6.14, "beta": 3.52e-6, "overlap": 12e-6}


@pytest.mark.parametrize(("heights", "least"), [(SMOOTH, 0.287), (ROUGH, 0.312)])
def test_least_exponent_of_the_printed_heights(make_law, heights, least):
    """Where `Phi` of Eq. 37 stops being convex, found by hand to three digits."""
    make_law(heights=jl.GammaHeights(**heights), eta=least)
    with pytest.raises(ValueError, match="not convex") as error:
        make_law(heights=jl.GammaHeights(**heights), eta=least - 0.001)
    for remedy in ('formation = "individual"', "broader", "larger overlap", "larger eta"):
        assert remedy in str(error.value)
    assert f"asperity.eta = {least - 0.001:g}" in str(error.value)


@pytest.mark.parametrize("eta", [0.0, 1.0])
@pytest.mark.parametrize(
    "heights", [SMOOTH, ROUGH, SMOOTH | {"beta": 1e-9}, ROUGH | {"overlap": 0}]
)
def test_individual_is_always_convex(make_law, heights, eta):
    make_law(heights=jl.GammaHeights(**heights, formation="individual"), eta=eta)


@pytest.mark.parametrize("overlap", [0.0, 9.9e-6])
def test_a_density_that_ends_in_a_step_is_refused(make_law, overlap):
    """Its slope falls at the very end, beyond every quantile."""
    with pytest.raises(ValueError, match="not convex"):
        make_law(heights=jl.Heights(([1], [0.0, 1e-5]), overlap, "population"))
