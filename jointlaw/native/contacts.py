"""Geometry of the contacts of many bodies by the compiled library, for adapters of particle codes.

The formulas and their reasons are in `hosts/yade/files/yade_joint.py`, whose numpy code gives the
same bits. Arrays of vectors over contacts are (3, n), arrays over bodies (bodies, 3).
"""

import ctypes
from typing import Any

import numpy as np

from ..support.checks import Array
from . import library
from .library import address

MOTION, FORCES = range(2)  # operations of jlaw_contact_step
BEFORE_STEP = {  # names in the structure: names in the data of contacts
    "closure0": "closure", "n0": "n", "t0": "t2", "c10": "c1", "c20": "c2"
}  # fmt: skip
AS_NAMED = "b1", "b2", "R1", "R2", "area", "zero_overlap", "both_spheres", "axis"


class ContactCall(ctypes.Structure):
    """`jlaw_contacts` of contacts.h."""

    _fields_ = [
        *((name, ctypes.c_longlong) for name in ("n", "bodies")),
        *(
            (name, ctypes.c_void_p)
            for name in (
                *("x0", "x", "q0", "q", "motion", "b1", "b2"),
                *("R1", "R2", "area", "zero_overlap", "both_spheres", "closure0"),
                *("n0", "t0", "c10", "c20", "plane", "axis"),
                *("normal", "overlap", "c1", "c2", "t2", "closure", "d", "approach"),
                *("F", "added", "force", "torque"),
            )
        ),
    ]


class ContactGeometry:
    """Compiled geometry of contacts. Raises ImportError if the library was not built."""

    def __init__(self) -> None:
        loaded = library.load()
        if loaded is None:
            raise ImportError("the compiled library was not built: run `python -m jointlaw.native`")
        self._step = loaded.jlaw_contact_step
        self._lanes = library.vector_lanes(loaded)

    def motion(
        self,
        contacts: dict[str, Array],
        before: tuple[Array, Array],
        after: tuple[Array, Array],
        has_plane: bool,
        geometry: dict[str, Array],
    ) -> dict[str, Array]:
        """Frames of contacts after a step, and increments of their displacements.

        contacts: `Joints.contact_data`; its "axis" changes where a contact has rolled. before,
        after: positions (bodies, 3) and orientations (bodies, 4) of bodies. has_plane: whether all
        contacts are parts of flat joints. geometry: n (3, m), un (m,), c1 and c2 (3, m), whose
        columns of contacts that are not of two spheres are input; the other columns are written.

        Returns n, c1, c2, t2 (3, m), closure, approach (m,) and d (3, m), where d.T is contiguous.
        """
        n = len(contacts["closure"])
        bodies = len(after[0])
        contacts["axis"] = np.ascontiguousarray(contacts["axis"])  # which the library changes
        result = geometry | {
            "t2": np.empty((3, n)),
            "closure": np.empty(n),
            "d": np.empty((n, 3)),
            "approach": np.empty(n),
        }
        numbers = {name: contacts[key] for name, key in BEFORE_STEP.items()}
        numbers.update((name, contacts[name]) for name in AS_NAMED)
        numbers.update(x0=before[0], q0=before[1], x=after[0], q=after[1])
        numbers.update(motion=np.empty((2, bodies, 3)))
        if has_plane:
            numbers["plane"] = contacts["plane"]
        result["normal"] = result.pop("n")
        result["overlap"] = result.pop("un")
        self._run(MOTION, n, bodies, numbers | result)
        result["n"] = result.pop("normal")
        result["d"] = result["d"].T
        del result["overlap"]
        return result

    def forces(
        self, contacts: dict[str, Array], F: Array, added: Array | None, bodies: int
    ) -> tuple[Array, Array]:
        """Forces and torques (bodies, 3) on bodies by tractions F (3, n) of their contacts.

        contacts: as of `motion`, after the step. added: forces (n, 3) on the first body of each
        contact in addition to its traction, or None.
        """
        n = len(contacts["closure"])
        force = np.empty((bodies, 3))
        torque = np.empty((bodies, 3))
        numbers = {name: contacts[name] for name in ("b1", "b2", "area", "c1", "c2", "t2")}
        numbers.update(normal=contacts["n"], F=F.T, motion=np.empty((2, bodies, 3)))
        numbers.update(force=force, torque=torque)
        if added is not None:
            numbers["added"] = added
        self._run(FORCES, n, bodies, numbers)
        return force, torque

    def _run(self, operation: int, n: int, bodies: int, numbers: dict[str, Any]) -> None:
        """Call the library with arrays by their names in the structure."""
        arrays = {name: np.ascontiguousarray(array) for name, array in numbers.items()}
        addresses = {name: address(array) for name, array in arrays.items()}
        call = ContactCall(n=n, bodies=bodies, **addresses)
        self._step(ctypes.addressof(call), self._lanes, operation)
