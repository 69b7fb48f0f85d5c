"""What the scripts of the figures share: laws, the paper's tests by both forms, and one style.

Lengths in m, stresses in Pa. With K_n a power of the deformation the total form is homogeneous,
but for the count of asperities in touch: for delta = size (cos tilt, sin tilt),
F = touching(size cos tilt) size^(1 + eta) f(tilt). So a shear test by the total form is a walk
along the tilt: f comes from `secant` once for each, the size from one scalar equation.
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
from jointlaw.paper.secant import secant, touching

atexit.register(plt.show)  # a script that has printed shows what it drew
TOTAL, LAW = "total form (as printed)", "incremental law (this package)"
WESTERLY = (("westerly-smooth", "smooth"), ("westerly-rough", "rough"))
SHEAR = "shear displacement δ₂ (µm)"
COARSE = jl.Resolution(8, 12, 16)  # cells: yield is read where the last of them slides
STYLE = {"axes.grid": True, "grid.alpha": 0.3, "axes.xmargin": 0}  # beside that of all pictures
BELOW = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16)}
RANGES = {  # closure (m) at 20 MPa, for which the depth cells are placed
    "westerly-smooth": 2.678206790222333e-07,
    "westerly-rough": 2.899592791924849e-07,
    "biegel-smooth": 2.7472729392684404e-07,
    "biegel-rough": 2.8490013661783444e-07,
    "jing-replica": 1.4469713377066222e-03,
}


@cache
def law(name):
    """A preset with 12 x 32 orientations and 8 depth cells, which leave errors of about 1 %."""
    found = jl.presets.load(name)
    cells = 1 if found.asperity.eta == 0 else 8  # one is exact where asperities are linear
    span = RANGES.get(name, found.closure_range)
    return replace(found, resolution=jl.Resolution(12, 16, cells), closure_range=span)


@cache
def incremental(name, to, normal=None, closure=None):
    """Record of direct shear to the displacement `to`, at a kept normal stress or closure."""
    found = law(name)
    stress = float(found.normal_stress(closure)) if closure else normal
    return jl.direct_shear(found.joint(), to, stress, stiffness=np.inf if closure else 0.0)


@cache
def total(name, to, normal=None, closure=None, azimuth=0.0):
    """The same test by the total form: closure, shear, F1, shear_stress, sliding, separated."""
    found, rows = law(name), []
    if closure:
        tilts = np.arctan(np.linspace(0.0, to / closure, 101))
    else:  # beyond 90 degrees the joint has dilated above the closure at which it first touched
        steepest = 90 / found.orientation.a
        tilts = np.radians([*range(90), *(90 + steepest * np.linspace(0.0, 0.95, 30))])
    for tilt in tilts:
        result, along = unit_secant(found, tilt, azimuth)
        cos, f1 = math.cos(tilt), float(result.F[0])
        size = closure / cos if closure else _size(found, cos, f1, normal)
        if size is None or (rows and rows[-1][1] > to):
            break
        scale = float(touching(found, size * cos)) * size ** (1 + found.asperity.eta)
        forces = scale * f1, scale * float(result.F @ along)
        rows.append((size * cos, size * math.sin(tilt), *forces, result.sliding, result.separated))
    names = ("closure", "shear", "F1", "shear_stress", "sliding", "separated")
    return SimpleNamespace(**dict(zip(names, np.transpose(rows), strict=True)))


def unit_secant(found, tilt, azimuth=0.0):
    """Total form at |delta| = 1 m with all asperities in touch, and the direction of shear."""
    along = np.array([0.0, math.cos(azimuth), math.sin(azimuth)])
    delta = math.sin(tilt) * along + [math.cos(tilt), 0.0, 0.0]
    return secant(replace(found, heights=None, closure_range=1.0), delta), along


def _size(found, cos, f1, normal):
    """The least size at which the normal stress is kept; None where it cannot be."""
    if not f1 > 0:
        return None

    def misfit(log_size):
        share = float(touching(found, math.exp(log_size) * cos))
        force = math.log(max(share, 1e-300)) + (1 + found.asperity.eta) * log_size
        return force + math.log(f1 / normal)

    high = 10.0
    if found.heights is not None and cos < 0:  # size opens the joint: the stress has a maximum
        top = math.log(max(found.heights.overlap, 1e-12) / -cos)
        high = float(minimize_scalar(lambda x: -misfit(x), bounds=(top - 20, top)).x)
    return None if misfit(high) < 0 else math.exp(brentq(misfit, -80.0, high, xtol=1e-12))


def ratio(test):
    """Shear stress over normal stress of a test."""
    return test.shear_stress / test.F1


def first_sliding(test):
    """First row at which every asperity in touch slides; the last row if none does."""
    rows = np.flatnonzero((test.sliding > 0) & (test.sliding + test.separated > 1 - 1e-9))
    return int(rows[0]) if len(rows) else len(test.sliding) - 1


@cache
def initial_stiffness(found, stress, azimuth=0.0):
    """dF/d(shear) in Pa/m at zero shear and kept closure: total form, incremental law."""
    along = np.array([0.0, math.cos(azimuth), math.sin(azimuth)])
    closed = np.array([float(found.closure(stress)), 0.0, 0.0])
    slip = 1e-6 * closed[0]
    joint = found.joint()
    joint.update(closed)
    tangent = joint.trial(slip * along)[1]
    return float(secant(found, closed + slip * along).F @ along) / slip, along @ tangent @ along


def total_yield(azimuth):
    """Friction angle (degrees) of the replica when all in touch slide, total form, any stress.

    All slide once the direction of delta stands off the steepest facet by arctan(mu lambda).
    """
    found = law("jing-replica")
    cone = math.atan(found.asperity.mu * found.asperity.lam)
    tilt = 0.5 * math.pi / found.orientation.a + cone
    result, along = unit_secant(found, tilt, azimuth)
    return math.degrees(math.atan(result.F @ along / result.F[0]))


@cache
def replica_yield(stress, azimuth):
    """The same by the incremental law, at a kept normal stress."""
    found = replace(law("jing-replica"), resolution=COARSE)
    to = 0.6 * float(found.closure(stress))
    record = jl.direct_shear(found.joint(), to, stress, azimuth=azimuth, steps=40)
    return float(record.friction_angle[first_sliding(record)])


def slip_limit():
    """Friction angle (degrees) of the replica at a slip far above the closure."""
    found = law("jing-replica")
    return math.degrees(math.atan(found.asperity.mu)) + 90 / found.orientation.a


def density_curve(orientation, end, azimuth=0):
    """Density of Eq. 14 along an azimuth over the inclinations from 0 to `end`, all in degrees."""
    edge = 90 / orientation.a
    theta = np.unique([*np.linspace(0.0, end, 361), edge, edge + 1e-6])
    theta = theta[theta <= end]
    return theta, orientation.density(np.radians(theta), math.radians(azimuth))


def mirrored(quarter):
    """Values over the azimuths of the first quarter carried round the circle by symmetry."""
    half = [*quarter, *quarter[-2::-1]]
    return np.array([*half, *half[1:]])


def draw(panels, styles, polar=False, **labels):
    """Draw the panels {title: {label: (x, y)}}; returns their axes.

    styles: of the lines in turn, one tuple for all panels or a list of one for each. A label that
    begins with "_" is kept out of the legend. Angles of polar axes are given in degrees.
    """
    styles = styles if isinstance(styles, list) else [styles] * len(panels)
    columns = 1 if len(panels) % 2 else 2
    rows = -(-len(panels) // columns)
    with plt.rc_context(STYLE):
        size = (4.2 * columns if columns > 1 else 6.0, (5.8 if polar else 3.9) * rows)
        figure = plt.figure(figsize=size, layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False, subplot_kw={"polar": polar})
        for axes, own, (title, lines) in zip(grid.ravel(), styles, panels.items(), strict=True):
            for style, (label, (x, y)) in zip(cycle(own), lines.items(), strict=False):
                axes.plot(np.radians(x) if polar else x, y, style, label=label)
            axes.set(title=title, **labels)
            axes.legend(**(BELOW if polar else {}))
            axes.yaxis.labelpad = 28 if polar else 4
    return grid.ravel()


def beside(*rows):
    """Print what the paper says and what we find, row by row."""
    for what, paper, ours in rows:
        print(f"{what}\n    paper: {paper}\n    here:  {ours}")
