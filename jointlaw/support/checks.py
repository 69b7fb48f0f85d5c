"""Validation of arguments and file values: an error names parameter, value, bound and remedy."""

import math
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Arrays = TypeVar("Arrays", bound="tuple[Any, ...]")

# float() accepts these types, but they are mistakes in place of a number ("3" in a file, a flag)
_NOT_NUMBERS = (bool, np.bool_, str, bytes, complex, np.complexfloating)


def number(name: str, value: Any, *, infinite: bool = False) -> float:
    """Return `value` as a float. Raises ValueError unless it is a finite real number.

    name: of the parameter, for the message. infinite: whether infinity is accepted.
    """
    try:
        if isinstance(value, _NOT_NUMBERS) or np.ndim(value) != 0:
            raise TypeError
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} = {value!r} is not a number; give a real number") from None
    if math.isnan(result) or (math.isinf(result) and not infinite):
        raise ValueError(f"{name} = {result} is not finite; give a finite number")
    return result


def more_than(name: str, value: Any, bound: float) -> float:
    """Return `value` as a float. Raises ValueError unless it is > `bound` and finite."""
    result = number(name, value)
    if not result > bound:
        raise ValueError(f"{name} = {result!r} is out of bounds: it must be > {bound:g}")
    return result


def at_least(name: str, value: Any, bound: float, *, infinite: bool = False) -> float:
    """Return `value` as a float. Raises ValueError unless it is >= `bound`."""
    result = number(name, value, infinite=infinite)
    if not result >= bound:
        raise ValueError(f"{name} = {result!r} is out of bounds: it must be >= {bound:g}")
    return result


def remedy(name: Any, choices: Iterable[str], introduction: str = "choose one of") -> str:
    """Text that suggests the most similar choice for an unknown name, or lists all choices."""
    names = list(choices)
    similar = get_close_matches(str(name), names, 1)
    return f"did you mean {similar[0]!r}?" if similar else f"{introduction} {', '.join(names)}"


def one_of(name: str, value: Any, choices: tuple[str, ...]) -> str:
    """Return `value` as text. Raises ValueError, which suggests a similar choice, unless it is one
    of the choices.
    """
    if value not in choices:
        raise ValueError(f"{name} = {value!r} is unknown; {remedy(value, choices)}")
    return str(value)


def integer(name: str, value: Any, bound: int) -> int:
    """Return `value` as an int. Raises ValueError unless it is a whole number >= `bound`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < bound:
        raise ValueError(
            f"{name} = {value!r} is out of bounds: it must be a whole number >= {bound}"
        )
    return int(value)


def numbers(name: str, value: Any, unit: str) -> Array:
    """Return `value` as an array of floats, which may be infinite or NaN.

    unit: for the message. Raises ValueError for text, booleans, objects and masked values.
    """
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "iuf":
            raise TypeError
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} = {value!r} is not an array of numbers ({unit})") from None
    if isinstance(value, np.ma.MaskedArray) and value.mask.any():
        raise ValueError(f"{name} has masked numbers; give values for them, or leave them out")
    if array.dtype == np.float64:
        return array
    with np.errstate(over="ignore"):  # from long double: reported as not finite by the caller
        return np.asarray(array, float)


def finite(name: str, value: Any, unit: str) -> Array:
    """Return `value` as an array of floats. Raises ValueError unless all of them are finite."""
    array = numbers(name, value, unit)
    if not np.isfinite(array).all():
        raise ValueError(f"{name} = {value!r} is not finite; give finite values in {unit}")
    return array


def booleans(name: str, value: Any, n: int) -> NDArray[np.bool_]:
    """Return `value`, one boolean or n of them, as an array (n,). Raises ValueError otherwise."""
    array = np.asarray(value)
    if array.dtype != bool or array.shape not in ((), (n,)):
        raise ValueError(f"{name} = {value!r} must be True or False, or an array ({n},) of them")
    return np.broadcast_to(array, n)


def read_only(arrays: Arrays) -> Arrays:
    """Return the tuple itself, after its arrays were made read-only, because laws share them.

    Members that are no arrays stay as they are.
    """
    for array in arrays:
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return arrays
