"""Files that are written whole or not at all."""

import json
import math
import os
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np


def replace_file(path: Path, data: bytes) -> None:
    """Write a file whole or not at all."""
    mine = f"{os.getpid()}-{threading.get_ident()}"  # another thread may write the same file
    temporary = path.with_name(f".{path.name}.{mine}.tmp")
    try:
        temporary.write_bytes(data)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_json(path: Path, data: Any) -> None:
    """Strict JSON: what is not finite becomes null, numpy's numbers and arrays plain ones."""
    text = json.dumps(_plain(data), indent=2, ensure_ascii=False, allow_nan=False)
    replace_file(path, (text + "\n").encode())


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
