"""Candidates of many contacts at once: pairs with equal keys, and the nearest of them."""

import numpy as np


def find_equal(values: np.ndarray, keys: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return all pairs of an index into `values` (m,) and one into `keys` (k,) with equal numbers.

    Sorted by the index into `values`, then by the index into `keys`.
    """
    order = np.argsort(keys, kind="stable")
    in_order = keys[order]
    first = np.searchsorted(in_order, values)
    count = np.searchsorted(in_order, values, side="right") - first
    index = np.repeat(np.arange(len(values)), count)
    place = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    return index, order[np.repeat(first, count) + place]


def find_nearest(
    n: int, number: np.ndarray, candidate: np.ndarray, distance: np.ndarray
) -> np.ndarray:
    """Return the nearest candidate (n,) of each of n contacts, -1 where there is none.

    number, candidate, distance (p,): contact, its candidate, and the distance of both (m); infinite
    for no candidate. Of equally near candidates the one with the lowest number is returned.
    """
    is_candidate = np.isfinite(distance)
    number = number[is_candidate]
    candidate = candidate[is_candidate]
    order = np.lexsort((candidate, distance[is_candidate], number))
    nearest = np.full(n, -1)
    contact_numbers, first = np.unique(number[order], return_index=True)
    nearest[contact_numbers] = candidate[order][first]
    return nearest
