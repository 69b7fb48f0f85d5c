"""Coulomb's joint: the Mohr-Coulomb law of engineering practice."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.coulomb import CoulombElement
from ..kernels.reference import LawTables
from ..parameters.bond import MAX_PARAMETER
from ..parameters.declared import check, declared, parameter
from ..support.checks import more_than
from .law import DEFAULT_STRESS, Law


@declared
@dataclass(frozen=True)
class CoulombLaw(Law, kind="coulomb"):
    """A joint of constant stiffness that slips at the shear stress c + mu sigma (Mohr-Coulomb).

    An intact joint bears tension. By default cohesion and friction are constant in slip; residual
    values follow the peak at once, or over the slip `weakening`. After separation the faces have no
    cohesion. There is no dilation. docs/theory-incremental.md, "Coulomb joint", compares it with a
    `Bond`.

    Raises ValueError when a parameter is out of bounds.

    >>> made = jl.CoulombLaw(normal_stiffness=1e10, shear_stiffness=5e9, friction=0.7, cohesion=1e5)
    """

    normal_stiffness: float = parameter(
        "stiffness in closure", "Pa/m", above=0.0, high=MAX_PARAMETER
    )
    shear_stiffness: float = parameter("stiffness in shear", "Pa/m", above=0.0, high=MAX_PARAMETER)
    friction: float = parameter(
        "coefficient, tan(phi); infinite: the joint never slips", low=0.0, infinite=True
    )
    cohesion: float = parameter("c", "Pa", 0.0, low=0.0, high=MAX_PARAMETER)
    tension: float = parameter(
        "tensile strength; limited to cohesion/friction",
        "Pa",
        0.0,
        low=0.0,
        high=MAX_PARAMETER,
    )
    residual_friction: float | None = parameter(
        "friction after the peak, at most the peak friction; None: the peak friction",
        "",
        None,
        low=0.0,
        high=MAX_PARAMETER,
    )
    residual_cohesion: float | None = parameter(
        "cohesion after the peak, at most the peak cohesion; None: the peak cohesion",
        "Pa",
        None,
        low=0.0,
        high=MAX_PARAMETER,
    )
    weakening: float = parameter(
        "slip after the peak over which friction and cohesion decrease linearly to the residual "
        "values; 0: at once",
        "m",
        0.0,
        low=0.0,
        high=MAX_PARAMETER,
    )
    plane: float | None = parameter(
        "None for motion in 3-D, or the azimuth of the one plane in which the joint moves: vectors "
        "then have two components, closure and shear along the plane",
        "rad",
        None,
    )

    def __post_init__(self) -> None:
        check(self)
        for name in ("friction", "cohesion"):
            residual = getattr(self, f"residual_{name}")
            peak = getattr(self, name)
            if residual is not None and residual > peak:
                raise ValueError(
                    f"residual_{name} = {residual!r} is out of bounds: it must be <= {name} = "
                    f"{peak!r}"
                )

    @property
    def closure_range(self) -> float:
        """Closure (m) at 20 MPa; tests and tables choose their steps by it."""
        return DEFAULT_STRESS / self.normal_stiffness

    @cached_property
    def tables(self) -> LawTables:
        """As `Law.tables`."""
        dim = 3 if self.plane is None else 2
        return LawTables(dim, (CoulombElement(self, dim),))

    def secant_stiffness(self, normal_stress: float) -> tuple[float, float]:
        """As `Law.secant_stiffness`: the two parameters, at any normal_stress.

        Raises ValueError for a stress that is not positive.
        """
        if len(self.tables.elements) > 1:
            return super().secant_stiffness(normal_stress)
        more_than("normal_stress", normal_stress, 0.0)
        return self.normal_stiffness, self.shear_stiffness if self.dim > 1 else 0.0

    def first_loading_stiffness(self, closure: ArrayLike, reduction: float = 1.0) -> Any:
        """As `Law.first_loading_stiffness`, at a closure in a reduction; raises the same errors.

        `max_stiffness` has the friction in it, for the coupling of shear to closure, which has no
        eigenvalue of its own: the eigenvalues of (kn, 0; mu kn, 0) are kn and 0.
        """
        if len(self.tables.elements) > 1:
            return super().first_loading_stiffness(closure, reduction)
        y = self._require_finite_forces_at(closure)
        shear = self.shear_stiffness / more_than("reduction", reduction, 0.0) ** 2
        return np.full(y.shape, max(self.normal_stiffness, shear))[()]

    def strength_reduced(self, factor: float) -> Self:
        """As `Law.strength_reduced`.

        Raises ValueError unless the factor is > 0, and NotImplementedError for a subclass with
        elements of its own that does not define the method.
        """
        factor = more_than("factor", factor, 0.0)
        inherited = type(self).strength_reduced is CoulombLaw.strength_reduced
        if len(self.tables.elements) > 1 and inherited:
            super().strength_reduced(factor)
        return replace(
            self,
            tension=self.tension / factor,
            shear_stiffness=self.shear_stiffness * factor**2,
            weakening=self.weakening / factor,
        )
