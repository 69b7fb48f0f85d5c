"""Base class of joint laws: joints, steps, stiffness, strength and files of every law.

A law is a frozen dataclass of declared parameters (`parameters/declared.py`). Its `tables` list the
elements whose tractions add up to the traction of a joint (`kernels/element.py`), and this module
derives all else from the parameters and the elements. A class of a user's own needs `tables`, a
`closure_range`, and for strength reduction `strength_reduced`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from ..discretisation.first_loading_response import find_closure
from ..discretisation.tables import VERSION
from ..joints.batch import JointBatch
from ..joints.joint import Joint
from ..joints.preload import preload
from ..joints.time_step import single_mass_time_step
from ..kernels.admissible import require_admissible_states
from ..kernels.engine import Step, engine
from ..kernels.reference import LawTables
from ..parameters import keys, toml
from ..parameters.declared import fingerprint, parameters_of
from ..support.checks import Array, booleans, finite, more_than, numbers
from ..support.files import replace_file

DEFAULT_STRESS = 20e6  # Pa; its closure is the default closure_range


class Law:
    """Base class of joint laws, frozen dataclasses of parameters: `JointLaw`, `CoulombLaw`.

    A subclass has a parameter `plane`, and a name for files: `class Own(jl.Law, kind="own")`.
    """

    kinds: ClassVar[dict[str, type[Law]]] = {}  # by their names in files

    def __init_subclass__(cls, kind: str, **others: Any) -> None:
        super().__init_subclass__(**others)
        Law.kinds[kind] = cls

    @property
    @abstractmethod
    def closure_range(self) -> float:
        """Largest closure (m) for which the law is discretised."""

    @cached_property
    @abstractmethod
    def tables(self) -> LawTables:
        """Elements of the law, for the kernels."""

    # ----------------------------------------------------------------- joints

    def joint(self, normal_stress: float = 0.0, mated: bool = True) -> Joint:
        """One joint of this law, unsheared, closed to this normal stress (Pa, >= 0).

        The stress is met to rounding by the cells of the joint. If asperities yield, its closure
        differs a little from `closure(normal_stress)`, the limit of many cells. mated: False for
        faces that have never met. Such a joint starts at first touch, 100 mating lengths from the
        interlocked position along axis 2 (`unmated_start`), and without bond or cohesion. Raises
        ValueError as `closure` does, for a law whose faces always interlock, and for an unmated
        joint under a normal stress.
        """
        return Joint(self.joints(1, normal_stress=normal_stress, mated=mated))

    def joints(
        self,
        n: int,
        track_dissipation: bool = True,
        normal_stress: ArrayLike = 0.0,
        mated: ArrayLike = True,
        slider_dtype: DTypeLike = np.float64,
    ) -> JointBatch:
        """A batch of n joints of this law, advanced together; they start as `joint` does.

        track_dissipation, slider_dtype: as of `JointBatch`; normal_stress: one for all or (n,), in
        Pa; mated: for all or (n,). Raises ValueError as `joint` and `JointBatch` do.
        """
        batch = JointBatch(self, n, track_dissipation, slider_dtype)
        is_unmated = ~booleans("mated", mated, n)
        stress = finite("normal_stress", normal_stress, "Pa")
        if is_unmated.any():
            if stress.any():
                raise ValueError(
                    f"normal_stress = {normal_stress!r} with mated=False: an unmated joint starts "
                    "at first touch; close it by update, or by a laboratory test such as "
                    "direct_shear"
                )
            batch.reset(np.flatnonzero(is_unmated), mated=False)
        if stress.any():
            preload(batch, normal_stress)
        return batch

    def step(
        self, states: ArrayLike, d: ArrayLike, tangent: bool = True
    ) -> tuple[Array, Array, Array | None]:
        """One step as a pure function, for a host that stores the states itself.

        states: (n, state_size), or (state_size,) for one joint; zeros are the virgin state.
        d: displacement increments in m, (n, dim) or (dim,).
        Returns the new states, F in Pa (n, dim) or (dim,), and C in Pa/m (n, dim, dim) or
        (dim, dim), None without `tangent`; the arguments do not change. The algorithm and its
        equations: `jointlaw.kernels.reference.step`; it runs compiled, on all threads. Raises
        ValueError for a wrong shape, a number that is not finite, a state with a number beyond its
        bounds (`jointlaw.kernels.admissible`), or a step whose forces overflow.
        """
        old = numbers("states", states, "numbers of state")
        increment = finite("d", d, "m")
        rows = self.state_size
        dim = self.dim
        joints = old.shape[:-1]
        if old.ndim not in (1, 2) or old.shape[-1] != rows or increment.shape != (*joints, dim):
            raise ValueError(
                f"states have shape {old.shape} and d {increment.shape}; expected (n, {rows}) and "
                f"(n, {dim}), or ({rows},) and ({dim},) for one joint"
            )
        old = old.reshape(-1, rows)
        increment = np.ascontiguousarray(increment).reshape(-1, dim)
        require_admissible_states(self.tables, old)
        size = np.abs(old[:, :dim]).max(axis=1) + np.abs(increment).max(axis=1)
        overflows = ~(self.tables.closure_per_displacement * size <= self.max_effective_closure)
        if overflows.any():
            joint = int(np.argmax(overflows))
            raise ValueError(
                f"joint {joint}: the step d = {increment[joint]} m leads beyond "
                f"max_effective_closure = {self.max_effective_closure:g} m, where forces overflow; "
                "take a smaller step"
            )
        new = np.array(old, order="C")
        F = np.empty((*joints, dim))
        C = np.empty((*joints, dim, dim)) if tangent else None
        step = Step(increment, F.reshape(-1, dim), None if C is None else C.reshape(-1, dim, dim))
        engine(self.tables).advance(new[:, :, None], step, track_dissipation=True)
        return new.reshape(*joints, rows), F, C

    @property
    def dim(self) -> int:
        """Components of a displacement: 3, or 2 with a plane, or 1 with closure_only."""
        return self.tables.dim

    @property
    def state_size(self) -> int:
        """Numbers of the state of one joint, as `step` and snapshots have it."""
        return self.tables.rows

    @property
    def unmated_start(self) -> Array:
        """`delta` (dim,) in m of a joint whose faces have never met, at first touch.

        Closure counts from the interlocked position, in which the highest asperities are in the
        deepest hollows, so this one is negative. Raises ValueError for an infinite mating length.
        """
        return self.tables.unmated_start

    # --------------------------------------------------------- first-loading curve

    def normal_stress(self, closure: ArrayLike) -> Any:
        """Normal stress (Pa) on the first-loading curve, at a closure (m) without shear.

        If asperities yield it is the limit of many cells; the few cells of a joint slip a little
        later. A bond or tensile strength makes it negative for an opening. Raises ValueError for a
        closure beyond `max_effective_closure`, where forces overflow.
        """
        return self._first_loading(self._require_finite_forces_at(closure))[()]

    def closure(self, normal_stress: ArrayLike) -> Any:
        """Closure (m) at a normal stress (Pa, >= 0): the inverse of `normal_stress`.

        Raises ValueError for a stress that yielding asperities never reach.
        """
        stress = finite("normal_stress", normal_stress, "Pa")
        if not (stress >= 0).all():
            raise ValueError(f"normal_stress = {normal_stress!r} is out of bounds: it must be >= 0")
        max_search_closure = min(element.max_search_closure for element in self.tables.elements)
        return find_closure(self._first_loading, stress, max_search_closure)[()]

    def contact_fraction(self, closure: float) -> float:
        """Fraction of the asperities in contact at this closure (m); 0 for a law without heights.

        The law is not valid where nearly all asperities are in contact (docs/limits.md). A law
        with heights raises ValueError for a closure that is not finite.
        """
        return 0.0

    # ----------------------------------------------- tension, strength, stiffness

    @property
    def tensile_strength(self) -> float:
        """Upper bound (Pa) of the tension that an intact joint bears, without shear; 0 if none."""
        return sum(element.tensile_strength for element in self.tables.elements)

    @property
    def tensile_opening(self) -> float:
        """Opening (m) up to which an intact joint bears tension; 0 where it bears none.

        A host keeps a joint at least until it has opened this far, or `JointBatch.damage` is 1.
        """
        return max(element.tensile_opening for element in self.tables.elements)

    @property
    def tensile_stiffness(self) -> float:
        """Normal stiffness (Pa/m) of an intact joint that opens, up to `tensile_opening`."""
        return sum(element.tensile_stiffness for element in self.tables.elements)

    def secant_stiffness(self, normal_stress: float) -> tuple[float, float]:
        """Secant stiffness in closure and elastic stiffness in shear (Pa/m) at a normal stress.

        normal_stress: in Pa, > 0, of first loading without shear. The shear stiffness is elastic,
        without slip; 0 for a law of closure alone. Raises ValueError as `closure` does.
        """
        stress = more_than("normal_stress", normal_stress, 0.0)
        closure = self.closure(stress)
        delta = np.zeros((self.dim, 1))
        delta[0] = closure
        first, *remaining = self.tables.elements
        borne = [float(element.normal_stress(np.array(closure))) for element in remaining]
        shear = first.shear_stiffness(delta, stress - sum(borne))
        for element, part in zip(remaining, borne, strict=True):
            shear += element.shear_stiffness(delta, part)
        return float(stress / closure), shear

    def first_loading_stiffness(self, closure: ArrayLike, reduction: float = 1.0) -> Any:
        """Upper bound (Pa/m) of the eigenvalues of C on the first-loading curve, at a closure (m).

        It bounds the frequency of a mass on the joint. At a given normal stress the unsheared joint
        is the stiffest one, so that the bound at this stress holds for sheared joints as well.
        reduction: the factor F (> 0) of a strength reduction with this law inside
        (`strength_reduced`), which divides shear displacement and shear stress by F. Raises
        ValueError as `normal_stress` does.
        """
        y = self._require_finite_forces_at(closure)
        factor = more_than("reduction", reduction, 0.0)
        each = [one.first_loading_stiffness(y, factor) for one in self.tables.elements]
        return np.sum(each, axis=0)[()]

    def strength_reduced(self, factor: float) -> Self:
        """The law to use inside a reduction of the strength by `factor`, F > 0.

        A host divides shear displacements by F before the step of this law, and the shear stress
        that the step returns by F. Its joint then has the strength and dilation of the law (tan
        phi, c, tension, tan psi) divided by F, and the same stiffness. The work is the same inside
        and outside, so no energy is created. Exact for Coulomb's joint; docs/blocks.md has the
        errors for rough joints.

        Raises NotImplementedError for a class that does not define it.
        """
        raise NotImplementedError(
            f"{type(self).__name__} defines no strength_reduced(factor): return the law with its "
            "tension divided by the factor and its shear stiffness multiplied by its square"
        )

    # ------------------------------------------------- stiffness and time step

    def max_stiffness(self, closure: ArrayLike, shear: ArrayLike = 0.0) -> Any:
        """Upper bound of `|C|` (Pa/m) up to this closure (m) and this shear displacement (m, >= 0).

        shear: largest distance from the interlocked position, in any direction. Plastic
        indentation, degradation and damage decrease the stiffness. The softening of a bond or of
        Coulomb's joint has a negative slope, whose size may exceed this bound. Raises ValueError
        for a negative shear, and as `normal_stress` does.
        """
        y = self._require_finite_forces_at(closure)
        distance = finite("shear", shear, "m")
        if not (distance >= 0).all():
            raise ValueError(f"shear = {shear!r} m is out of bounds: it must be >= 0")
        self._require_finite_forces_at(y + self.tables.closure_per_displacement * distance)
        bounds = [element.largest_stiffness(y, distance) for element in self.tables.elements]
        return np.sum(bounds, axis=0)[()]

    def critical_time_step(
        self, mass: ArrayLike, area: ArrayLike, closure: ArrayLike, shear: ArrayLike = 0.0
    ) -> Any:
        """Largest stable explicit step (s) of one translating mass on one joint.

        mass: reduced mass m1 m2/(m1 + m2) in kg; area: of the joint in m2; closure: the largest
        closure of the run, in m, negative for unmated joints; shear: the largest shear displacement
        of the run, in m, in any direction; numbers or arrays of one shape. The result is
        2 sqrt(m/(K area)), infinite where the stiffness is zero, without rotation. Shear
        compresses one side of the asperities: a step for closure alone is several times too long
        for a joint that was sheared far at constant closure. `JointBatch.critical_time_step` is the
        same for joints in their present state. Several joints on one body, or bodies in series,
        need a smaller step: `jl.stable_time_step`.

        A fraction of 0.95 is stable in lasting contact, and where friction dissipates energy in
        every impact. Impacts without dissipation need 0.2 or less, because they last only
        2/fraction steps (docs/limits.md). Raises ValueError as `max_stiffness`
        does.
        """
        return single_mass_time_step(mass, area, self.max_stiffness(closure, shear))[()]

    @cached_property
    def max_effective_closure(self) -> float:
        """Effective closure (m) up to which forces, energies and their squares stay finite."""
        return min(element.max_effective_closure for element in self.tables.elements)

    def _first_loading(self, closure: Array) -> Array:
        """As `normal_stress`, without a check of the closures."""
        return np.sum([one.normal_stress(closure) for one in self.tables.elements], axis=0)

    def _require_finite_forces_at(self, closure: ArrayLike) -> Array:
        """Closures (m) as an array; raises ValueError unless they and their forces are finite."""
        y = finite("closure", closure, "m")
        if (y > self.max_effective_closure).any():
            raise ValueError(
                f"closure = {float(y.max())!r} m is out of bounds: it must be <= "
                f"max_effective_closure = {self.max_effective_closure:g} m, beyond which squares "
                "of forces overflow"
            )
        return y

    # ----------------------------------------------------------------- files

    @cached_property
    def fingerprint(self) -> str:
        """Version of the discretisation, and a hash of the parameters that differ from default.

        A state can be restored only by a law with the fingerprint of the law that wrote it.
        """
        return f"{VERSION}:{fingerprint(self)}"

    def toml_values(self) -> Mapping[str, Any]:
        """Values that files have in another form than the attributes."""
        return {}

    def to_toml(self, path: str | Path | None = None) -> str:
        """The law as TOML text, also written to `path` if given.

        Raises ValueError for heights of a class without a name in files.
        """
        text = toml.law_text(self, Law.kinds, self.toml_values())
        if path is not None:
            replace_file(Path(path), text.encode())
        return text

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """A law from a TOML file; the keys are the parameters.

        The key `kind` of the file at `path` names the class: "joint", the default, or "coulomb".
        Raises ValueError for a missing file, text that is not TOML, and parameters out of bounds.
        """
        if "\n" in str(path):
            raise ValueError("this is TOML text, not the path of a law file: use from_text")
        return cls.from_dict(keys.read(Path(path), "law file"), str(path))

    @classmethod
    def from_text(cls, text: str) -> Self:
        """A law from TOML `text`, as `to_toml` returns it. Raises ValueError as `from_toml`."""
        return cls.from_dict(keys.parse(text, "TOML text"), "TOML text")

    @classmethod
    def from_dict(cls, data: dict[str, Any], where: str = "law") -> Self:
        """A law from the mapping `data` of such a file; `where` names it in error messages.

        Raises ValueError as `from_toml`.
        """
        law: Self = toml.law_of(Law.kinds, data, where)
        return law

    def __getstate__(self) -> dict[str, Any]:
        # without cached values, which can be computed again
        return {name: getattr(self, name) for name in parameters_of(self)}
