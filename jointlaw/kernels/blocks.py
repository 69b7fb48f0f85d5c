"""States of many joints in blocks (blocks, rows, lanes): the joints of a block lie side by side."""

import numpy as np
from numpy.typing import NDArray

from ..support.checks import Array

LANES = 8  # joints per block, JLAW_BLOCK in native/batch.h
_LINE = 64  # bytes that a processor reads at once

Index = NDArray[np.intp]


def zeros(n: int, rows: int, lanes: int = LANES) -> Array:
    """Blocks of zeros for n states, which begin where a line of memory does."""
    blocks = -(-n // lanes)
    size = blocks * rows * lanes
    raw = np.zeros(size + _LINE // 8)
    first = -raw.ctypes.data % _LINE // 8
    return raw[first : first + size].reshape(blocks, rows, lanes)


def rows_of(state: Array, n: int, index: Index | None = None) -> Array:
    """State of n joints, or those of `index`, as a copy (rows, n) with joints last."""
    lanes = state.shape[2]
    if index is None:
        index = np.arange(n)
    return np.ascontiguousarray(state[index // lanes, :, index % lanes].T)


def write_rows(state: Array, rows: Array, index: Index) -> None:
    """Write states (rows, n) of the joints of `index` back into the blocks."""
    lanes = state.shape[2]
    state[index // lanes, :, index % lanes] = rows.T
