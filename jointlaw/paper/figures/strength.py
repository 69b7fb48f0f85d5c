"""Figures 17 to 19: shear at a kept normal stress, and friction angles of the replica."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from ...laboratory.experiments import direct_shear
from ...parameters.resolution import Resolution
from .runs import BIEGEL, incremental, law, ratio, total
from .sheet import LAW, TOTAL, Band, Curve, Panel, Sheet, sheet
from .total import total_shear

NORMAL, TO = 10e6, 1.5e-6  # Pa, printed; m, not printed
REPLICA = "jing-replica"
STRESSES = (0.1e6, 0.3e6, 1e6, 3e6, 10e6)  # Pa, our choice
NEARLY_ZERO = 10.0  # Pa
SLIP = 1e-3  # m, our choice of a fixed slip at which to read a friction angle
_COARSE = Resolution(8, 12, 16)  # cells: yield is read where the last of them slides


def figure_17() -> Sheet:
    """Shear resistance of smooth and rough granite at 10 MPa."""
    panels = []
    for kind, run in ((TOTAL, total), (LAW, incremental)):
        curves = []
        for name, label, color in BIEGEL:
            test = run(name, TO, normal=NORMAL)
            curves.append(Curve(label, test.shear * 1e6, ratio(test), "-", color))
            if kind == LAW:
                printed = total(name, TO, normal=NORMAL)
                x, y = printed.shear * 1e6, ratio(printed)
                curves.append(Curve(f"_{label}, total", x, y, ":", color))
                row = first_sliding(test.sliding, test.separated)
                at = np.array([test.shear[row] * 1e6])
                text = f"{label}: all in touch slide"
                curves.append(Curve(text, at, ratio(test)[row : row + 1], "o", color))
        axis = "shear displacement δ₂ (µm)"
        limits = (0.0, TO * 1e6)
        panels.append(Panel(kind, axis, "F₂/F₁", curves, xlim=limits, ylim=(0.0, 0.85)))
    return sheet("17", panels)


def figure_18() -> Sheet:
    """Friction angle of the replica by direction."""
    azimuth = np.arange(0.0, 91.0, 15.0)
    whole = np.arange(0.0, 361.0, 15.0)
    panels = []
    for kind in (TOTAL, LAW):
        curves = []
        if kind == TOTAL:
            quarter = np.array([total_yield(math.radians(x)) for x in azimuth])
            curves.append(Curve("every normal stress", whole, _mirrored(quarter), "-", "C0"))
        else:
            for stress, style in ((NEARLY_ZERO, "--"), (1e6, "-"), (10e6, ":")):
                quarter = np.array([law_yield(stress, math.radians(x)).angle for x in azimuth])
                label = "normal stress to 0" if stress == NEARLY_ZERO else f"{stress * 1e-6:g} MPa"
                curves.append(Curve(label, whole, _mirrored(quarter), style))
        limit = np.full(whole.shape, slip_limit())
        curves.append(Curve("slip far above closure", whole, limit, "-.", "0.4"))
        panels.append(
            Panel(kind, "azimuth φ (°)", "friction angle (°)", curves, True, ylim=(0.0, 60.0))
        )
    return sheet("18", panels)


def figure_19() -> Sheet:
    """Friction of the replica against normal stress, by two definitions of yield."""
    panels = []
    x = np.array(STRESSES) * 1e-6
    for kind in (TOTAL, LAW):
        curves = []
        for degrees, color in ((0, "C0"), (90, "C1")):
            turn = math.radians(degrees)
            if kind == TOTAL:
                slides = np.full(x.shape, total_yield(turn))
                fixed = np.array([total_slip_angle(s, turn) for s in STRESSES])
            else:
                slides = np.array([law_yield(s, turn).angle for s in STRESSES])
                fixed = np.array([law_slip_angle(s, turn) for s in STRESSES])
            curves.append(Curve(f"all in touch slide, {degrees}°", x, slides, "o-", color))
            curves.append(Curve(f"slip of 1 mm, {degrees}°", x, fixed, "s--", color))
        band = Band("y", slip_limit() - 0.3, slip_limit() + 0.3, "normal stress 0, any slip")
        axis = "friction angle (°)"
        panels.append(
            Panel(
                kind,
                "normal stress (MPa)",
                axis,
                curves,
                log_ticks=(0.1, 0.3, 1, 3, 10),
                ylim=(0.0, 65.0),
                bands=[band],
            )
        )
    return sheet("19", panels)


class Yield(NamedTuple):
    """When all asperities in touch slide: shear and seated closure (m), friction angle (deg)."""

    shear: float
    closure: float
    angle: float


@cache
def law_yield(stress: float, azimuth: float) -> Yield:
    """Yield of the replica at a kept normal stress (Pa) along an azimuth (rad)."""
    found = replace(law(REPLICA), resolution=_COARSE)
    closure = float(found.closure(stress))
    record = direct_shear(found.joint(), 0.6 * closure, stress, "stress", azimuth, steps=40)
    row = first_sliding(record.sliding, record.separated)
    return Yield(float(record.shear[row]), closure, float(record.friction_angle[row]))


@cache
def law_slip_angle(stress: float, azimuth: float) -> float:
    """Friction angle (deg) of the replica at a fixed slip, incremental law."""
    found = replace(law(REPLICA), resolution=_COARSE)
    record = direct_shear(found.joint(), SLIP, stress, "stress", azimuth, steps=40)
    return float(record.friction_angle[-1])


def first_sliding(sliding: np.ndarray, separated: np.ndarray) -> int:
    """First row at which every asperity in touch slides; the last row if none does."""
    rows = np.flatnonzero((sliding > 0) & (sliding + separated > 1 - 1e-9))
    return int(rows[0]) if len(rows) else len(sliding) - 1


def total_yield(azimuth: float) -> float:
    """Friction angle (deg) of the replica when all in touch slide, total form, any stress.

    All slide once the direction of delta stands off the steepest facet by arctan(mu lambda).
    """
    found = law(REPLICA)
    cone = math.atan(found.asperity.mu * found.asperity.lam)
    return total_angle(0.5 * math.pi / found.orientation.a + cone, azimuth)


def total_angle(tilt: float, azimuth: float) -> float:
    """Friction angle (deg) of the replica at a tilt arctan(shear/closure) (rad), total form."""
    found = replace(law(REPLICA), heights=None)  # their count cancels
    test = total_shear(found, [tilt], azimuth, normal=1e6)
    return math.degrees(math.atan2(test.shear_stress[0], test.F1[0]))


def total_slip_angle(stress: float, azimuth: float) -> float:
    """Friction angle (deg) of the replica at a fixed slip, total form."""
    test = total(REPLICA, 2 * SLIP, normal=stress, azimuth=azimuth)
    angle = np.degrees(np.arctan2(test.shear_stress, test.F1))
    return float(np.interp(SLIP, test.shear, angle))


def slip_limit() -> float:
    """Friction angle (deg) of the replica at a slip far above the closure: arctan mu + pi/2a."""
    found = law(REPLICA)
    return math.degrees(math.atan(found.asperity.mu)) + 90 / found.orientation.a


def _mirrored(quarter: np.ndarray) -> np.ndarray:
    """Values at 0, 15, ..., 90 degrees carried round the circle by symmetry."""
    half = np.concatenate([quarter, quarter[-2::-1]])
    return np.concatenate([half, half[1:]])
