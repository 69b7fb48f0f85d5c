"""Snapshots of joints, and the replay file that a failed step leaves behind."""

import io
import os
import time
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..support.checks import Array
from ..support.files import replace_file

_VERSION = 1


class NonFiniteError(FloatingPointError, ValueError):
    """A step gave a traction or state that is not finite; `replay` is the file that repeats it."""

    def __init__(self, message: str, replay: Path | None = None) -> None:
        super().__init__(message)
        self.replay = replay


@dataclass(frozen=True, eq=False)
class JointState:
    """State of one joint or a batch, as `snapshot()` returns it; opaque but for its size."""

    fingerprint: str
    values: Array

    def __len__(self) -> int:
        return int(self.values.shape[1])

    def require(self, fingerprint: str) -> None:
        """Raise ValueError if the law of this fingerprint did not write the state."""
        if self.fingerprint == fingerprint:
            return
        mine, here = (text.partition(":")[0] for text in (self.fingerprint, fingerprint))
        if mine != here:
            raise ValueError(
                f"state is of discretisation {mine}, this jointlaw has {here}: facets and cells "
                "are not the same; run the path again, or install the version that wrote the state"
            )
        raise ValueError("state belongs to a joint law with other parameters")

    def save(self, path: str | Path) -> None:
        """Write the state to an NPZ file, whole or not at all."""
        _save(Path(path), fingerprint=self.fingerprint, values=self.values)


def load_state(path: str | Path) -> JointState:
    """Read a state that `JointState.save` wrote. Raises ValueError if the file is not one."""
    data = _load(Path(path), ("fingerprint",), ("values",), "a saved joint state")
    return JointState(str(data["fingerprint"]), data["values"])


def write_replay(
    law_text: Callable[[], str], values: Array, d: Array, tangent: bool
) -> Path | None:
    """Write state and increment of a failed step; in JOINTLAW_REPLAY_DIR or the working folder.

    law_text: gives the law as TOML; a ValueError says that it has no such form.

    Returns the file, or None where it could not be written: the failure of the step matters more.
    """
    folder = Path(os.environ.get("JOINTLAW_REPLAY_DIR", "."))
    path = folder / f"jointlaw-replay-{os.getpid()}-{time.time_ns()}.npz"
    try:
        _save(path, law=law_text(), values=values, d=d, tangent=tangent)
    except (OSError, ValueError):  # ValueError: heights that have no form as TOML
        return None
    return path


def read_replay(path: str | Path) -> dict[str, Any]:
    """Law (TOML text), state values (rows, n), increments (dim, n) and tangent flag of a replay."""
    return _load(Path(path), ("law", "tangent"), ("values", "d"), "a replay file")


def _save(path: Path, **arrays: Any) -> None:
    buffer = io.BytesIO()
    np.savez(buffer, version=_VERSION, **arrays)
    replace_file(path, buffer.getvalue())


def _load(path: Path, keys: tuple[str, ...], tables: tuple[str, ...], what: str) -> dict[str, Any]:
    try:
        with path.open("rb") as stream:
            if not zipfile.is_zipfile(stream):
                raise ValueError("not an NPZ file")
        with np.load(path, allow_pickle=False) as data:
            version = int(data["version"])
            if version != _VERSION:
                raise ValueError(f"its version is {version}, this jointlaw reads {_VERSION}")
            found = {key: data[key][()] for key in keys}
            for key in tables:
                if data[key].ndim != 2 or data[key].dtype.kind != "f":
                    raise ValueError(f"{key} is no table of numbers")
                found[key] = np.array(data[key], float)
            return found
    except (OSError, KeyError, ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"{str(path)!r} is not {what}: {error}") from None
