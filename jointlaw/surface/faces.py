"""Two scanned faces of one joint: mirrored, aligned, and added to the composite surface.

Each face is scanned from outside its block, heights positive away from the block. To close the
joint one of them is turned over, so that its grid is mirrored. Interlocked faces are complementary:
where the lower one has a summit, the upper one has a hollow. Their sum, the composite surface, is
therefore small and depends on the alignment: an error of one point times the slope of the faces is
as large as the composite surface of a fresh joint. The alignment is found in two steps:

1. Of each way to mirror the upper face, and of all shifts by whole points, the one with the highest
   correlation between the lower face and the negative upper face.
2. From there the shift in fractions of a point, and the rotation, that make the composite surface
   smallest (root mean square about its mean plane).
"""

import math
from typing import NamedTuple

import numpy as np
from scipy import fft, ndimage, optimize

from ..support.checks import Array, finite, more_than, one_of
from .asperities import remove_mean_plane

# how the grid of the upper face is turned over: axes of the array that are reversed
MIRRORS = {"rows": (1,), "columns": (0,), "both": (0, 1), "none": ()}
MIN_OVERLAP = 0.5  # of the smaller face, of shifted faces
MIN_CORRELATION = 0.5  # of faces that belong to one joint
MAX_ROTATION = math.radians(3.0)


class CompositeSurface(NamedTuple):
    """The sum of two faces on their common area.

    z: heights (ny, nx) in m.
    mirror: how the upper face was turned over, a key of `MIRRORS`.
    shift: of the upper face along the columns and along the rows, in m.
    rotation: of the upper face in rad.
    correlation: of the lower face and the negative upper face.
    """

    z: Array
    mirror: str
    shift: tuple[float, float]
    rotation: float
    correlation: float

    def describe(self) -> str:
        """The alignment in one sentence."""
        along_columns, along_rows = self.shift
        how = "not mirrored" if self.mirror == "none" else f"mirrored along {self.mirror}"
        if self.mirror == "both":
            how = "mirrored along rows and columns"
        return (
            f"Composite surface of two faces: the upper one is {how}, shifted by "
            f"{1e3 * along_rows:.3g} mm along the rows and {1e3 * along_columns:.3g} mm along the "
            f"columns, and rotated by {math.degrees(self.rotation):.2f} degrees. The correlation "
            f"of the faces is {self.correlation:.3f}; the composite surface has "
            f"{1e6 * float(np.std(self.z)):.3g} um rms."
        )


def join_faces(
    lower: Array, upper: Array, spacing: float, mirror: str | None = None
) -> CompositeSurface:
    """The composite surface of the two scanned faces of a joint.

    Parameters
    ----------
    lower, upper: heights (ny, nx) in m, positive away from the block of each face.
    spacing: spacing of the points in m, the same for both.
    mirror: how the grid of the upper face is turned over to close the joint: "rows" reverses each
        row, "columns" each column, "both" or "none"; None takes the way that fits best.

    Raises ValueError for faces with gaps, and for faces that do not belong together.
    """
    more_than("spacing", spacing, 0.0)
    faces = [remove_mean_plane(finite(n, z, "m")) for n, z in (("lower", lower), ("upper", upper))]
    names = [*MIRRORS] if mirror is None else [one_of("mirror", mirror, tuple(MIRRORS))]
    candidates = []
    for name in names:
        turned = np.flip(faces[1], MIRRORS[name])
        correlation, shift = _best_shift(faces[0], -turned)
        candidates.append((correlation, shift, name))
    correlation, shift, name = max(candidates)
    if correlation < MIN_CORRELATION:
        raise ValueError(
            f"upper: its correlation with the lower face is {correlation:.2f}, turned over "
            f"{name!r}: the faces do not belong together, or are not scanned from outside their "
            "blocks with heights positive away from the block; change the sign of one, or give the "
            "composite surface"
        )
    return _refine(faces[0], np.flip(faces[1], MIRRORS[name]), shift, name, spacing)


def _best_shift(a: Array, b: Array) -> tuple[float, tuple[int, int]]:
    """The highest correlation of a face and a shifted face, and the shift in points.

    Shifts with an overlap of less than half the smaller face are not tried.
    """
    b = b[::-1, ::-1]
    rows, columns = np.add(a.shape, b.shape) - 1
    padded = [fft.next_fast_len(int(n), real=True) for n in (rows, columns)]

    def transform(values: Array) -> Array:
        return fft.rfft2(values, padded)

    def convolve(first: Array, second: Array) -> Array:
        """The sum of products over the overlap, for every shift, from two transforms."""
        return fft.irfft2(first * second, padded)[:rows, :columns]

    transform_a = transform(a)
    transform_b = transform(b)
    ones_a = transform(np.ones(a.shape))
    ones_b = transform(np.ones(b.shape))
    count = np.maximum(np.rint(convolve(ones_a, ones_b)), 1.0)
    sum_a = convolve(transform_a, ones_b)
    sum_b = convolve(ones_a, transform_b)
    variance_a = convolve(transform(a**2), ones_b) - sum_a**2 / count
    variance_b = convolve(ones_a, transform(b**2)) - sum_b**2 / count
    covariance = convolve(transform_a, transform_b) - sum_a * sum_b / count
    floor = 1e-9 * (float(np.sum(a**2)) * float(np.sum(b**2)) + 1e-300)
    correlation = covariance / np.sqrt(np.maximum(variance_a * variance_b, floor))
    correlation[count < MIN_OVERLAP * min(a.size, b.size)] = -np.inf
    row, column = np.unravel_index(int(np.argmax(correlation)), correlation.shape)
    shift = (int(row) - b.shape[0] + 1, int(column) - b.shape[1] + 1)
    return float(correlation[row, column]), shift


def _refine(
    lower: Array, upper: Array, shift: tuple[int, int], mirror: str, spacing: float
) -> CompositeSurface:
    """The composite surface with the best shift in fractions of a point and the best rotation."""
    filtered = ndimage.spline_filter(upper, 3)
    rows = slice(max(shift[0], 0), min(lower.shape[0], upper.shape[0] + shift[0]))
    columns = slice(max(shift[1], 0), min(lower.shape[1], upper.shape[1] + shift[1]))
    rim = 2 + math.ceil(MAX_ROTATION * max(lower.shape) / 4)
    inner = (_shrunk(rows, rim), _shrunk(columns, rim))
    grid = np.mgrid[inner]
    centre = np.array([(one.start + one.stop - 1) / 2 for one in inner])
    part = lower[inner]

    def moved(q: Array) -> Array:
        cosine = math.cos(q[2])
        sine = math.sin(q[2])
        y, x = grid[0] - centre[0], grid[1] - centre[1]
        where = [
            cosine * y + sine * x + centre[0] - shift[0] - q[0],
            cosine * x - sine * y + centre[1] - shift[1] - q[1],
        ]
        turned: Array = ndimage.map_coordinates(
            filtered, where, order=3, prefilter=False, mode="nearest"
        )
        return turned

    def composite(q: Array) -> Array:
        return remove_mean_plane(part + moved(q))

    scale = float(np.std(part)) or 1.0
    fit = optimize.least_squares(
        lambda q: composite(q).ravel() / scale,
        np.zeros(3),
        bounds=([-2, -2, -MAX_ROTATION], [2, 2, MAX_ROTATION]),
        diff_step=1e-3,
        x_scale=[1.0, 1.0, 2 / max(part.shape)],
        max_nfev=30,
    )
    turned = remove_mean_plane(moved(fit.x))
    correlation = float(np.corrcoef(remove_mean_plane(part).ravel(), -turned.ravel())[0, 1])
    along_columns, along_rows = (spacing * (shift[k] + float(fit.x[k])) for k in range(2))
    return CompositeSurface(
        composite(fit.x), mirror, (along_columns, along_rows), float(fit.x[2]), correlation
    )


def _shrunk(part: slice, rim: int) -> slice:
    """A slice without `rim` points at both ends."""
    return slice(part.start + rim, part.stop - rim)
