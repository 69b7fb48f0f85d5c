"""Laws, the paper's tests by both forms, and the style of the figures.

Lengths in m, stresses in Pa. With K_n a power of the deformation the total form is homogeneous
except for the fraction of asperities in contact: for delta = size (cos tilt, sin tilt),

    F = contact_fraction(size cos tilt) size^(1 + eta) f(tilt).

A shear test by the total form therefore proceeds in the tilt: `secant` gives f once for each tilt,
and one scalar equation gives the size.
"""

import atexit
import math
from dataclasses import replace
from functools import cache
from itertools import cycle
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq, minimize_scalar

import jointlaw as jl
from jointlaw.paper.secant import contact_fraction, secant

atexit.register(plt.show)  # show the figure when the script ends
TOTAL = "total form (as printed)"
LAW = "incremental law (this package)"
WESTERLY = (("westerly-smooth", "smooth"), ("westerly-rough", "rough"))
SHEAR = "shear displacement δ₂ (µm)"
COARSE = jl.Resolution(8, 12, 16)  # yield is where the last of its cells slides
STYLE = {"axes.grid": True, "grid.alpha": 0.3, "axes.xmargin": 0}
LEGEND_BELOW = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16)}
CLOSURE_RANGES = {  # closure (m) at 20 MPa
    "westerly-smooth": 2.678206790222333e-07,
    "westerly-rough": 2.899592791924849e-07,
    "biegel-smooth": 2.7472729392684404e-07,
    "biegel-rough": 2.8490013661783444e-07,
    "jing-replica": 1.4469713377066222e-03,
}


@cache
def preset_law(name):
    """A preset with 12 x 32 orientations and 8 cells, whose errors are about 1 %."""
    law = jl.presets.load(name)
    cells = 1 if law.asperity.eta == 0 else 8  # one is exact for linear asperities
    closure_range = CLOSURE_RANGES.get(name, law.closure_range)
    return replace(law, resolution=jl.Resolution(12, 16, cells), closure_range=closure_range)


@cache
def incremental(name, to, normal=None, closure=None):
    """Record of direct shear to the displacement `to`, at constant normal stress or closure."""
    law = preset_law(name)
    stress = float(law.normal_stress(closure)) if closure else normal
    return jl.direct_shear(law.joint(), to, stress, stiffness=np.inf if closure else 0.0)


@cache
def total(name, to, normal=None, closure=None, azimuth=0.0):
    """Direct shear by the total form: closure, shear, F1, shear_stress, sliding, separated."""
    law = preset_law(name)
    rows = []
    if closure:
        tilts = np.arctan(np.linspace(0.0, to / closure, 101))
    else:  # beyond 90 degrees the joint has dilated past its first contact
        max_inclination = 90 / law.orientation.a
        tilts = np.radians([*range(90), *(90 + max_inclination * np.linspace(0.0, 0.95, 30))])
    for tilt in tilts:
        result, along = unit_secant(law, tilt, azimuth)
        cos = math.cos(tilt)
        f1 = float(result.F[0])
        size = closure / cos if closure else _size_at_stress(law, cos, f1, normal)
        if size is None or (rows and rows[-1][1] > to):
            break
        scale = float(contact_fraction(law, size * cos)) * size ** (1 + law.asperity.eta)
        F1 = scale * f1
        shear_stress = scale * float(result.F @ along)
        shear = size * math.sin(tilt)
        rows.append((size * cos, shear, F1, shear_stress, result.sliding, result.separated))
    names = ("closure", "shear", "F1", "shear_stress", "sliding", "separated")
    return SimpleNamespace(**dict(zip(names, np.transpose(rows), strict=True)))


def unit_secant(law, tilt, azimuth=0.0):
    """Total form at |delta| = 1 m with all asperities in contact, and the direction of shear."""
    along = np.array([0.0, math.cos(azimuth), math.sin(azimuth)])
    delta = math.sin(tilt) * along + [math.cos(tilt), 0.0, 0.0]
    return secant(replace(law, heights=None, closure_range=1.0), delta), along


def _size_at_stress(law, cos, f1, normal):
    """The smallest size with this normal stress (Pa); None if there is none."""
    if not f1 > 0:
        return None

    def misfit(log_size):
        fraction = float(contact_fraction(law, math.exp(log_size) * cos))
        log_force = math.log(max(fraction, 1e-300)) + (1 + law.asperity.eta) * log_size
        return log_force + math.log(f1 / normal)

    high = 10.0
    if law.heights is not None and cos < 0:  # size opens the joint: the stress has a maximum
        top = math.log(max(law.heights.overlap, 1e-12) / -cos)
        high = float(minimize_scalar(lambda x: -misfit(x), bounds=(top - 20, top)).x)
    return None if misfit(high) < 0 else math.exp(brentq(misfit, -80.0, high, xtol=1e-12))


def ratio(test):
    """Shear stress over normal stress of a test."""
    return test.shear_stress / test.F1


def first_sliding(test):
    """First row at which every asperity in contact slides; the last row if there is none."""
    rows = np.flatnonzero((test.sliding > 0) & (test.sliding + test.separated > 1 - 1e-9))
    return int(rows[0]) if len(rows) else len(test.sliding) - 1


@cache
def initial_stiffness(law, stress, azimuth=0.0):
    """dF/d(shear) in Pa/m at zero shear and constant closure: total form, incremental law."""
    along = np.array([0.0, math.cos(azimuth), math.sin(azimuth)])
    closure = np.array([float(law.closure(stress)), 0.0, 0.0])
    probe = 1e-6 * closure[0]
    joint = law.joint()
    joint.update(closure)
    tangent = joint.trial(probe * along)[1]
    total_stiffness = float(secant(law, closure + probe * along).F @ along) / probe
    return total_stiffness, along @ tangent @ along


def total_yield(azimuth):
    """Friction angle (degrees) of the replica when all asperities slide: total form, any stress.

    All slide when the angle of delta to the steepest facet's normal is arctan(mu lambda).
    """
    law = preset_law("jing-replica")
    cone = math.atan(law.asperity.mu * law.asperity.lam)
    tilt = 0.5 * math.pi / law.orientation.a + cone
    result, along = unit_secant(law, tilt, azimuth)
    return math.degrees(math.atan(result.F @ along / result.F[0]))


@cache
def replica_yield(stress, azimuth):
    """The same angle by the incremental law, at a constant normal stress."""
    law = replace(preset_law("jing-replica"), resolution=COARSE)
    to = 0.6 * float(law.closure(stress))
    record = jl.direct_shear(law.joint(), to, stress, azimuth=azimuth, steps=40)
    return float(record.friction_angle[first_sliding(record)])


def slip_limit():
    """Friction angle (degrees) of the replica at a slip far above the closure."""
    law = preset_law("jing-replica")
    return math.degrees(math.atan(law.asperity.mu)) + 90 / law.orientation.a


def density_curve(orientation, end, azimuth=0):
    """Inclinations (degrees) from 0 to `end`, and the density of Eq. 14 along an azimuth."""
    edge = 90 / orientation.a
    theta = np.unique([*np.linspace(0.0, end, 361), edge, edge + 1e-6])
    theta = theta[theta <= end]
    return theta, orientation.density(np.radians(theta), math.radians(azimuth))


def mirrored(quarter):
    """Values on the whole circle of azimuths, by symmetry from the first quarter."""
    half = [*quarter, *quarter[-2::-1]]
    return np.array([*half, *half[1:]])


def draw(panels, styles, polar=False, **labels):
    """Draw the panels {title: {label: (x, y)}}; returns their axes.

    styles: of the lines in turn, one tuple for all panels, or a list with a tuple for each panel.
    polar: whether x is an angle in degrees. labels: settings of all axes.
    A label that begins with "_" has no entry in the legend.
    """
    styles = styles if isinstance(styles, list) else [styles] * len(panels)
    columns = 1 if len(panels) % 2 else 2
    rows = -(-len(panels) // columns)
    with plt.rc_context(STYLE):
        size = (4.2 * columns if columns > 1 else 6.0, (5.8 if polar else 3.9) * rows)
        figure = plt.figure(figsize=size, layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False, subplot_kw={"polar": polar})
        for axes, panel_styles, (title, lines) in zip(
            grid.ravel(), styles, panels.items(), strict=True
        ):
            for style, (label, (x, y)) in zip(cycle(panel_styles), lines.items(), strict=False):
                axes.plot(np.radians(x) if polar else x, y, style, label=label)
            axes.set(title=title, **labels)
            axes.legend(**(LEGEND_BELOW if polar else {}))
            axes.yaxis.labelpad = 28 if polar else 4
    return grid.ravel()


def print_comparison(*rows):
    """Print quantity, value of the paper and value of this package, row by row."""
    for quantity, paper, here in rows:
        print(f"{quantity}\n    paper: {paper}\n    here:  {here}")
