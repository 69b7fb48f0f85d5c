"""Scans of surfaces whose asperities are known."""

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.surface.fit import from_surface
from jointlaw.surface.scan_files import read_scan
from jointlaw.surface.synthetic import draw_directions, synthetic_surface

SPACING = 20e-6
ORIENTATION, HEIGHTS = jl.Orientation(3.0, 0.5, 0.1), jl.GammaHeights(4.0, 1e-5)


def scan(seed, orientation=ORIENTATION, heights=HEIGHTS, **options):
    options = {"spacing": SPACING, "noise": 0.3e-6} | options
    return synthetic_surface(orientation, heights, seed=seed, **options)


@pytest.mark.parametrize(
    ("orientation", "heights"),
    [
        (ORIENTATION, HEIGHTS),
        (jl.Orientation(6.0, 0.0, 0.0), jl.GammaHeights(6.0, 2e-5)),
        (jl.Orientation(2.0, -0.5, -0.2), jl.GammaHeights(2.0, 3e-5)),
    ],
)
def test_known_parameters_are_covered_by_their_errors(orientation, heights):
    """0.3 um of noise: the 95 % intervals hold the truth in 45 to 49 of 50 scans."""
    truth = {
        "a": orientation.a, "b": orientation.b, "c": orientation.c,
        "alpha": heights.alpha, "beta": heights.beta,
    }  # fmt: skip
    hits = dict.fromkeys(truth, 0)
    for seed in range(50, 100):
        fit = from_surface(scan(seed, orientation, heights), SPACING)
        for name, value in truth.items():
            low, high = fit.interval(name)
            hits[name] += low <= value <= high
    assert all(45 <= count <= 49 for count in hits.values()), hits
    assert set(truth) <= set(fit.identifiable)


def test_the_density_of_asperities_is_counted():
    fit = from_surface(scan(0, noise=0.0), SPACING)
    true = 1 / (20 * SPACING) ** 2
    # all 24 x 24 are found; they keep off the rim, which is not counted as area: 5 % more
    assert fit.asperities.depth.size == 576
    assert fit.asperity_density == pytest.approx(true, rel=0.06)


def test_it_depends_on_the_sampling_length_and_says_so():
    fit = from_surface(scan(1), SPACING)
    fine, coarse = fit.at_lengths((1, 4))
    assert coarse.asperity_density < 0.5 * fine.asperity_density
    assert "sampling length" in fit.report()
    assert f"{coarse.asperities.depth.size}" in fit.report()


def test_turning_the_scan_turns_the_anisotropy():
    z = scan(2)
    along, across = from_surface(z, SPACING), from_surface(z.T.copy(), SPACING)
    assert along.parameters["c"] == pytest.approx(
        -across.parameters["c"], abs=2 * along.standard_error["c"]
    )


def test_a_profile_says_what_it_cannot_tell():
    rng = np.random.default_rng(0)
    tiles = []
    for depth in rng.gamma(5.0, 1e-5, 400):  # tents, the slopes those of facets cut at random
        theta, phi = draw_directions(jl.Orientation(3.0), 2, rng)
        fall = np.abs(np.tan(theta) * np.cos(phi))
        x = (np.arange(20) - 10) * SPACING
        tiles.append(-depth - np.where(x < 0, -fall[0] * x, fall[1] * x))
    z = np.concatenate(tiles) + 0.1e-6 * rng.standard_normal(8000)
    fit = from_surface(z, SPACING)
    assert {"c", "asperity_density"} <= set(fit.not_identifiable)
    assert fit.parameters["a"] == pytest.approx(3.0, abs=4 * fit.standard_error["a"])
    with pytest.raises(ValueError, match="asperity_density"):
        fit.law(jl.Asperity(2e8, 1.2, 0.5, 0.3))


def test_a_scan_makes_a_law():
    fit = from_surface(scan(3), SPACING)
    law = fit.law(jl.Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.6))
    assert law.normal_stress(20e-6) > 0
    # the overlap puts zero closure at the highest summit: about one of them touches
    assert law.contacts(0.0) / law.asperity_density * fit.asperities.depth.size < 10


def test_files_give_the_array_back(tmp_path):
    z = scan(4, rows=8, columns=6)
    np.savetxt(tmp_path / "z.csv", z * 1e6, delimiter=",", header="heights in um")
    np.save(tmp_path / "z.npy", z)
    for name, factor in (("z.csv", 1e-6), ("z.npy", 1.0)):
        read, spacing = read_scan(tmp_path / name, SPACING, factor)
        assert read == pytest.approx(z, abs=1e-15)
        assert spacing == SPACING
    with pytest.raises(ValueError, match="spacing"):
        read_scan(tmp_path / "z.npy")
    with pytest.raises(ValueError, match="no unit of its heights; name it, such as --height-unit"):
        read_scan(tmp_path / "z.npy", SPACING)


@pytest.mark.parametrize("factor", [1e3, 1e6])
def test_heights_in_another_unit_fix_no_direction(factor):
    """Taken as m what is in mm or um: all facets stand on edge, and no direction is known."""
    fit = from_surface(factor * scan(1, rows=8, columns=8), SPACING)
    assert not {"a", "b", "c"} & set(fit.identifiable)


def test_the_topography_library_is_read(tmp_path):
    library = pytest.importorskip("SurfaceTopography")
    z = scan(5, rows=4, columns=6)
    sizes = (z.shape[1] * 20.0, z.shape[0] * 20.0)
    surface = library.Topography(z.T * 1e6, sizes, unit="um")
    surface.to_netcdf(str(tmp_path / "z.nc"))
    read, spacing = read_scan(tmp_path / "z.nc")
    assert spacing == pytest.approx(SPACING)
    assert read == pytest.approx(z, abs=1e-12)


def test_a_unit_is_taken_once_from_the_file_or_the_caller(tmp_path):
    """Heights come out in m whoever names the unit; nobody, or both, is refused."""
    library = pytest.importorskip("SurfaceTopography")
    z = scan(5, rows=4, columns=6)
    sizes = (z.shape[1] * 20.0, z.shape[0] * 20.0)
    library.Topography(z.T * 1e6, sizes).to_netcdf(str(tmp_path / "bare.nc"))
    library.Topography(z.T * 1e6, sizes, unit="um").to_netcdf(str(tmp_path / "um.nc"))
    read, spacing = read_scan(tmp_path / "bare.nc", SPACING, 1e-6)
    assert spacing == SPACING
    assert read == pytest.approx(z, abs=1e-12)
    for spacing, factor in ((None, None), (SPACING, None), (None, 1e-6)):
        with pytest.raises(ValueError, match="gives no unit; give --spacing and --height-unit"):
            read_scan(tmp_path / "bare.nc", spacing, factor)
    with pytest.raises(ValueError, match="gives its own unit"):
        read_scan(tmp_path / "um.nc", None, 1e-6)


@pytest.mark.parametrize("length", [4.84 * SPACING, 2 * SPACING, 3.5 * SPACING])
def test_a_sampling_length_is_whole_spacings_and_at_least_three(length):
    with pytest.raises(ValueError, match=r"spacings: it must be a whole number of at least 3"):
        from_surface(scan(1, rows=8, columns=8), SPACING, length)


@pytest.mark.parametrize(
    ("z", "words"),
    [
        (np.zeros((100, 100)), "flat"),
        (np.full((100, 100), np.nan), "not finite"),
        (np.zeros((10, 100)), "shorten"),
        (np.add.outer(np.arange(100.0), np.arange(100.0) ** 2), "summits"),
    ],
)
def test_bad_scans_are_named(z, words):
    with pytest.raises(ValueError, match=words):
        from_surface(z, SPACING)
