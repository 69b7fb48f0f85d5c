"""A hash of parameters, by which a state knows the law that wrote it."""

import hashlib
from dataclasses import MISSING, fields, is_dataclass
from typing import Any


def fingerprint(parameters: Any) -> str:
    """Hash of a dataclass of parameters and of those within it.

    Fields at their default are left out, so that a parameter that is added later, and is off by
    default, leaves the hashes of all laws without it as they were.
    """
    return hashlib.sha256(_text(parameters).encode()).hexdigest()


def _text(value: Any) -> str:
    if not is_dataclass(value):
        return repr(value + 0.0 if isinstance(value, float) else value)  # -0.0 is 0.0
    parts = []
    for one in fields(value):
        now = getattr(value, one.name)
        if one.compare and (one.default is MISSING or now != one.default):
            parts.append(f"{one.name}={_text(now)}")
    return f"{type(value).__name__}({', '.join(parts)})"
