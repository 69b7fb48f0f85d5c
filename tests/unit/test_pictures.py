"""Pictures say what they show: their lines, arrows, colours and texts against values computed here.

Every kind of picture that a command makes is drawn from numbers that are known in advance, and read
back from its artists. Factors of units are those of the texts on the axes, parsed here.
"""

import re

import numpy as np
import pytest
from kinds import FITTED
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import rgb_to_hsv, same_color, to_rgba
from matplotlib.quiver import Quiver
from PIL import Image
from scene_text import block, coulomb, lines
from scipy.ndimage import gaussian_filter

import dem_demo.output.pictures as block_pictures
import jointlaw as jl
from dem_demo.dynamics.simulation import Simulation
from dem_demo.output.pictures import BOLT_COLOURS, JOINT_STATES, Pictures, curves
from dem_demo.output.record import RunRecord
from dem_demo.output.run import advance
from dem_demo.scene.read import parse
from jointlaw.calibration.aperture import FORMS, FlowTest, fit_flow, fit_form
from jointlaw.calibration.fit import fit_curves
from jointlaw.calibration.measured import ClosureCurve, ShearCurve
from jointlaw.laboratory import record as laboratory_record
from jointlaw.laboratory.record import TestRecord

PREFIXES = {"n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}
UNITS = {
    f"{prefix}{unit}": factor for prefix, factor in PREFIXES.items() for unit in ("Pa", "J/m²")
}
UNITS |= {f"{prefix}m": factor for prefix, factor in PREFIXES.items() if prefix != "G"}
UNITS |= {"°": 1.0, "%": 0.01}


def unit_factor(label):
    """SI value of the unit in brackets at the end of a label."""
    return UNITS[re.search(r"\(([^()]+)\)$", label)[1]]


def line_of(axis, label):
    """Points (n, 2) in SI units of the line with this label; "" for the only line of an axis."""
    result = [line for line in axis.lines if label in ("", line.get_label())]
    assert len(result) == 1, (label, [line.get_label() for line in axis.lines])
    x_label = axis.get_xlabel() or axis.figure.get_supxlabel()
    factors = unit_factor(x_label), unit_factor(axis.get_ylabel())
    return result[0].get_xydata() * factors


def assert_line(axis, label, x, y):
    points = line_of(axis, label)
    np.testing.assert_allclose(points[:, 0], x, rtol=1e-9, atol=1e-18, err_msg=f"{label}: x")
    np.testing.assert_allclose(points[:, 1], y, rtol=1e-9, atol=1e-18, err_msg=f"{label}: y")


# ------------------------------------------------------------------------------- laboratory tests


@pytest.mark.parametrize("prefix", PREFIXES)
def test_prefixes_of_the_axes_of_laboratory_tests(prefix):
    """Each prefix is for values from 1 to 1000; the largest value chooses it."""
    for number in (1.001, 2.5, 999.0):
        values = np.array([0.1, -1.0, 0.5]) * number * PREFIXES[prefix]
        scaled, unit = laboratory_record._scale_to_prefix(values, "Pa")
        assert unit == f"{prefix}Pa"
        np.testing.assert_allclose(scaled * UNITS[unit], values)


SHEAR_RECORD = {
    "closure": np.array([10e-6, 11e-6, 9e-6, 5e-6]),
    "shear_2": np.array([0.0, 1e-4, 2e-4, 6e-4]),
    "shear_3": np.zeros(4),
    "F1": np.array([2e6, 2.1e6, 2.2e6, 2.4e6]),
    "F2": np.array([0.0, 1.0e6, 1.9e6, 1.6e6]),
    "F3": np.zeros(4),
    "sliding": np.array([0.0, 0.3, 0.8, 0.7]),
    "separated": np.array([0.0, 0.05, 0.1, 0.25]),
    "stored": np.array([10.0, 40.0, 70.0, 60.0]),
    "dissipated": np.array([0.0, 5.0, 20.0, 300.0]),
}


def test_picture_of_a_shear_test():
    record = TestRecord(SHEAR_RECORD, 0.0, "shear")
    figure = record.plot()
    stress, friction, dilation, fractions = figure.axes
    x = SHEAR_RECORD["shear_2"]
    angles = np.degrees(np.arctan2(SHEAR_RECORD["F2"], SHEAR_RECORD["F1"]))
    assert_line(stress, "shear stress", x, SHEAR_RECORD["F2"])
    assert_line(stress, "normal stress", x, SHEAR_RECORD["F1"])
    assert_line(friction, "", x, angles)
    assert_line(dilation, "", x, 10e-6 - SHEAR_RECORD["closure"])
    for name in ("sliding", "separated"):
        assert_line(fractions, name, x, SHEAR_RECORD[name])
    assert figure.get_supxlabel() == "shear displacement (µm)"
    assert [axis.get_ylabel() for axis in figure.axes] == [
        "stress (MPa)",
        "mobilised friction angle (°)",
        "dilation (µm)",
        "fraction of facets (%)",
    ]
    assert figure.get_suptitle().endswith(f"largest friction angle {angles.max():.1f}°")


def test_pictures_have_300_dots_per_inch(full_resolution, tmp_path):
    """The file has as many pixels and says so; the picture is 7.5 inches wide or less."""
    assert full_resolution == 300
    jl.closure_test(jl.presets.load("linear-a3").joint(), 1e6, steps=3).plot(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.info["dpi"] == pytest.approx((300, 300), rel=1e-3)
        assert 5 * 300 < picture.width <= 7.5 * 300


def test_picture_of_a_closure_test():
    columns = SHEAR_RECORD | {"shear_2": np.zeros(4), "F2": np.zeros(4)}
    figure = TestRecord(columns, 0.0, "closure").plot()
    stress, energy = figure.axes
    assert_line(stress, "", columns["closure"], columns["F1"])
    for name in ("stored", "dissipated"):
        assert_line(energy, name, columns["closure"], columns[name])
    assert figure.get_supxlabel() == "closure (µm)"
    assert [axis.get_ylabel() for axis in figure.axes] == ["normal stress (MPa)", "energy (J/m²)"]


# ------------------------------------------------------------------------------------------- fits


@pytest.fixture(scope="module")
def fit():
    """A fit of one parameter to points that no other code has computed, and two more tests."""
    stress = np.array([0.0, 0.5e6, 1e6, 2e6, 3e6, 4e6])
    closure = 60e-6 * stress / (stress + 2e6)
    tests = [
        ShearCurve(
            np.array([0.0, 0.2e-3, 0.5e-3, 1e-3, 2e-3]),
            normal * np.array([0.0, 0.5, 0.8, 0.9, 0.85]),
            normal,
            opening=np.array([0.0, 0.0, 0.02e-3, 0.08e-3, 0.2e-3]),
            name=f"{normal / 1e6:g} MPa",
        )
        for normal in (1e6, 3e6)
    ]
    result = fit_curves(
        [ClosureCurve(stress, closure), tests[0]], free=["asperity_density"], law=FITTED
    )
    return result, stress, closure, tests


def filled_between(axis):
    """Vertices of all bands of an axis, as (n, 2) arrays."""
    bands = [one for one in axis.collections if isinstance(one, PolyCollection)]
    return [path.vertices for one in bands for path in one.get_paths()]


def test_picture_of_a_fit(fit):
    result, stress, closure, (fitted, predicted) = fit
    held_out = np.array([6e6]), np.array([50e-6])
    figure = result.plot(held_out=held_out, predicted=[predicted])
    closing, shearing, opening, *residuals = figure.axes
    for axis, lower in zip(figure.axes, residuals, strict=False):
        assert not axis.get_xlabel()  # the displacements are below the residuals
        axis.set_xlabel(lower.get_xlabel())
    (own, others) = (line for line in residuals[1].lines if line.get_marker() == "o")
    for drawn, test in zip((own, others), (fitted, predicted), strict=True):
        law_stress = result.predict_shear(test)[0]
        difference = law_stress.stress[law_stress.points] - test.shear_stress
        percent = 100 * difference / test.shear_stress.max()
        is_compared = np.array([False, True, True, False, True])  # the peak at any displacement
        np.testing.assert_allclose(drawn.get_xdata(), 1e3 * test.shear)
        np.testing.assert_allclose(drawn.get_ydata()[is_compared], percent[is_compared])
    assert [axis.get_ylabel() for axis in figure.axes] == [
        "normal stress (MPa)", "shear stress (MPa)", "opening (mm)", *["residual (%)"] * 3
    ]  # fmt: skip
    assert [axis.get_xlabel() for axis in residuals] == [
        "closure since the start of the test (µm)", *["shear displacement (mm)"] * 2
    ]  # fmt: skip
    (of_closure, of_held_out) = (line for line in residuals[0].lines if line.get_marker() == "o")
    for drawn, at, measured in (
        (of_closure, closure[1:], stress[1:]),
        (of_held_out, *held_out[::-1]),
    ):
        np.testing.assert_allclose(drawn.get_xdata(), 1e6 * at)
        percent = 100 * np.log(result.predict(at) / measured)  # as the fit compares
        np.testing.assert_allclose(drawn.get_ydata(), percent, atol=1e-6)
    for drawn, test in zip(
        (line for line in residuals[2].lines if line.get_marker() == "o"),
        (fitted, predicted),
        strict=True,
    ):
        law_opening = result.predict_shear(test)[0]
        difference = law_opening.opening[law_opening.points] - test.opening
        np.testing.assert_allclose(drawn.get_xdata(), 1e3 * test.shear)
        percent = 100 * difference / np.abs(test.opening).max()
        compared = np.isfinite(drawn.get_ydata())
        np.testing.assert_allclose(drawn.get_ydata()[compared], percent[compared], atol=1e-6)
    assert_line(closing, "measured", closure[1:], stress[1:])  # zero stress is not fitted
    assert_line(closing, "measured, not fitted", held_out[1], held_out[0])
    law = line_of(closing, "law")
    np.testing.assert_allclose(law[:, 1], result.predict(law[:, 0]), rtol=1e-6)
    assert law[:, 0].max() == pytest.approx(held_out[1][0])
    # the band contains the curve of the law, and has its ends at the ends of the curve
    (band,) = filled_between(closing)
    assert band[:, 0].min() * 1e-6 == pytest.approx(law[:, 0].min(), abs=1e-12)
    middle = law[50]
    inside = band[np.isclose(band[:, 0] * 1e-6, middle[0])][:, 1] * 1e6
    assert inside.min() < middle[1] < inside.max()
    for x in law[10::30, 0]:
        edges = band[np.isclose(band[:, 0], 1e6 * x, rtol=1e-12)][:, 1]
        limits = np.concatenate(result.band(np.array([x])))
        np.testing.assert_allclose([edges.min(), edges.max()], 1e-6 * limits, rtol=1e-9)
    for axis, name, sense in ((shearing, "shear_stress", 1), (opening, "opening", 1)):
        factor = unit_factor(axis.get_ylabel())
        points = [line for line in axis.lines if line.get_marker() == "o" and len(line.get_xdata())]
        assert len(points) == 2
        for drawn, test, face in zip(points, (fitted, predicted), (None, "w"), strict=True):
            x, y = drawn.get_data()
            np.testing.assert_allclose(1e-3 * x, test.shear)
            np.testing.assert_allclose(sense * factor * y, getattr(test, name))
            is_open = same_color(drawn.get_markerfacecolor(), "w")
            assert is_open == (face == "w")
        assert axis.get_xlabel() == "shear displacement (mm)"
        bands = filled_between(axis)
        curves = [line for line in axis.lines if line.get_linestyle() == "-"]
        assert len(bands) == len(curves) == 2
        for band, curve in zip(bands, curves, strict=True):  # each band is about its curve
            x, y = curve.get_data()
            assert [band[:, 0].min(), band[:, 0].max()] == pytest.approx([x.min(), x.max()])
            factor = unit_factor(axis.get_ylabel())
            test = (fitted, predicted)[curves.index(curve)]
            low, high = result.shear_band(test)[0 if name == "shear_stress" else 1]
            assert len(low) == len(x)
            for i in range(0, len(x), max(len(x) // 7, 1)):
                at = band[np.isclose(band[:, 0], x[i], rtol=1e-12)][:, 1]
                assert at.min() - 1e-9 <= y[i] <= at.max() + 1e-9
                assert factor * at.min() <= low[i] + 1e-9 * abs(low[i])
                assert factor * at.max() >= high[i] - 1e-9 * abs(high[i])
    # the law's own curve: a joint of the fitted law, sheared as the test was
    own = result.law.joint()
    jl.direct_shear(own, 0.0, normal=1e6, steps=40)
    record = jl.direct_shear(own, 2e-3, normal=1e6, steps=400)
    drawn = next(line for line in shearing.lines if line.get_linestyle() == "-")
    x, y = drawn.get_data()
    expected = np.interp(1e-3 * x, record.shear - record.shear[0], record.shear_stress)
    np.testing.assert_allclose(1e6 * y, expected, atol=0.02 * expected.max())
    drawn = next(line for line in opening.lines if line.get_linestyle() == "-")
    x, y = drawn.get_data()
    dilation = record.closure[0] - record.closure
    expected = np.interp(1e-3 * x, record.shear - record.shear[0], dilation)
    np.testing.assert_allclose(1e-3 * y, expected, atol=0.02 * np.abs(dilation).max())
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["1 MPa", "3 MPa, predicted"]


def test_picture_of_a_flow_test():
    law = jl.JointLaw(
        orientation=jl.Orientation(4.0),
        asperity=FITTED.asperity,
        heights=jl.GammaHeights(3.0, 20e-6, formation="individual"),
        asperity_density=1e6,
    )
    stress = np.array([0.5e6, 1e6, 2e6, 4e6, 8e6, 4e6, 1e6])
    aperture = np.array([40e-6, 34e-6, 28e-6, 22e-6, 17e-6, 19e-6, 27e-6])
    flow = fit_flow(FlowTest(stress, aperture, None, "flow.csv"), law, up_to=4e6)
    figure = flow.plot()
    over_stress, over_closure = figure.axes
    for axis in figure.axes:
        points = np.concatenate(
            [line.get_xydata() for line in axis.lines if line.get_marker() == "o"]
        )
        measured = {round(y, 6) for _, y in points}
        assert measured == {round(y, 6) for y in 1e6 * aperture}
        filled = [
            line for line in axis.lines
            if line.get_marker() == "o" and not same_color(line.get_markerfacecolor(), "w")
            and len(line.get_xdata()) > 1
        ]  # fmt: skip
        assert sorted(np.concatenate([line.get_ydata() for line in filled])) == pytest.approx(
            sorted(1e6 * aperture[:4])  # loading, up to 4 MPa
        )
    drawn = {(round(x, 6), round(y, 6)) for line in over_stress.lines
             if line.get_marker() == "o" for x, y in line.get_xydata()}  # fmt: skip
    assert drawn == set(zip(1e-6 * stress, 1e6 * aperture, strict=True))
    assert over_stress.get_xlabel() == "normal stress (MPa)"
    assert over_stress.get_ylabel() == "hydraulic aperture (µm)"
    assert over_closure.get_xlabel() == "closure of the law (µm)"
    closure = np.array([law.closure(one) for one in stress])  # on loading
    curve_of = {line.get_label(): line.get_xydata() for line in over_stress.lines}
    for name, curve in flow.curves.items():
        expected = np.column_stack([1e-6 * stress[:5], 1e6 * curve[:5]])
        drawn = curve_of["map, loading" if name not in FORMS else name]
        np.testing.assert_allclose(drawn, expected, rtol=1e-9)
    fitted_map = next(iter(flow.curves.values()))
    unloading = np.column_stack([1e-6 * stress[5:], 1e6 * fitted_map[5:]])
    np.testing.assert_allclose(curve_of["map, unloading"], unloading, rtol=1e-9)
    by_closure = {line.get_label(): line.get_xydata() for line in over_closure.lines}
    loading = by_closure["map, loading"]
    np.testing.assert_allclose(loading[:, 0], 1e6 * closure[:5], rtol=1e-3)
    np.testing.assert_allclose(loading[:, 1], 1e6 * fitted_map[:5], rtol=1e-9)
    for name, form in FORMS.items():  # as the literature writes them
        (a, b) = fit_form(form, stress[:4], aperture[:4])
        expected = {
            "Bandis": lambda s, a=a, b=b: a / (1 + 9 * s / b),
            "semi-logarithm": lambda s, a=a, b=b: a - b * np.log(s),
            "power law": lambda s, a=a, b=b: a * (s / 1e6) ** -b,
        }[name]
        np.testing.assert_allclose(1e-6 * curve_of[name][:, 1], expected(stress[:5]), rtol=1e-6)
    labels = [text.get_text() for text in over_closure.get_legend().get_texts()]
    expected = {"map, loading", "map, unloading", "measured, fitted", "measured, predicted"}
    assert expected <= {*labels}


def test_picture_of_a_scan():
    """A random surface that is steeper along the rows: summits, slopes, law and depths."""
    spacing = 1e-4  # m
    noise = np.random.default_rng(0).normal(size=(60, 80))
    z = 1e-4 * gaussian_filter(noise, (4, 2))
    fit = jl.from_surface(z, spacing=spacing)
    surface, scale, directions, depths = fit.plot().axes
    shaded, heights = surface.images
    np.testing.assert_allclose(heights.get_array(), 1e6 * fit.heights_of_scan)
    for image in (shaded, heights):
        assert image.get_extent() == pytest.approx([0.0, 8.0, 0.0, 6.0])  # mm
        assert image.origin == "lower"
    (summits,) = surface.lines
    row, column = fit.asperities.grid_indices.T
    places = np.column_stack([0.1 * (column + 0.5), 0.1 * (row + 0.5)])
    np.testing.assert_allclose(summits.get_xydata(), places)
    assert summits.get_label() == f"{len(places)} summits"
    texts = surface.get_xlabel(), surface.get_ylabel(), scale.get_ylabel()
    assert texts == ("along the rows (mm)", "along the columns (mm)", "height (µm)")
    lines = {line.get_label(): line.get_xydata() for line in directions.lines}
    facets = lines["facets"]
    slope = np.tan(np.radians(facets[:, 1]))
    along_columns, along_rows = fit.asperities.slope.T
    np.testing.assert_allclose(slope * np.cos(facets[:, 0]), along_rows, atol=1e-12)
    np.testing.assert_allclose(slope * np.sin(facets[:, 0]), along_columns, atol=1e-12)
    measured = lines["rms slope of the facets"]
    rms = np.tan(np.radians(measured[[0, 18], 1]))
    np.testing.assert_allclose(measured[[0, 18], 0], [0.0, np.pi / 2])
    assert rms == pytest.approx(np.sqrt(np.mean([along_rows**2, along_columns**2], axis=1)))
    of_law = lines["rms slope of the law"]
    np.testing.assert_allclose(of_law[:, 0], measured[:, 0])
    # two lobes: as steep on the whole, and steepest and gentlest in the same directions
    assert of_law[:, 1].mean() == pytest.approx(measured[:, 1].mean(), rel=0.3)
    assert np.corrcoef(of_law[:, 1], measured[:, 1])[0, 1] > 0.9
    limit = 90 / fit.orientation.a
    np.testing.assert_allclose(lines[f"90°/a = {limit:.0f}°"], of_law * [1, 0] + [0, limit])
    assert directions.get_title() == "inclination (°) by direction from the rows"
    (density,) = depths.lines
    x, y = density.get_data()
    assert x.max() == pytest.approx(1e6 * fit.asperities.depth.max())
    assert (y >= 0).all()
    below_deepest = fit.heights.cdf(fit.heights.overlap + fit.asperities.depth.max())
    below_highest = fit.heights.cdf(fit.heights.overlap)
    area = np.sum(0.5 * (y[1:] + y[:-1]) * np.diff(x))
    assert area == pytest.approx(below_deepest - below_highest, abs=0.02)
    bars = depths.patches
    assert sum(bar.get_height() * bar.get_width() for bar in bars) == pytest.approx(1.0)
    middle = sum(bar.get_height() * bar.get_width() * (bar.get_x() + bar.get_width() / 2)
                 for bar in bars)  # fmt: skip
    assert middle == pytest.approx(1e6 * fit.asperities.depth.mean(), rel=0.1)
    texts = depths.get_xlabel(), depths.get_ylabel()
    assert texts == ("depth below the highest summit (µm)", "density (1/µm)")


# ----------------------------------------------------------------------------------------- blocks


SCENE = (
    lines(title="known motion", gravity=[0.0, -9.81])
    + "[laws.rock]\n"
    + coulomb(0.6, 1e9, 1e9)
    + block("base", box=[8.0, 1.0], at=[0.0, -0.5], fixed=True)
    + block("left", box=[1.0, 1.0], at=[-2.0, 0.5])
    + block("right", box=[1.0, 1.0], at=[2.0, 0.5])
    + "[monitor]\nshear = [['left', 'base']]\n"
    + "[run]\nend = 0.004\nrecord = 0.001\n"
)
STARTS = np.array([[-2.0, 0.5], [2.0, 0.5]])  # centroids of left and right as drawn, m
SETTLEMENT = np.array([0.0, 2600 * 9.81 / 1e9])  # m: weight over area, over normal stiffness
MOVES = np.array([[0.0, 0.0], [3e-3, -4e-3], [1e-3, 0.0]])  # of base, left and right, m
TURN = 0.1  # of left, rad


@pytest.fixture(scope="module")
def record():
    """A short run, whose last frame is replaced by known motions and states of the joints."""
    sim = Simulation(parse(SCENE, "known"))
    run = RunRecord(sim)
    advance(sim, run)
    motion = run.initial.copy()
    motion[:2] += MOVES.T
    motion[2, 1] += TURN
    run.motion[-1] = motion
    joints = {name: np.array(column) for name, column in run.joints[-1].items()}
    assert len(joints["ends"]) == 4  # two contact points under each block
    stress = run.joints[0]["normal_stress_Pa"].max()
    joints["normal_stress_Pa"] = np.array([1.0, 1.0, 0.5, 0.0]) * stress
    joints["slipping"] = np.array([0.0, 0.5, 0.95, 0.0])
    joints["separated"] = np.zeros(4)
    joints["slip_rate_m/s"] = np.array([0.0, 1.0, -1.0, 0.0])
    joints["ends"] = np.array([[[i, 0.0], [i + 0.5, 0.25]] for i in range(4)])
    run.joints[-1] = joints
    return run, stress


def captured(monkeypatch, draw):
    """The figure that a function writes to a file."""
    figures = []
    monkeypatch.setattr(block_pictures, "written", lambda figure, path: figures.append(figure))
    draw("unused.png")
    return figures[0]


def test_picture_of_blocks(record, monkeypatch):
    run, stress = record
    figure = captured(monkeypatch, Pictures(run, marked=np.array([False, True, False])).final)
    axes = next(axis for axis in figure.axes if axis.get_ylabel() == "y (m)")
    bar = next(axis for axis in figure.axes if axis is not axes)
    assert axes.get_xlabel() == "x (m)"
    assert bar.get_xlabel() == "displacement since the start (mm)"
    assert bar.get_xlim() == pytest.approx((0.0, 5.0))  # left moves by 5 mm

    # corners of the blocks at the end
    half = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    rotated = half @ np.array([[np.cos(TURN), np.sin(TURN)], [-np.sin(TURN), np.cos(TURN)]])
    expected = {
        "base": half * [8.0, 1.0] + [0.0, -0.5],
        "left": rotated + STARTS[0] - SETTLEMENT + MOVES[1],
        "right": half + STARTS[1] - SETTLEMENT + MOVES[2],
    }
    drawn = {}
    for polygons in (one for one in axes.collections if isinstance(one, PolyCollection)):
        if isinstance(polygons, Quiver):
            continue
        faces = polygons.get_facecolor()
        edges = np.resize(polygons.get_edgecolor(), (len(polygons.get_paths()), 4))
        for path, face, edge in zip(polygons.get_paths(), faces, edges, strict=True):
            corners = path.vertices[:4]
            name = min(expected, key=lambda key: np.abs(expected[key] - corners).max())
            np.testing.assert_allclose(corners, expected[name], atol=1e-9)
            drawn[name] = face, edge
    assert set(drawn) == set(expected)
    colour_map = bar._colorbar.cmap
    assert colour_map(0.2)[:3] > colour_map(1.0)[:3]  # the larger the darker
    np.testing.assert_allclose(drawn["right"][0], colour_map(0.2), atol=0.01)  # 1 of 5 mm
    np.testing.assert_allclose(drawn["left"][0], colour_map(1.0))
    np.testing.assert_allclose(drawn["base"][0], to_rgba(block_pictures.FIXED_COLOUR))
    assert same_color(drawn["left"][1], block_pictures.MARKED_COLOUR)  # marked
    assert not same_color(drawn["right"][1], block_pictures.MARKED_COLOUR)

    # arrows: from the present centroid, along the displacement, as long as the legend says
    (arrows,) = (one for one in axes.collections if isinstance(one, Quiver))
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    times = float(next(text for text in texts if "drawn ×" in text).rpartition("×")[2])
    np.testing.assert_allclose(arrows.XY, STARTS - SETTLEMENT + MOVES[1:])
    np.testing.assert_allclose(np.stack([arrows.U, arrows.V], 1), times * MOVES[1:], atol=1e-12)
    assert arrows.scale == 1.0
    assert arrows.angles == arrows.scale_units == "xy"

    # joints: colour by state, width by stress
    handles = dict(zip(texts, figure.legends[0].get_lines(), strict=True))
    segments = {}
    for group in (one for one in axes.collections if isinstance(one, LineCollection)):
        widths = np.resize(group.get_linewidth(), len(group.get_segments()))
        for segment, width in zip(group.get_segments(), widths, strict=True):
            segments[int(segment[0, 0])] = group.get_color()[0], width, segment
    for i, state in enumerate(("stuck", "partly sliding", "sliding", "open")):
        colour, _, segment = segments[i]
        assert same_color(colour, handles[f"joint {state}"].get_color()), state
        np.testing.assert_allclose(segment, [[i, 0.0], [i + 0.5, 0.25]])
    assert segments[0][1] == segments[1][1] > segments[2][1] > segments[3][1]
    (stress_text,) = (text for text in texts if "normal stress" in text)
    value, unit = re.search(r"stress ([\d.e+]+) (\w+)", stress_text).groups()
    assert float(value) * UNITS[unit] == pytest.approx(stress, rel=0.5)  # one digit of a quantile
    legend_width = handles[stress_text].get_linewidth()
    assert legend_width == pytest.approx(segments[0][1], rel=0.25)
    assert "unstable block" in texts
    title = figure.get_suptitle()
    assert title == "known motion"
    (note,) = (text.get_text() for text in axes.texts if text.get_gid() == "note")
    assert note.startswith(f"t = {run.times[-1]:.2f} s")


def test_joints_under_a_thousandth_of_the_stress_are_open(record, monkeypatch):
    """Of the stress that line widths are scaled by; all other joints rest, and are stuck."""
    run, _ = record
    pictures = Pictures(run)
    ratios = np.array([2e-3, 1.1e-3, 0.9e-3, 0.0])
    zeros = np.zeros(4)
    joints = {"slipping": zeros, "separated": zeros, "slip_rate_m/s": zeros}
    joints["normal_stress_Pa"] = ratios * pictures.stress
    monkeypatch.setattr(run, "joints", [joints])
    assert pictures.states(0).tolist() == ["stuck", "stuck", "open", "open"]


def hue_and_saturation(colour):
    """Hue in degrees and saturation of a colour."""
    hue, saturation, _ = rgb_to_hsv(to_rgba(colour)[:3])
    return 360 * hue, saturation


def test_colours_and_line_styles_of_the_legend():
    """As a reader expects them: stuck black, partly sliding yellow, sliding red, open blue."""
    colours = {state: hue_and_saturation(colour) for state, (colour, _) in JOINT_STATES.items()}
    assert colours["stuck"][1] < 0.1
    assert max(to_rgba(JOINT_STATES["stuck"][0])[:3]) < 0.3
    for state, low, high in (("partly sliding", 40, 60), ("sliding", -1, 15), ("open", 180, 220)):
        assert low < colours[state][0] < high, state
        assert colours[state][1] > 0.5
    styles = {state: style for state, (_, style) in JOINT_STATES.items()}
    assert styles == {"stuck": "-", "partly sliding": "-", "sliding": "-", "open": "--"}
    green, purple = (hue_and_saturation(colour)[0] for colour in BOLT_COLOURS.values())
    assert [*BOLT_COLOURS] == ["bolt", "bolt at its capacity"]
    assert 130 < green < 170
    assert 280 < purple < 320
    assert 200 < hue_and_saturation(block_pictures.WATER_COLOUR)[0] < 230


def test_handles_of_the_legend():
    """Lines of the legend have the colours and styles of what they name."""
    with_bolts = (
        SCENE
        + "[water]\ntable = [[-9.0, -0.2], [9.0, -0.2]]\n"
        + "[[bolt]]\n"
        + lines(**{"from": [2.0, 0.8], "to": [2.0, -0.8]}, stiffness=1e8, capacity=1e5)
    )
    sim = Simulation(parse(with_bolts, "known"))
    pictures = Pictures(RunRecord(sim), marked=np.array([False, True, False]))
    figure, axes = pictures.figure()
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    handles = dict(zip(texts, figure.legends[0].get_lines(), strict=True))
    for state, (colour, style) in JOINT_STATES.items():
        assert same_color(handles[f"joint {state}"].get_color(), colour)
        assert handles[f"joint {state}"].get_linestyle() == style
    assert same_color(handles["water table"].get_color(), block_pictures.WATER_COLOUR)
    assert handles["water table"].get_linestyle() == "-."
    for label, colour in BOLT_COLOURS.items():
        assert same_color(handles[label].get_color(), colour)
        assert handles[label].get_linewidth() == 2.5
    assert same_color(handles["unstable block"].get_color(), block_pictures.MARKED_COLOUR)
    pictures.draw(axes, 0)
    (water,) = axes.lines
    np.testing.assert_allclose(water.get_xydata(), [[-9.0, -0.2], [9.0, -0.2]])
    assert same_color(water.get_color(), block_pictures.WATER_COLOUR)
    names = {text.get_text(): text.get_position() for text in axes.texts}
    for name, place in (("base", (0.0, -0.5)), ("left", STARTS[0]), ("right", STARTS[1])):
        assert names[name] == pytest.approx(place, abs=1e-3)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x (m)", "y (m)")


def test_the_legend_has_an_arrow_of_displacements(record):
    run, _ = record
    figure, _ = Pictures(run).figure()
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    handles = dict(zip(texts, figure.legends[0].get_lines(), strict=True))
    (label,) = (text for text in texts if text.startswith("displacement, drawn ×"))
    assert handles[label].get_marker() == ">"
    assert same_color(handles[label].get_color(), "k")
    assert handles[label].get_linewidth() == 1.0


def test_picture_of_bolts(monkeypatch):
    """A bolt at its capacity and another one: ends, colours, and forces in kN at their middles."""
    text = (
        lines(gravity=[0.0, -9.81])
        + "[laws.rock]\n"
        + coulomb(0.6, 1e9, 1e9)
        + block("base", box=[8.0, 1.0], at=[0.0, -0.5], fixed=True)
        + block("slab", box=[4.0, 1.0], at=[0.0, 0.5])
    )
    for x, capacity in ((-1.0, 3e4), (1.0, 8e4)):
        text += "[[bolt]]\n" + lines(**{"from": [x, 0.8], "to": [x, -0.5]})
        text += lines(stiffness=1e8, capacity=capacity, pretension=2.5e4)
    sim = Simulation(parse(f"{text}[run]\nend = 0.01\nrecord = 0.01\n"))
    record = RunRecord(sim)
    tensions = np.array([3e4, -1.5e4])
    monkeypatch.setitem(record.bolts[0], "tension_N", tensions)
    pictures = Pictures(record)
    _, axes = pictures.figure()
    pictures.draw(axes, 0)
    drawn = {}
    for one in axes.collections:
        if isinstance(one, LineCollection) and one.get_zorder() == 4:
            for ends in one.get_segments():
                drawn[round(ends[0][0])] = ends, one.get_color()[0]
    names = {-1: "bolt at its capacity", 1: "bolt"}
    for x, (ends, colour) in drawn.items():
        np.testing.assert_allclose(ends, [[x, 0.8], [x, -0.5]], atol=1e-4)  # settlement
        assert same_color(colour, block_pictures.BOLT_COLOURS[names[x]])
    assert drawn.keys() == names.keys()
    texts = {text.get_text(): text.get_position() for text in axes.texts if "kN" in text.get_text()}
    for label, x in (("30 kN", -1.0), ("-15 kN", 1.0)):
        assert texts.pop(label) == pytest.approx((x, 0.15), abs=1e-4)
    assert not texts


def test_curves_of_a_sheared_joint(record, monkeypatch):
    run, _ = record
    readings = {
        "slip_m": [0.0, 1e-3, 2e-3],
        "closure_m": [5e-5, 4e-5, 1e-5],
        "normal_Pa": [2e4, 2.2e4, 2.5e4],
        "shear_Pa": [0.0, 1.1e4, 1.4e4],
    }
    keys = [f"left: {name}" for name in readings]
    known = [dict(zip(keys, row, strict=True)) for row in zip(*readings.values(), strict=True)]
    monkeypatch.setattr(run, "readings", known)
    figure = captured(monkeypatch, lambda path: curves(run, path))
    upper, lower = figure.axes
    x = np.array(readings["slip_m"])
    upper.set_xlabel(lower.get_xlabel())  # shared
    assert lower.get_xlabel() == "shear displacement (mm)"
    assert_line(upper, "left (blocks)", x, readings["shear_Pa"])
    first = lower.lines[0].get_xydata() * [1e-3, unit_factor("dilation (mm)")]
    np.testing.assert_allclose(first, np.stack([x, 5e-5 - np.array(readings["closure_m"])], 1))
    assert lower.get_ylabel() == "dilation since the start (mm)"
    assert len(upper.lines) == 1  # the curve of Coulomb's law alone would be a bilinear line


def test_curves_have_the_law_alone(monkeypatch):
    scene = SCENE.replace(coulomb(0.6, 1e9, 1e9), "from = 'westerly-rough'\n")
    run = RunRecord(Simulation(parse(scene, "rough")))
    readings = {"slip_m": [0.0, 2e-6], "closure_m": [0.0, 0.0], "normal_Pa": [1e6] * 2}
    readings["shear_Pa"] = [0.0, 0.0]
    keys = [f"left: {name}" for name in readings]
    run.readings = [
        dict(zip(keys, row, strict=True)) for row in zip(*readings.values(), strict=True)
    ]
    figure = captured(monkeypatch, lambda path: curves(run, path))
    upper, lower = figure.axes
    joint = next(iter(run.scene.laws.values())).joint()
    record = jl.direct_shear(joint, 2e-6, normal=1e6, steps=400)
    assert upper.get_ylabel() == "shear stress (MPa)"
    (alone,) = (line for line in upper.lines if "law alone" in line.get_label())
    np.testing.assert_allclose(1e-3 * alone.get_xdata(), record.shear_2, atol=1e-15)
    np.testing.assert_allclose(1e6 * alone.get_ydata(), record.F2)
    np.testing.assert_allclose(1e-3 * lower.lines[1].get_xdata(), record.shear_2, atol=1e-15)
    np.testing.assert_allclose(
        1e-3 * lower.lines[1].get_ydata(), record.closure[0] - record.closure, atol=1e-15
    )


def test_an_animation_has_the_frames_of_the_run(record, tmp_path, monkeypatch):
    run, _ = record
    drawn = []
    draw = Pictures.draw

    def note(self, axes, i, *rest):
        drawn.append(i)
        draw(self, axes, i, *rest)

    monkeypatch.setattr(Pictures, "draw", note)
    path = tmp_path / "motion.gif"
    Pictures(run).animation(path)
    assert drawn == list(range(len(run.times)))
    with Image.open(path) as image:
        durations = []  # ms; equal frames are joined
        for frame in range(image.n_frames):
            image.seek(frame)
            durations.append(image.info["duration"])
    assert sum(durations) == pytest.approx(
        1e3 * len(run.times) / block_pictures.FRAME_RATE, rel=0.02
    )
