"""What every joint law offers: joints, states as plain arrays, stiffness, files."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from ..discretisation.first_loading import closure_at
from ..discretisation.tables import VERSION
from ..joints.batch import JointBatch, stable_step
from ..joints.joint import Joint
from ..joints.seat import seat
from ..kernels.engine import Step, engine
from ..kernels.reference import LawTables
from ..parameters import keys, toml
from ..parameters.declared import fingerprint, parameters_of
from ..support.checks import Array, booleans, finite, more_than
from ..support.files import replace_file

DEFAULT_STRESS = 20e6  # Pa; its closure is the default closure_range


class Law:
    """A law: a frozen dataclass of parameters. `JointLaw` is one, `CoulombLaw` another.

    Reading and writing of files, and all that follows from the tables of a law, is here. Each class
    has `plane` besides.
    """

    kinds: ClassVar[dict[str, type[Law]]] = {}  # by the names that files have

    def __init_subclass__(cls, kind: str, **others: Any) -> None:
        super().__init_subclass__(**others)
        Law.kinds[kind] = cls

    @property
    @abstractmethod
    def closure_range(self) -> float:
        """Largest closure (m) that the law is made for."""

    @cached_property
    @abstractmethod
    def tables(self) -> LawTables:
        """What the kernels read."""

    # ----------------------------------------------------------------- joints

    def joint(self, normal_stress: float = 0.0, mated: bool = True) -> Joint:
        """One joint of this law, unsheared, closed to this normal stress (Pa, >= 0).

        The stress is met to rounding: where asperities yield, by the joint's own cells. Its closure
        then differs a little from `closure(normal_stress)`, that of many cells. Without `mated` its
        faces have never met: it starts at first touch, 100 mating lengths from the mated
        position along axis 2 (`unmated_start`), and without bond or cohesion. Raises ValueError as
        `closure` does, for a law whose faces always fit, and for an unmated joint that is to be
        closed already.
        """
        return Joint(self.joints(1, normal_stress=normal_stress, mated=mated))

    def joints(
        self,
        n: int,
        ledger: bool = True,
        normal_stress: ArrayLike = 0.0,
        mated: ArrayLike = True,
    ) -> JointBatch:
        """A batch of n joints of this law, advanced together; they start as `joint` does.

        normal_stress: one for all or (n,), in Pa; mated: for all or (n,). Without `ledger`
        dissipated energy is not added up, which is faster.
        """
        batch = JointBatch(self, n, ledger)
        far, stress = ~booleans("mated", mated, n), finite("normal_stress", normal_stress, "Pa")
        if far.any():
            if stress.any():
                raise ValueError(
                    f"normal_stress = {normal_stress!r} with mated=False: an unmated joint starts "
                    "at first touch; close it by update, or by a laboratory test such as "
                    "direct_shear"
                )
            batch.reset(np.flatnonzero(far), mated=False)
        if stress.any():
            seat(batch, normal_stress)
        return batch

    def step(
        self, states: ArrayLike, d: ArrayLike, tangent: bool = True
    ) -> tuple[Array, Array, Array | None]:
        """One step as a pure function, for a host that keeps the states itself.

        states: (n, state_size), or (state_size,) for one joint; zeros are the virgin state.
        d: displacement increments in m, (n, dim) or (dim,).
        Returns the new states, F in Pa (n, dim) or (dim,), and C in Pa/m (n, dim, dim) or
        (dim, dim), None without `tangent`; what was given stays as it was. The algorithm and its
        equations: `jointlaw.kernels.reference.step`; it runs compiled, on all threads. Raises
        ValueError for a wrong shape, a number that is not finite, or a step whose forces overflow.
        """
        old, move = finite("states", states, "numbers of state"), finite("d", d, "m")
        rows, dim, joints = self.state_size, self.dim, old.shape[:-1]
        if old.ndim not in (1, 2) or old.shape[-1] != rows or move.shape != (*joints, dim):
            raise ValueError(
                f"states have shape {old.shape} and d {move.shape}; expected (n, {rows}) and "
                f"(n, {dim}), or ({rows},) and ({dim},) for one joint"
            )
        old, move = old.reshape(-1, rows), np.ascontiguousarray(move).reshape(-1, dim)
        size = np.abs(old[:, :dim]).max(axis=1) + np.abs(move).max(axis=1)
        if (far := ~(self.tables.stretch * size <= self.largest_reach)).any():
            joint = int(np.argmax(far))
            raise ValueError(
                f"joint {joint}: the step d = {move[joint]} m leads beyond largest_reach = "
                f"{self.largest_reach:g} m, where forces overflow; take a smaller step"
            )
        new, F = np.array(old, order="C"), np.empty((*joints, dim))
        C = np.empty((*joints, dim, dim)) if tangent else None
        each = None if C is None else C.reshape(-1, dim, dim)
        step = Step(move, F.reshape(-1, dim), each)
        engine(self.tables).advance(new[:, :, None], step, ledger=True)
        return new.reshape(*joints, rows), F, C

    @property
    def dim(self) -> int:
        """Components of a displacement: 3, or 2 with a plane, or 1 with closure_only."""
        return self.tables.dim

    @property
    def state_size(self) -> int:
        """Numbers of state of one joint, as `step` takes them and a snapshot holds them."""
        return self.tables.rows

    @property
    def unmated_start(self) -> Array:
        """`delta` (dim,) in m of a joint whose faces have never met, at first touch.

        Closure is counted from the mated position, where the highest asperities face the deepest
        hollows: this one is negative. Raises ValueError for an infinite mating length.
        """
        return self.tables.unmated_start

    # ----------------------------------------------------- virgin closure curve

    def normal_stress(self, closure: ArrayLike) -> Any:
        """Normal stress (Pa) of a joint closed from zero to `closure` (m), unsheared.

        With a yield_interference that of the first loading, of infinitely many depth cells: a
        joint's own few slip a little later. Bond and tension make it negative where the joint
        opens.
        """
        return self._first_loading(self._within_reach(closure))[()]

    def closure(self, normal_stress: ArrayLike) -> Any:
        """Closure (m) at which the normal stress (Pa, >= 0) is reached: inverse of the above.

        Raises ValueError for a stress that yielding asperities never reach.
        """
        stress = finite("normal_stress", normal_stress, "Pa")
        if not (stress >= 0).all():
            raise ValueError(f"normal_stress = {normal_stress!r} is out of bounds: it must be >= 0")
        farthest = min(element.farthest for element in self.tables.elements)
        return closure_at(self._first_loading, stress, farthest)[()]

    def crushed(self, closure: float) -> float:
        """Share of the asperities in touch at this closure (m), if they have heights; else 0."""
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

        normal_stress: in Pa, > 0, of first loading without shear. Shear stiffness is that of joints
        that do not slide; 0 for a law of closure alone. Raises ValueError as `closure` does.
        """
        stress = more_than("normal_stress", normal_stress, 0.0)
        closure = self.closure(stress)
        delta = np.zeros((self.dim, 1))
        delta[0] = closure
        first, *others = self.tables.elements
        borne = [float(element.normal_stress(np.array(closure))) for element in others]
        shear = first.shear_stiffness(delta, stress - sum(borne))
        for element, part in zip(others, borne, strict=True):
            shear += element.shear_stiffness(delta, part)
        return float(stress / closure), shear

    def first_loading_stiffness(self, closure: ArrayLike, reduction: float = 1.0) -> Any:
        """Upper bound (Pa/m) of the eigenvalues of C in first loading to this closure (m).

        It bounds the frequency of a mass on the joint. At a given normal stress the unsheared joint
        is the stiffest one, so a bound at its stress holds for sheared joints as well.
        reduction: the factor F (> 0) of a strength reduction, inside which this law stands; shear
        displacement and shear stress are divided by it. Raises ValueError as `normal_stress` does.
        """
        y = self._within_reach(closure)
        factor = more_than("reduction", reduction, 0.0)
        each = [one.first_loading_stiffness(y, factor) for one in self.tables.elements]
        return np.sum(each, axis=0)[()]

    def strength_reduced(self, factor: float) -> Self:
        """The law to use inside a reduction of the strength by `factor`, F > 0.

        A host that divides shear displacements by F, and the shear stress that this law returns for
        them by F, has a joint whose strength and dilation (tan phi, c, tension, tan psi) are those
        of the law divided by F, and which is as stiff. No energy is created, as work is the same
        inside and outside. Exact for Coulomb's joint; docs/blocks.md has the errors of rough ones.

        Raises NotImplementedError for a class that does not define it.
        """
        raise NotImplementedError(
            f"{type(self).__name__} defines no strength_reduced(factor): return the law with its "
            "tension divided by the factor and its shear stiffness multiplied by its square"
        )

    # ------------------------------------------------- stiffness and time step

    def max_stiffness(self, closure: ArrayLike, shear: ArrayLike = 0.0) -> Any:
        """Upper bound of `|C|` (Pa/m) up to this closure (m) and this shear displacement (m, >= 0).

        The shear is the largest distance from the mated position, in any direction. Yielded and
        worn joints, and those of a broken bond, are less stiff. A joint that weakens, of a bond or
        by Coulomb's law, falls by a slope of its own, which may be larger than this bound.
        """
        y, way = self._within_reach(closure), finite("shear", shear, "m")
        if not (way >= 0).all():
            raise ValueError(f"shear = {shear!r} m is out of bounds: it must be >= 0")
        self._within_reach(y + self.tables.stretch * way)
        return np.sum([one.largest_stiffness(y, way) for one in self.tables.elements], axis=0)[()]

    def critical_time_step(
        self, mass: ArrayLike, area: ArrayLike, closure: ArrayLike, shear: ArrayLike = 0.0
    ) -> Any:
        """Largest stable explicit step (s) of one translating mass on one joint.

        mass: reduced mass m1 m2/(m1 + m2) in kg; area: of the joint in m2; closure: the largest
        reached, in m, negative for unmated joints; shear: the largest shear displacement reached,
        in m, in any direction; numbers or arrays of one shape. 2 sqrt(m/(K area)), infinite where
        nothing touches; a block code adds rotation. Shear presses one side of the asperities
        together: a step for closure alone is several times too long for a joint that was sheared
        far at constant closure. `JointBatch.critical_time_step` takes joints as they are now.

        Safe to 0.95 in lasting contact, and where friction takes from every impact. Impacts that
        lose nothing need 0.2 or less: they last but 2/share steps (docs/limits.md).
        """
        return stable_step(mass, area, self.max_stiffness(closure, shear))[()]

    @cached_property
    def largest_reach(self) -> float:
        """Effective closure (m) up to which forces, energies and their squares stay finite."""
        return min(element.reach for element in self.tables.elements)

    def _first_loading(self, closure: Array) -> Array:
        """`normal_stress` of closures that are within reach."""
        return np.sum([one.normal_stress(closure) for one in self.tables.elements], axis=0)

    def _within_reach(self, closure: ArrayLike) -> Array:
        """Closures (m) that are finite and whose forces are."""
        y = finite("closure", closure, "m")
        if (y > self.largest_reach).any():
            raise ValueError(
                f"closure = {float(y.max())!r} m is out of bounds: it must be <= largest_reach = "
                f"{self.largest_reach:g} m, beyond which squares of forces overflow"
            )
        return y

    # ----------------------------------------------------------------- files

    @cached_property
    def fingerprint(self) -> str:
        """Version of the discretisation, and a hash of the parameters that differ from default.

        States fit only joints of the law that wrote them.
        """
        return f"{VERSION}:{fingerprint(self)}"

    def shown(self) -> Mapping[str, Any]:
        """Values that files show in other words than the constructor keeps."""
        return {}

    def to_toml(self, path: str | Path | None = None) -> str:
        """The law as TOML text, also written to `path` if given.

        Raises ValueError for heights of a class that no file can name.
        """
        text = toml.law_text(self, Law.kinds, self.shown())
        if path is not None:
            replace_file(Path(path), text.encode())
        return text

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """A law from a TOML file; the keys are the parameters.

        The file's key `kind` says of which class: "joint", the default, or "coulomb".
        """
        if "\n" in str(path):
            raise ValueError("this is TOML text, not the path of a law file: use from_text")
        return cls.from_dict(keys.read(Path(path), "law file"), str(path))

    @classmethod
    def from_text(cls, text: str) -> Self:
        """A law from TOML text, as `to_toml` returns it."""
        return cls.from_dict(keys.parse(text, "TOML text"), "TOML text")

    @classmethod
    def from_dict(cls, data: dict[str, Any], where: str = "law") -> Self:
        """A law from the mapping that such a file holds; `where` is named in error messages."""
        law: Self = toml.law_of(Law.kinds, data, where)
        return law

    def __getstate__(self) -> dict[str, Any]:
        # without cached values, which are computed again when needed
        return {name: getattr(self, name) for name in parameters_of(self)}
