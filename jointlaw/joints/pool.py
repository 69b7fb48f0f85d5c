"""Joints for contacts that come and go: every contact keeps its joint as long as it lasts."""

from collections.abc import Hashable, Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..support.checks import integer
from .batch import JointBatch
from .state import JointState

Places = NDArray[np.intp]


class JointPool:
    """Joints of one law, found by the key of their contact.

    A key is whatever names a contact as long as it lasts, such as the pair of its body numbers.
    The joints live in `batch`; `assign` or `add` tell their places there, for
    `batch.update(d, where=places)`. A place that falls free goes to a later contact, whose joint
    starts anew. law, ledger: as of `JointBatch`.

    A host that keeps the places of its contacts itself needs no keys: `allocate` and `release`
    follow contacts that begin and end.

    >>> pool = jl.JointPool(law)
    >>> places = pool.assign([(1, 2), (1, 3)])
    >>> F, _ = pool.batch.update(np.full((2, 3), 1e-8), where=places)
    """

    def __init__(self, law: Any, ledger: bool = True) -> None:
        self.batch = JointBatch(law, 0, ledger)
        self._place: dict[Hashable, int] = {}
        self._free: list[int] = []  # descending, so that pop() takes the lowest place

    def __len__(self) -> int:
        return len(self.batch) - len(self._free)

    @property
    def keys(self) -> list[Hashable]:
        """Keys of all contacts, in the order in which they came."""
        return list(self._place)

    @property
    def places(self) -> Places:
        """Places (n,) in the batch of the joints of all `keys`."""
        return np.fromiter(self._place.values(), np.intp, len(self._place))

    def assign(self, keys: Iterable[Hashable], mated: bool = True) -> Places:
        """Hold just these contacts: the others are dropped, new ones added; their places (n,).

        keys, mated: as of `add`, which raises the same.
        """
        wanted = list(keys)
        _ = mated or self.batch.law.unmated_start  # refused before anything changes
        self.drop(self._place.keys() - set(wanted))
        return self.add(wanted, mated)

    def add(self, keys: Iterable[Hashable], mated: bool = True) -> Places:
        """Places (n,) of the joints of these contacts; those not held yet get new joints.

        keys: of n contacts. mated: whether the faces of the new ones fit each other, or have never
        met (`JointLaw.joint`). Raises ValueError where a law is always mated.
        """
        wanted = list(keys)
        _ = mated or self.batch.law.unmated_start
        new = [key for key in dict.fromkeys(wanted) if key not in self._place]
        self._place.update(zip(new, self.allocate(len(new), mated).tolist(), strict=True))
        return np.array([self._place[key] for key in wanted], np.intp)

    def allocate(self, n: int, mated: bool = True) -> Places:
        """Places (n,) of n new joints without keys, the lowest free ones.

        mated: as of `add`. Raises ValueError where n is no whole number >= 0, or a law is always
        mated.
        """
        n = integer("n", n, 0)
        _ = mated or self.batch.law.unmated_start
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
        """Give back places (m,) of `allocate`; their joints are reset.

        Raises ValueError for another place, free or of a contact with a key, and for a place that
        `places` names twice.
        """
        released = np.asarray(places, np.intp).tolist()
        allocated = {*range(len(self.batch))}.difference(self._free, self._place.values())
        for place in released:
            if place not in allocated:
                raise ValueError(
                    f"places name {place}, which is not allocated, or belongs to a key, or is "
                    "named twice: give places of allocate(), each once, and drop() keys"
                )
            allocated.remove(place)
        self._release(released)

    def _release(self, places: list[int]) -> None:
        self.batch.reset(np.array(places, np.intp))
        self._free = sorted([*self._free, *places], reverse=True)

    def drop(self, keys: Iterable[Hashable]) -> None:
        """Forget the contacts of these `keys`. Raises KeyError for a key that is not held."""
        gone = list(dict.fromkeys(keys))
        places = [self._place[key] for key in gone]
        self._release(places)
        for key in gone:
            del self._place[key]

    def snapshot(self) -> JointState:
        """A copy of the state of all contacts, in the order of `keys`: keep those beside it."""
        return self.batch.snapshot(self.places)

    def restore(self, keys: Iterable[Hashable], state: JointState) -> None:
        """Hold just these contacts, with the states of a snapshot, in a new `batch`.

        Raises ValueError if another law wrote the state or the numbers of keys and states differ.
        """
        place = {key: k for k, key in enumerate(keys)}
        if len(place) != len(state):
            raise ValueError(
                f"keys name {len(place)} contacts, state holds {len(state)} joints: give the keys "
                "that the pool had when the snapshot was taken"
            )
        batch = JointBatch(self.batch.law, len(place), self.batch.ledger)
        batch.restore(state)
        self.batch, self._place, self._free = batch, place, []
