"""Snapshots of joints, and the error of a step that overflows."""

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..support.checks import Array
from ..support.files import replace_file

_VERSION = 1  # of the file, which holds the values with joints last
_FLOAT_VERSION = 2  # of a file whose values of sliders are floats, in an array of their own


@dataclass(frozen=True, eq=False)
class JointState:
    """State of one joint or a batch, as `snapshot()` returns it.

    fingerprint: of the law that wrote it. values: (n, state_size), one row per joint, in the order
    of `jointlaw.kernels.reference`, as `law.step` accepts them. float_rows: first and last + 1 row
    of the slider forces if they are 32-bit floats (`slider_dtype` of `JointBatch`), which `save`
    writes as such; None else.
    """

    fingerprint: str
    values: Array
    float_rows: tuple[int, int] | None = None

    def __len__(self) -> int:
        return len(self.values)

    def require(self, fingerprint: str) -> None:
        """Require that the law with this fingerprint wrote the state.

        Raises ValueError if another law wrote it; the message distinguishes another version of the
        discretisation from other parameters.
        """
        if self.fingerprint == fingerprint:
            return
        own_version = self.fingerprint.partition(":")[0]
        version = fingerprint.partition(":")[0]
        if own_version != version:
            raise ValueError(
                f"state is of discretisation {own_version}, this jointlaw has {version}: facets "
                "and cells are not the same; run the path again, or install the version that wrote "
                "the state"
            )
        raise ValueError("state belongs to a joint law with other parameters")

    def save(self, path: str | Path) -> None:
        """Write the state to an NPZ file at `path`, atomically. Raises OSError where it cannot."""
        buffer = io.BytesIO()
        values = self.values.T
        if self.float_rows is None:
            np.savez(buffer, version=_VERSION, fingerprint=self.fingerprint, values=values)
        else:
            first, end = self.float_rows
            np.savez(
                buffer,
                version=_FLOAT_VERSION,
                fingerprint=self.fingerprint,
                values=np.delete(values, slice(first, end), axis=0),
                floats=values[first:end].astype(np.float32),
                first_float=first,
            )
        replace_file(Path(path), buffer.getvalue())


class NonFiniteError(FloatingPointError, ValueError):
    """A step gave a traction or state that is not finite; nothing was moved.

    `joint` is the index of the joint in the batch, `state` its state before the step, `d` its
    increment (dim,) in m: after `joint.restore(error.state)`, `joint.update(error.d)` fails again.
    """

    joint: int
    state: JointState
    d: Array


def load_state(path: str | Path) -> JointState:
    """Read a state that `JointState.save` wrote to `path`. Raises ValueError for any other file.

    >>> joint.snapshot().save("joint.npz")
    >>> joint.restore(jl.load_state("joint.npz"))
    """
    path = Path(path)
    try:
        with path.open("rb") as stream:
            if not zipfile.is_zipfile(stream):
                raise ValueError("not an NPZ file")
        with np.load(path, allow_pickle=False) as data:
            version = int(data["version"])
            if version not in (_VERSION, _FLOAT_VERSION):
                raise ValueError(
                    f"its version is {version}, this jointlaw reads {_VERSION} and {_FLOAT_VERSION}"
                )
            fingerprint = str(data["fingerprint"])
            values = _table(data, "values")
            float_rows = None
            if version == _FLOAT_VERSION:
                floats = _table(data, "floats")
                first = int(data["first_float"])
                if floats.shape[1:] != values.shape[1:] or not 0 <= first <= len(values):
                    raise ValueError("floats does not fit to values")
                float_rows = first, first + len(floats)
                values = np.concatenate([values[:first], floats, values[first:]])
    except (OSError, KeyError, ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"{str(path)!r} is not a saved joint state: {error}") from None
    return JointState(fingerprint, np.array(values.T, float, order="C"), float_rows)


def _table(data: Any, name: str) -> Array:
    """An array (rows, joints) of a file. Raises ValueError unless it is one of finite numbers."""
    table: Array = data[name]
    if table.ndim != 2 or table.dtype.kind != "f":
        raise ValueError(f"{name} is no table of numbers")
    if not np.isfinite(table).all():
        raise ValueError(f"{name} holds numbers that are not finite")
    return table
