"""Scans of synthetic surfaces with known asperities, and files of scans."""

import numpy as np
import pytest
from scipy import ndimage
from scipy.integrate import trapezoid

import jointlaw as jl
from jointlaw.surface.faces import MIRRORS, join_faces
from jointlaw.surface.roughness import measured_slopes, rms_slope
from jointlaw.surface.scan_files import read_scan

SPACING = 20e-6  # m
ORIENTATION = jl.Orientation(3.0, 0.5, 0.1)
HEIGHTS = jl.GammaHeights(4.0, 1e-5)


def synthetic_surface(orientation, heights, n=24, spacing=20e-6, noise=0.3e-6, seed=0, samples=20):
    """Heights (n samples, n samples) in m of a surface drawn from the densities of a law.

    Every square of `samples` x `samples` points has one asperity at a random position near its
    centre, with a summit depth from `heights`. In each of its four quadrants one plane facet
    descends from it, with an inclination and azimuth from `orientation`. noise: standard deviation
    of a height in m.
    """
    rng = np.random.default_rng(seed)
    z = np.empty((n, samples, n, samples))
    depth = rng.gamma(heights.alpha + 1, heights.beta, (n, n))
    axis = np.arange(samples) - samples // 2
    for i, j in np.ndindex(n, n):
        offset = rng.integers(-1, 2, 2)
        y, x = np.meshgrid(axis - offset[0], axis - offset[1], indexing="ij")
        theta, phi = draw_directions(orientation, 4, rng)
        quadrant = (x < 0).astype(int) + 2 * (y < 0)
        # the azimuth in the first quadrant that has the same cos 2 phi
        folded = np.arctan2(np.abs(np.sin(phi)), np.abs(np.cos(phi)))
        slope = np.tan(theta)[quadrant]
        azimuth = folded[quadrant]
        fall = slope * (np.abs(x) * np.cos(azimuth) + np.abs(y) * np.sin(azimuth))
        z[i, :, j, :] = -depth[i, j] - spacing * fall
    z = z.reshape(n * samples, n * samples)
    return z + noise * rng.standard_normal(z.shape)


def draw_directions(orientation, n, rng):
    """Inclinations and azimuths (n,) in rad drawn from Eq. 14, by rejection in u = cos(a theta)."""
    b = orientation.b
    c = orientation.c
    u = rng.uniform(size=60 * n)
    phi = rng.uniform(0, 2 * np.pi, 60 * n)
    density = 1 + b / 2 * (3 * u**2 - 1) + 3 * c * (1 - u**2) * np.cos(2 * phi)
    max_density = 1 + max(b, -b / 2) + 3 * abs(c)
    accepted = np.flatnonzero(rng.uniform(size=60 * n) * max_density < density)[:n]
    return np.arccos(u[accepted]) / orientation.a, phi[accepted]


@pytest.fixture(scope="module")
def surface():
    return synthetic_surface(ORIENTATION, HEIGHTS)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("orientation", "heights"),
    [
        (ORIENTATION, HEIGHTS),
        (jl.Orientation(6.0, 0.0, 0.0), jl.GammaHeights(6.0, 2e-5)),
        (jl.Orientation(2.0, -0.5, -0.2), jl.GammaHeights(2.0, 3e-5)),
    ],
)
def test_intervals_contain_the_true_parameters(orientation, heights):
    """0.3 um of noise: the 95 % intervals contain the true value in 45 to 50 of 50 scans.

    That any of five parameters of three surfaces has more misses has a probability of 3 %.
    """
    truth = {
        "a": orientation.a, "b": orientation.b, "c": orientation.c,
        "alpha": heights.alpha, "beta": heights.beta,
    }  # fmt: skip
    hits = dict.fromkeys(truth, 0)
    for seed in range(50, 100):
        fit = jl.from_surface(synthetic_surface(orientation, heights, seed=seed), SPACING)
        for name, value in truth.items():
            one = fit.estimates[name]
            hits[name] += one.low <= value <= one.high
    assert all(count >= 45 for count in hits.values()), hits
    assert not set(truth) & set(fit.not_identifiable)


def test_law_of_a_scan(surface):
    """The true parameters are within three standard errors, and a law can be made."""
    fit = jl.from_surface(surface, SPACING)
    truth = {"a": 3.0, "b": 0.5, "c": 0.1, "alpha": 4.0, "beta": 1e-5}
    for name, value in truth.items():
        one = fit.estimates[name]
        assert abs(one.value - value) < 3 * one.standard_error, name
        assert not one.not_identifiable
    # noise adds a few to the 24 x 24; none is in the rim, which is not part of the area: 5 % more
    assert fit.asperities.depth.size == pytest.approx(576, rel=0.01)
    assert fit.parameters["asperity_density"] == pytest.approx(1 / (20 * SPACING) ** 2, rel=0.07)
    law = fit.law(jl.Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.6))
    # with the overlap the highest summit touches at zero closure: about one contact
    assert law.contacts(0.0) / law.asperity_density * fit.asperities.depth.size < 10


def test_summit_depths_are_measured_from_the_mean_plane(surface):
    """The mean plane by least squares."""
    asperities = jl.from_surface(surface, SPACING).asperities
    basis = np.stack([np.ones(surface.size), *np.indices(surface.shape).reshape(2, -1)], axis=1)
    plane = basis @ np.linalg.lstsq(basis, surface.ravel(), rcond=None)[0]
    height = (surface - plane.reshape(surface.shape))[tuple(asperities.grid_indices.T)]
    np.testing.assert_allclose(asperities.depth, height.max() - height, atol=1e-12)


def test_transposed_scan_has_transposed_anisotropy(surface):
    along, across = (jl.from_surface(z, SPACING).parameters["c"] for z in (surface, surface.T))
    assert along == pytest.approx(
        -across, abs=1e-3
    )  # duplicate facets are left out in another order
    assert along > 0.05


@pytest.mark.parametrize("factor", [1e3, 1e6])
def test_wrong_height_unit_makes_directions_not_identifiable(factor):
    """Heights in mm or um read as m: all facets are nearly vertical."""
    fit = jl.from_surface(factor * synthetic_surface(ORIENTATION, HEIGHTS, n=8), SPACING)
    assert {"a", "b"} <= set(fit.not_identifiable)


def self_affine_surface(stretch, seed=0, n=256):
    """A self-affine surface (Hurst exponent 0.8), `stretch` times as long along the rows."""
    k = np.hypot(stretch * np.fft.fftfreq(n)[None, :], np.fft.fftfreq(n)[:, None])
    k[0, 0] = 1.0
    noise = np.random.default_rng(seed).standard_normal((n, n))
    z = np.fft.ifft2(np.fft.fft2(noise) * k**-1.8).real
    return 1e-4 * z / z.std()


def test_orientation_with_other_slopes_is_not_representative():
    """Eq. 18 limits the ratio of the slopes along both axes to about 2."""
    isotropic = jl.from_surface(self_affine_surface(1.0), SPACING)
    assert isotropic.orientation_is_representative
    assert isotropic.slopes == pytest.approx(isotropic.law_slopes, rel=0.2)
    stretched = jl.from_surface(self_affine_surface(3.0), SPACING)
    assert not stretched.orientation_is_representative
    assert stretched.slopes[0] < 0.5 * stretched.law_slopes[0]
    assert f"| measured | {stretched.slopes[0]:.3g} |" in stretched.report()


def test_rms_slopes_of_a_wave_and_of_eq_14():
    """A wave of 100 points has pi sqrt(2) height/length; Eq. 14 against randomly drawn facets."""
    x = np.arange(400)
    wave = np.tile(1e-4 * np.sin(2 * np.pi * x / 100), (40, 1))
    along, across = measured_slopes(wave, SPACING, 4)
    assert along == pytest.approx(np.pi * np.sqrt(2) * 1e-4 / (100 * SPACING), rel=5e-3)
    assert across == pytest.approx(0.0, abs=1e-12)
    theta, phi = draw_directions(ORIENTATION, 100_000, np.random.default_rng(0))
    sample_slope = np.sqrt(np.mean((np.tan(theta) * np.cos(phi)) ** 2))
    assert rms_slope(ORIENTATION) == pytest.approx(sample_slope, rel=0.01)


def test_spikes_are_counted_and_cliffs_are_not(surface):
    assert not len(jl.from_surface(surface, SPACING).spikes)
    z = self_affine_surface(1.0)
    spikes = np.random.default_rng(1).integers(1, 255, (30, 2))
    z[tuple(spikes.T)] += 2e-4
    fit = jl.from_surface(z, SPACING)
    assert {tuple(one) for one in fit.spikes} == {tuple(one) for one in spikes}
    assert "Warning: 30 points are spikes" in fit.report()


def faces_of_a_joint(mirror, shift=(3.3, -5.6), rotation=0.004):
    """Lower and upper face (160, 160) in m of a joint, and its composite surface.

    The upper face is measured in a frame of its own, turned over.

    shift: of this frame in points. rotation: of this frame in rad.
    """
    rng = np.random.default_rng(3)

    def smooth(points):
        z = ndimage.gaussian_filter(rng.standard_normal((160, 160)), points, mode="wrap")
        return z / np.std(z)

    lower = 2e-4 * smooth(8)
    composite = 1e-5 * smooth(2.5)
    y, x = np.mgrid[:160, :160] - 79.5
    cosine, sine = np.cos(rotation), np.sin(rotation)
    where = [
        cosine * y - sine * x + 79.5 + shift[0],
        cosine * x + sine * y + 79.5 + shift[1],
    ]
    upper = ndimage.map_coordinates(composite - lower, where, order=3, mode="grid-wrap")
    return lower, np.flip(upper, MIRRORS[mirror]), composite


@pytest.mark.parametrize("mirror", MIRRORS)
def test_two_faces_give_the_composite_surface(mirror):
    """Turned over, shifted by fractions of a point and rotated: heights of 10 um from 200 um."""
    lower, upper, composite = faces_of_a_joint(mirror)
    joined = join_faces(lower, upper, SPACING)
    assert joined.mirror == mirror
    # 0.1 points: the composite surface itself is correlated with the slopes of the faces
    np.testing.assert_allclose(joined.shift, SPACING * np.array([3.3, -5.6]), atol=0.1 * SPACING)
    assert joined.rotation == pytest.approx(0.004, abs=1e-3)
    rows, columns = joined.z.shape
    # the common area, without a rim that rotation may turn out of a face
    assert min(rows, columns) > 140
    offsets = [
        composite[i : i + rows, j : j + columns]
        for i in range(161 - rows)
        for j in range(161 - columns)
    ]
    correlation = max(np.corrcoef(joined.z.ravel(), one.ravel())[0, 1] for one in offsets)
    assert correlation > 0.97
    assert np.std(joined.z) == pytest.approx(np.std(composite), rel=0.1)
    fixed = join_faces(lower, upper, SPACING, mirror)
    np.testing.assert_array_equal(fixed.z, joined.z)


def test_faces_of_other_joints_are_refused():
    lower, upper, _ = faces_of_a_joint("rows")
    with pytest.raises(ValueError, match=r"correlation with the lower face is .*change the sign"):
        join_faces(lower, -upper, SPACING)
    with pytest.raises(ValueError, match=r"mirror.*'up'"):
        join_faces(lower, upper, SPACING, "up")
    upper[3, 4] = np.nan
    with pytest.raises(ValueError, match="upper"):
        join_faces(lower, upper, SPACING)


def test_picture_of_a_scan(surface, tmp_path):
    fit = jl.from_surface(surface, SPACING)
    path = tmp_path / "scan.png"
    hillshade, inclinations, depths, _ = sorted(
        fit.plot(path).axes, key=lambda axis: axis.get_position().x0 + 2 * (axis.get_label() != "")
    )
    summits = next(line for line in hillshade.lines if "summits" in line.get_label())
    rows, columns = fit.asperities.grid_indices.T
    np.testing.assert_allclose(summits.get_xdata(), 1e3 * SPACING * (columns + 0.5))
    np.testing.assert_allclose(summits.get_ydata(), 1e3 * SPACING * (rows + 0.5))
    assert f"{rows.size} summits" in summits.get_label()
    lines = {line.get_label(): line.get_xydata() for line in inclinations.lines}
    _, inclination = lines["facets"].T
    assert 0 < inclination.min() < inclination.max() < 1.2 * 90 / fit.orientation.a
    azimuth, measured = lines["rms slope of the facets"].T
    # along the rows and across them; the facets of the summits are a part of the surface, which
    # has steps between its squares too
    for angle, slope in zip((0.0, np.pi / 2), fit.slopes, strict=True):
        result = np.tan(np.radians(np.interp(angle, azimuth, measured)))
        assert result == pytest.approx(slope, rel=0.25)
    _, law = lines["rms slope of the law"].T
    assert law[0] == pytest.approx(np.degrees(np.arctan(rms_slope(fit.orientation))))
    (density,) = depths.lines
    x, y = density.get_xydata().T
    assert 0.9 < trapezoid(y, x) <= 1.0
    assert path.read_bytes().startswith(b"\x89PNG")


def text_files(z):
    """A scan (ny, nx) with a spacing of 20 as text in each supported format."""
    matrix = "\n".join(" ".join(map(str, row)) for row in z)
    points = [f"{20 * x} {20 * y} {z[y, x]}" for y, x in np.ndindex(z.shape)][::-1]
    return {
        "commas.csv": "# um\n" + matrix.replace(" ", ","),
        "names.txt": "a b c d\n" + matrix,
        "decimal_commas.csv": matrix.replace(" ", ";").replace(".", ","),
        "grid.asc": f"ncols 4\nnrows 3\ncellsize 20\nNODATA_value -9999\n{matrix}",
        "pixels.asc": f"ncols 4\nnrows 3\ndx 20\ndy 20\n{matrix}",
        "points.xyz": "x y z\n" + "\n".join(points),
    }


def test_every_format_gives_the_same_array(tmp_path):
    z = np.arange(12.0).reshape(3, 4) / 8
    np.save(tmp_path / "z.npy", z)
    for name, text in text_files(z).items():
        (tmp_path / name).write_text(text)
    for name in ("z.npy", *text_files(z)):
        np.testing.assert_array_equal(read_scan(tmp_path / name, 1e-6, SPACING), 1e-6 * z)
    (tmp_path / "grid.asc").write_text(text_files(z)["grid.asc"].replace("1.375", "-9999"))
    assert np.isnan(read_scan(tmp_path / "grid.asc", 1e-6, SPACING)[2, 3])


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        (
            "t.csv",
            "1,201;2,305\n1,202;2,306\n",
            "is no matrix .*'1,201' may have .*--decimal comma",
        ),
        ("nothing.npy", None, "is no matrix of heights"),
        ("z.csv", "1.5;x\n", "is no matrix of heights"),
        (
            "z.asc",
            "cellsize 0.02\n1.5 2\n",
            "its cellsize 0.02 is 2e-08 m .*but --spacing is 2e-05",
        ),
        ("z.asc", "ncols 2\nnrows 3\n1 2\n3 4\n", "it has 2 rows, its header says 3: .* not whole"),
        ("z.asc", "ncols 3\nnrows 2\n1 2\n3 4\n", "it has 2 cols, its header says 3: .* not whole"),
        ("z.asc", "dx 20\ndy 40\n1.5 2\n", "its points are no square grid: dx 20, dy 40"),
        ("z.asc", "dx 40\ndy 40\n1.5 2\n", "its cellsize 40 is 4e-05 m .*--spacing is 2e-05"),
        ("z.asc", "dx 20.1\ndy 20.1\n1.5 2\n", "its cellsize 20.1 is 2.01e-05 m"),
        ("n.csv", "1,5,6,5\n2,6,5,6\n3,5,6,5\n4,7,6,6\n", "its first column counts"),
        ("p.csv", "0,.02,.04,.06,.08\n5,5,6,5,8\n2,6,5,6,7\n3,9,6,4,5\n", "its first row counts"),
        (
            "h.xyz",
            "\n".join(f"{20 * x} {40 * y} {x * y}" for x in range(4) for y in range(4)),
            "no square grid .* the points are 20 apart along x and 40 along y",
        ),
        (
            "z.xyz",
            "0 0 1\n20 0 1\n0 20 1\n17 20 1\n",
            "no square grid .*scipy.interpolate.griddata",
        ),
    ],
)
def test_unreadable_files_are_refused(name, text, message, tmp_path):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=message):
        read_scan(tmp_path / name, 1e-6, SPACING)


@pytest.mark.parametrize("sentinel", [-9999.0, -99.0, 0.0, 32767.0])
def test_sentinel_for_missing_heights_is_named(sentinel, tmp_path):
    """In 25 patches. Without them the scan is read, also if the heights are rounded or clipped."""
    z = np.round(1e6 * self_affine_surface(1.0), 2)
    patches = np.random.default_rng(2).integers(1, 250, (25, 2))
    for valid in (z, np.round(z / 20), np.clip(z, -150, 100)):
        np.save(tmp_path / "z.npy", valid)
        assert read_scan(tmp_path / "z.npy", 1e-6, SPACING).shape == z.shape
    for i, j in patches:
        z[i : i + 3, j : j + 2] = sentinel
    np.save(tmp_path / "z.npy", z)
    with pytest.raises(ValueError, match=f"{sentinel:g} occurs 15[0-9] times, far above or below"):
        read_scan(tmp_path / "z.npy", 1e-6, SPACING)


@pytest.mark.parametrize(
    ("z", "length", "message"),
    [
        (np.zeros((100, 100)), None, "not flat"),
        (np.arange(100.0), None, "a profile has one direction only"),
        (
            np.where(np.eye(100) * np.arange(100) > 97, np.nan, np.eye(100)),
            None,
            r"not finite at 2 of its points, the first at \[98, 98\]",
        ),
        (
            np.tile(np.abs(np.arange(100) % 20 - 10.0), (100, 1)),
            None,
            "z has ridges: .* is 4.56e.* along the rows and \\S+ across them",
        ),
        (np.ones((10, 100)), None, "at least 24 points along both axes"),
        (np.add.outer(np.arange(100.0) ** 2, np.arange(100.0) ** 2), None, "summits"),
        (np.eye(100), 3.5 * SPACING, "spacings: it must be a whole number of at least 3"),
    ],
)
def test_invalid_scans_are_refused(z, length, message):
    with pytest.raises(ValueError, match=message):
        jl.from_surface(z, SPACING, length)
