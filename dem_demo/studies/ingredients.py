"""What a scene is made of, and the scene without each of it in turn.

An ingredient is removed from all laws of a scene at once, or from its run. Where that changes how
stiff the joints are, the stiffness K of an asperity is scaled so that each law closes as far as
before at the normal stress that its joints carried: what is left is the change of form.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

import jointlaw as jl
from jointlaw.parameters.resolution import NAMED

from ..output.law_alone import friction_angle
from ..output.record import JOINT_COLUMNS, Record
from ..scene import Scene, coulomb_law, is_coulomb

SHALLOW = 1e-3  # step of closure, as a share, over which a stiffness is read
LONGEST = 0.95  # of the stability limit
CELLS = 4  # depth cells at least, where they are placed for the scene
SPANS = 4  # law points: spans of the longest edge of a block that moves


@dataclass(frozen=True)
class Variant:
    """A scene that lacks one ingredient. `make` raises ValueError where there is no such scene.

    own_step: the time step is what the variant is about, so it must run with no other.
    """

    name: str
    make: Callable[[], Scene]
    own_step: bool = False


class Stress(NamedTuple):
    """Normal stress (Pa) of the loaded joints of a law over the frames of a run."""

    median: float
    largest: float


def working_stress(record: Record) -> dict[str, Stress]:
    """What the joints of each law carried in a run; a law that carried nothing is left out."""
    scene, column = record.scene, JOINT_COLUMNS.index("normal_stress_Pa")
    found: dict[str, list[float]] = {}
    for frame in record.joints:
        for who, values in zip(frame["who"].tolist(), frame["values"], strict=True):
            if values[column] > 0:
                found.setdefault(scene.law_of(tuple(who[:4])), []).append(values[column])
    return {name: Stress(float(np.median(all_)), max(all_)) for name, all_ in found.items()}


def variants(scene: Scene, stress: dict[str, Stress]) -> Iterator[Variant]:
    """The scene without each of its ingredients; `stress` as `working_stress` found it."""
    laws = [law for law in scene.laws.values() if not is_coulomb(law)]
    change = partial(_laws, scene, stress)

    def any_law(has: Callable[[jl.JointLaw], Any]) -> bool:
        return any(map(has, laws))

    if any_law(lambda law: law.heights):
        yield Variant("no heights", partial(change, _no_heights))
    if any_law(lambda law: law.heights and law.heights.formation == "population"):
        yield Variant("heights counted one by one", partial(change, _individual))
    if any_law(lambda law: law.asperity.eta):
        yield Variant("linear asperities (eta = 0)", partial(change, _linear))
    if any_law(lambda law: law.asperity.mu):
        yield Variant("no friction on asperities", partial(change, _smooth))
    for key in ("b", "c"):
        if any_law(lambda law, key=key: getattr(law.orientation, key)):
            yield Variant(f"{key} = 0", partial(change, partial(_no_shape, key)))
    if any_law(lambda law: np.isfinite(law.critical_slip)):
        yield Variant("no large shear", partial(change, _no_critical_slip))
    for name, resolution in NAMED.items():
        if any_law(lambda law, r=resolution: law.resolution != r):
            yield Variant(f"resolution {name}", partial(change, partial(_resolved, name)))
    if any_law(lambda law: law.resolution.depth > 1):
        yield Variant("one depth cell", partial(change, _one_cell))
    if laws:
        yield Variant("depth cells at its own stress", partial(change, _own_range))
        yield Variant("plain Coulomb", partial(change, _coulomb))
    yield from _runs(scene, max((s.largest for s in stress.values()), default=0.0))


def _runs(scene: Scene, stress: float) -> Iterator[Variant]:
    """Variants of how the scene is run."""
    run = scene.run

    def changed(name: str, **keys: Any) -> Variant:
        return Variant(name, lambda: replace(scene, run=replace(run, **keys)))

    if run.dashpot_normal or run.dashpot_shear:
        yield changed("no dashpots", dashpot_normal=0.0, dashpot_shear=0.0)
    if run.law_steps > 1:
        yield changed("law_steps = 1", law_steps=1)
    else:
        yield changed("law_steps = 4", law_steps=4)
    if run.seat:
        fall = max(run.largest_stress, 2.0 * stress)  # a load put down at once reaches its double
        yield changed("not seated", seat=False, largest_stress=fall)
    if np.isfinite(run.point_spacing):
        yield changed("law points at the ends only", point_spacing=np.inf)
    else:
        free = [block.corners for block in scene.blocks if not block.fixed]
        longest = max(np.hypot(*(np.roll(c, -1, axis=0) - c).T).max() for c in free)
        yield changed(f"{SPANS + 1} law points per edge", point_spacing=longest / SPANS)
    for name, times in (("half the time step", 0.5), ("twice the time step", 2.0)):
        if run.step:
            yield replace(changed(name, step=times * run.step), own_step=True)
        elif times * run.fraction < LONGEST:
            yield replace(changed(name, fraction=times * run.fraction), own_step=True)


def _laws(scene: Scene, stress: dict[str, Stress], change: Callable[..., Any]) -> Scene:
    """The scene with each joint law changed by change(law, stress)."""
    laws = {
        name: law if is_coulomb(law) else change(law, stress.get(name))
        for name, law in scene.laws.items()
    }
    return replace(scene, laws=laws)


def _carried(stress: Stress | None) -> Stress:
    if stress is None:
        raise ValueError("no joint of this law carried any load, so there is no stress to match")
    return stress


def _as_stiff(law: jl.JointLaw, like: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    """`law` with K such that it closes as far as `like` at a normal stress (Pa)."""
    pressed = _carried(stress).median
    K = law.asperity.K * pressed / float(law.normal_stress(like.closure(pressed)))
    return replace(law, asperity=replace(law.asperity, K=K))


def _no_heights(law: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    return _as_stiff(replace(law, heights=None), law, stress) if law.heights else law


def _individual(law: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    if law.heights is None or law.heights.formation == "individual":
        return law
    heights = replace(law.heights, formation="individual")
    return _as_stiff(replace(law, heights=heights), law, stress)


def _linear(law: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    """Population curves are not convex at eta = 0, so heights are then counted one by one."""
    heights = law.heights and replace(law.heights, formation="individual")
    asperity = replace(law.asperity, eta=0.0)
    return _as_stiff(replace(law, asperity=asperity, heights=heights), law, stress)


def _smooth(law: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    made = replace(law, asperity=replace(law.asperity, mu=0.0))
    return _as_stiff(made, law, stress)


def _no_shape(key: str, law: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    orientation = replace(law.orientation, **{key: 0.0})
    return _as_stiff(replace(law, orientation=orientation), law, stress)


def _no_critical_slip(law: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    return replace(law, critical_slip=np.inf)


def _resolved(name: str, law: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    return replace(law, resolution=NAMED[name])


def _one_cell(law: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    return replace(law, resolution=replace(law.resolution, depth=1))


def _own_range(law: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    """Cells placed for the scene; by default they are for 20 MPa, and all but one lie idle."""
    closure = float(law.closure(_carried(stress).largest))
    resolution = replace(law.resolution, depth=max(law.resolution.depth, CELLS))
    return replace(law, closure_range=closure, resolution=resolution)


def _coulomb(law: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    """Constant stiffness and friction: those of the law at this normal stress."""
    pressed = _carried(stress).median
    closure = float(law.closure(pressed))
    joints = law.joints(1)
    joints.update([[closure, 0.0]], tangent=False)
    _, C = joints.trial([[SHALLOW * closure, 0.0]])
    angle = np.radians(friction_angle(law, pressed))
    return coulomb_law(float(C[0, 0, 0]), float(C[0, 1, 1]), float(np.tan(angle)))
