"""How far an edge that is tilted against another still lies on it, and other soft choices."""

import numpy as np

FACE, CORNER = 2.0, 5.0  # degrees: up to the first it lies on it, from the second it does not
_LOW, _HIGH = np.sin(np.radians([FACE, CORNER]))


def raised(sine: np.ndarray, cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """0 for an edge that lies on the other, 1 for one that does not, smooth between; and its
    derivative by the size of the tilt (1/rad). sine, cosine: of the tilt, any shape."""
    part = (np.abs(sine) - _LOW) / (_HIGH - _LOW)
    part = np.minimum(np.maximum(part, cosine <= 0), 1.0)
    return part * part * (3 - 2 * part), 6 / (_HIGH - _LOW) * part * (1 - part) * cosine


def soft_size(x: np.ndarray, soft: float) -> tuple[np.ndarray, np.ndarray]:
    """|x| and its derivative, without the kink: differs from |x| only within `soft` of 0."""
    size = np.abs(x)
    part = np.minimum(size / soft, 1.0)
    return size * part * (2 - part), np.sign(x) * part * (4 - 3 * part)
