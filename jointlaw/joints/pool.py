"""A pool of joints for contacts that form and end: a contact keeps its joint while it lasts."""

from collections.abc import Hashable, Iterable
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..support.checks import integer
from .batch import JointBatch
from .state import JointState

Places = NDArray[np.intp]


class JointPool:
    """Joints of one law, identified by the keys of their contacts.

    A key is any hashable object that names a contact while it lasts, such as the pair of its body
    numbers. `batch` holds the joints; `assign` and `add` return their places in it, for
    `batch.update(d, where=places)`. A released place is used for a later contact, whose joint
    starts in the virgin state. law, track_dissipation, slider_dtype: as in `JointBatch`.

    A host that stores the places of its contacts itself needs no keys, only `allocate` and
    `release`.

    >>> pool = jl.JointPool(law)
    >>> places = pool.assign([(1, 2), (1, 3)])
    >>> F, _ = pool.batch.update(np.full((2, 3), 1e-8), where=places)
    """

    def __init__(
        self, law: Any, track_dissipation: bool = True, slider_dtype: DTypeLike = np.float64
    ) -> None:
        self.batch = JointBatch(law, 0, track_dissipation, slider_dtype)
        self._place: dict[Hashable, int] = {}
        self._free: list[int] = []  # descending, so that pop() takes the lowest place

    def __len__(self) -> int:
        return len(self.batch) - len(self._free)

    @property
    def keys(self) -> list[Hashable]:
        """Keys of all contacts, in the order in which they were added."""
        return list(self._place)

    @property
    def places(self) -> Places:
        """Places (n,) in the batch of the joints of all `keys`."""
        return np.fromiter(self._place.values(), np.intp, len(self._place))

    def assign(self, keys: Iterable[Hashable], mated: bool = True) -> Places:
        """Make the contacts of the pool equal to `keys`: remove all others and add new ones.

        keys, mated, returns and raises: as `add`.
        """
        contacts = list(keys)
        self._require_start(mated)
        self.remove(self._place.keys() - set(contacts))
        return self.add(contacts, mated)

    def add(self, keys: Iterable[Hashable], mated: bool = True) -> Places:
        """Places (n,) of the joints of these contacts; contacts without a joint get a new one.

        keys: of n contacts. mated: whether the faces of new contacts interlock, or have never met
        (`JointLaw.joint`). Raises ValueError for mated=False and a law with permanent interlock.
        """
        contacts = list(keys)
        self._require_start(mated)
        new = [key for key in dict.fromkeys(contacts) if key not in self._place]
        self._place.update(zip(new, self.allocate(len(new), mated).tolist(), strict=True))
        return np.array([self._place[key] for key in contacts], np.intp)

    def allocate(self, n: int, mated: bool = True) -> Places:
        """Places (n,) of n new joints without keys, the lowest free ones.

        mated: as in `add`. Raises ValueError where n is no whole number >= 0, or for mated=False
        and a law with permanent interlock.
        """
        n = integer("n", n, 0)
        self._require_start(mated)
        missing = n - len(self._free)
        if missing > 0:
            first = len(self.batch)
            self.batch.resize(first + missing)
            self._free = [*range(first + missing - 1, first - 1, -1), *self._free]
        places = np.array([self._free.pop() for _ in range(n)], np.intp)
        if not mated:
            self.batch.reset(places, mated=False)
        return places

    def release(self, places: Places) -> None:
        """Release places (m,) of `allocate`; their joints are reset.

        Raises ValueError for a free place, a place of a contact with a key, or a place that occurs
        twice in `places`.
        """
        released = np.asarray(places, np.intp).tolist()
        allocated = {*range(len(self.batch))}.difference(self._free, self._place.values())
        for place in released:
            if place not in allocated:
                raise ValueError(
                    f"places name {place}, which is not allocated, or belongs to a key, or is "
                    "named twice: give places of allocate(), each once, and remove() keys"
                )
            allocated.remove(place)
        self._release(released)

    def _release(self, places: list[int]) -> None:
        self.batch.reset(np.array(places, np.intp))
        self._free = sorted([*self._free, *places], reverse=True)

    def _require_start(self, mated: bool) -> None:
        """Raise ValueError for mated=False and a law with permanent interlock."""
        if not mated:
            _ = self.batch.law.unmated_start

    def remove(self, keys: Iterable[Hashable]) -> None:
        """Remove the contacts of these `keys`; a key that is given twice is removed once.

        Raises KeyError for a key without a contact, and then removes none.
        """
        removed = list(dict.fromkeys(keys))
        places = [self._place[key] for key in removed]
        self._release(places)
        for key in removed:
            del self._place[key]

    def snapshot(self) -> JointState:
        """A copy of the states of all contacts in the order of `keys`, without the keys."""
        return self.batch.snapshot(self.places)

    def restore(self, keys: Iterable[Hashable], state: JointState) -> None:
        """Replace all contacts by `keys` with the states of a snapshot, in a new `batch`.

        Raises ValueError if another law wrote the state or the numbers of keys and states differ.
        """
        place = {key: k for k, key in enumerate(keys)}
        if len(place) != len(state):
            raise ValueError(
                f"keys name {len(place)} contacts, state holds {len(state)} joints: give the keys "
                "that the pool had when the snapshot was taken"
            )
        old = self.batch
        batch = JointBatch(old.law, len(place), old.track_dissipation, old.slider_dtype)
        batch.restore(state)
        self.batch = batch
        self._place = place
        self._free = []
