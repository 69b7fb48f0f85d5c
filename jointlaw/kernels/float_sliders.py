"""Slider forces stored as float: packing of states and stochastic rounding, as native/sliders.h.

A state has two doubles for each slider, q_s and q_t, which are most of its numbers. With float
storage both are floats, in the place of one double; all other numbers of a state (displacement,
energies, plastic indentations, degradation, rows of other elements) and all arithmetic stay in
double.

A step may add to q an increment far below the resolution of a float, which rounding to the nearest
float would lose: a joint that is sheared slowly would never be loaded. Forces are therefore rounded
at random (stochastic rounding): away from zero with a probability equal to the fraction of the
interval between two floats, so that the expected value is exact. Rounding errors then do not
accumulate as a bias, in the forces or in the energy balance.

The random number is a hash of the displacement after the step, the number of the cell and the force
before the step: results are reproducible, the same in both kernels and for any number of threads. A
force that is a float already stays as it is, so a zero increment is neutral. To this end a slider
slips only if its trial force exceeds the friction limit by more than the largest rounding.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..support.checks import Array
from ..support.thresholds import (
    FLOAT_FRICTION_TOLERANCE,
    FLOAT_LIMIT_TOLERANCE,
    FRICTION_TOLERANCE,
    MAX_FLOAT_FORCE,
    MIN_FLOAT,
)

Bits = NDArray[np.uint64]
MIX_1 = np.uint64(0x9E3779B97F4A7C15)  # odd, with well distributed bits: JL_MIX_1 and so on
MIX_2 = np.uint64(0xBF58476D1CE4E5B9)
MIX_3 = np.uint64(0x94D049BB133111EB)
DROPPED_BITS = np.uint64(29)  # of the 52 bits of a double that a float does not have
DROPPED_MASK = np.uint64((1 << 29) - 1)


class FrictionTolerances(NamedTuple):
    """Tolerances of the friction limit of sliders, relative to it."""

    beyond: float  # a slider slips if its trial force exceeds the limit by more
    below: float  # a slider this close below the limit counts as sliding


DOUBLE_TOLERANCES = FrictionTolerances(0.0, FRICTION_TOLERANCE)
FLOAT_TOLERANCES = FrictionTolerances(FLOAT_LIMIT_TOLERANCE, FLOAT_FRICTION_TOLERANCE)


class SliderPacking:
    """Packing of states (n, rows) into numbers (n, packed_rows) of which sliders are floats.

    first: first row of the sliders q; sliders: number of sliders (two rows each).
    """

    def __init__(self, rows: int, first: int, sliders: int) -> None:
        self.rows = rows
        self.first = first
        self.sliders = sliders
        self.packed_rows = rows - sliders

    def packed_row(self, row: int) -> int:
        """Place in a packed state of a row of a state that belongs to no slider."""
        return row if row < self.first else row - self.sliders

    def pack(self, states: Array) -> Array:
        """Packed copy (n, packed_rows) of states (n, rows), slider forces to the nearest float.

        Raises ValueError for a slider force beyond MAX_FLOAT_FORCE.
        """
        first = self.first
        sliders = self.sliders
        q = states[:, first : first + 2 * sliders]
        if q.size and not np.abs(q).max() <= MAX_FLOAT_FORCE:
            raise ValueError(
                f"a slider force q of the state is {np.abs(q).max():g} Pa, which is not stored as "
                f"float: it must be at most {MAX_FLOAT_FORCE:g} Pa. Take joints with "
                "slider_dtype=numpy.float64"
            )
        packed = np.empty((len(states), self.packed_rows))
        packed[:, :first] = states[:, :first]
        packed[:, first + sliders :] = states[:, first + 2 * sliders :]
        halves = (
            q.reshape(len(states), 2, sliders).astype(np.float32).view(np.uint32).astype(np.uint64)
        )
        pairs = halves[:, 0] | (halves[:, 1] << np.uint64(32))
        packed[:, first : first + sliders] = pairs.view(np.float64)
        return packed

    def unpack(self, packed: Array) -> Array:
        """States (n, rows) of packed states (n, packed_rows); exact."""
        first = self.first
        sliders = self.sliders
        states = np.empty((len(packed), self.rows))
        states[:, :first] = packed[:, :first]
        states[:, first + 2 * sliders :] = packed[:, first + sliders :]
        pairs = np.ascontiguousarray(packed[:, first : first + sliders]).view(np.uint64)
        for half in range(2):
            bits = (pairs >> np.uint64(32 * half)).astype(np.uint32)
            rows = slice(first + half * sliders, first + (half + 1) * sliders)
            states[:, rows] = bits.view(np.float32)
        return states


def round_sliders(old: Array, q: Array, delta: Array) -> Array:
    """Slider forces q (2, M, D, B) rounded to floats, at random, as doubles.

    old: forces before the step, of the same shape; delta: displacement (dim, B) after it.
    """
    noise = _noise(old, _key(delta))
    of_q = np.stack([noise, noise >> (np.uint64(64) - DROPPED_BITS)])
    bits = (np.ascontiguousarray(q).view(np.uint64) + (of_q & DROPPED_MASK)) & ~DROPPED_MASK
    rounded = bits.view(np.float64)
    return np.where(np.abs(rounded) >= MIN_FLOAT, rounded, 0.0)


def _key(delta: Array) -> Bits:
    """Hash (B,) of displacements (dim, B)."""
    key = np.zeros(delta.shape[1], np.uint64)
    for component in np.ascontiguousarray(delta).view(np.uint64):
        key = (key ^ component) * MIX_1
        key = key ^ (key >> np.uint64(31))
    key = key * MIX_2
    return key ^ (key >> np.uint64(32))


def _noise(old: Array, key: Bits) -> Bits:
    """Random bits (M, D, B) of the sliders with the forces `old` (2, M, D, B) before the step."""
    _, M, D, _ = old.shape
    cells = np.arange(M * D, dtype=np.uint64).reshape(M, D, 1)
    qs, qt = np.ascontiguousarray(old).view(np.uint64)
    noise = (key + cells * MIX_2) ^ (qs >> DROPPED_BITS) ^ qt
    noise = (noise ^ (noise >> np.uint64(32))) * MIX_3
    noise = noise ^ (noise >> DROPPED_BITS)
    return np.asarray(noise, np.uint64)
