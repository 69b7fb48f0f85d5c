"""Checks on numbers that come from outside: each error names parameter, value, bound and remedy."""

import math
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Arrays = TypeVar("Arrays", bound="tuple[Any, ...]")

# Types that float() would take, but that nobody means as a number ("3" in a file, a flag)
_NO_NUMBERS = (bool, np.bool_, str, bytes, complex, np.complexfloating)


def number(name: str, value: Any, *, infinite: bool = False) -> float:
    """Return `value` as a float, or say which parameter is not a finite real number."""
    try:
        if isinstance(value, _NO_NUMBERS) or np.ndim(value) != 0:
            raise TypeError
        result = float(value)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} = {value!r} is not a number; give a real number") from None
    if math.isnan(result) or (math.isinf(result) and not infinite):
        raise ValueError(f"{name} = {result} is not finite; give a finite number")
    return result


def more_than(name: str, value: Any, bound: float) -> float:
    """Return `value` as a float that is strictly larger than `bound`."""
    result = number(name, value)
    if not result > bound:
        raise ValueError(f"{name} = {result!r} is out of bounds: it must be > {bound:g}")
    return result


def at_least(name: str, value: Any, bound: float, *, infinite: bool = False) -> float:
    """Return `value` as a float that is not smaller than `bound`."""
    result = number(name, value, infinite=infinite)
    if not result >= bound:
        raise ValueError(f"{name} = {result!r} is out of bounds: it must be >= {bound:g}")
    return result


def remedy(given: Any, known: Iterable[str], otherwise: str = "choose one of") -> str:
    """What to write for an unknown name: the nearest known one, or any of all."""
    names = list(known)
    near = get_close_matches(str(given), names, 1)
    return f"did you mean {near[0]!r}?" if near else f"{otherwise} {', '.join(names)}"


def one_of(name: str, value: Any, choices: tuple[str, ...]) -> str:
    """Return `value` if it is one of the named choices."""
    if value not in choices:
        raise ValueError(f"{name} = {value!r} is unknown; {remedy(value, choices)}")
    return str(value)


def integer(name: str, value: Any, bound: int) -> int:
    """Return `value` as an int that is not smaller than `bound`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < bound:
        raise ValueError(
            f"{name} = {value!r} is out of bounds: it must be a whole number >= {bound}"
        )
    return int(value)


def numbers(name: str, value: Any, unit: str) -> Array:
    """Return `value` as an array of floats, finite or not; text, flags and objects are refused."""
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
    """Return `value` as an array of finite floats."""
    array = numbers(name, value, unit)
    if not np.isfinite(array).all():
        raise ValueError(f"{name} = {value!r} is not finite; give finite values in {unit}")
    return array


def truths(name: str, value: Any, n: int) -> NDArray[np.bool_]:
    """Return `value`, one truth or n of them, as (n,) truths."""
    array = np.asarray(value)
    if array.dtype != bool or array.shape not in ((), (n,)):
        raise ValueError(f"{name} = {value!r} must be True or False, or an array ({n},) of them")
    return np.broadcast_to(array, n)


def frozen(arrays: Arrays) -> Arrays:
    """Return a tuple whose arrays nobody can write to any more: laws share them."""
    for array in arrays:
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return arrays
