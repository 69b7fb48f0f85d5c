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
from jointlaw.parameters.resolution import named

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
    for name in dict.fromkeys(name for law in laws for name, *_ in _removals(law)):
        yield Variant(name, partial(_laws, scene, stress, partial(_lacking, name)))
    if laws:
        yield Variant("depth cells at its own stress", partial(_laws, scene, stress, _own_range))
        yield Variant("plain Coulomb", partial(_laws, scene, stress, _coulomb))
    yield from _runs(scene, max((s.largest for s in stress.values()), default=0.0))


def _removals(law: jl.JointLaw) -> Iterator[tuple[str, bool, Callable[[], jl.JointLaw]]]:
    """Ingredients of a law: name, does the stiffness depend on it, what makes the law without it.

    That raises ValueError where there is no such law.
    """
    heights, asperity = law.heights, law.asperity

    def without(**parameters: Any) -> Callable[[], jl.JointLaw]:
        return partial(replace, law, **parameters)

    # Population curves are not convex at eta = 0, so heights are then counted one by one.
    one_by_one = heights and replace(heights, formation="individual")
    if heights:
        yield "no heights", True, without(heights=None)
    if heights and heights.formation == "population":
        yield "heights counted one by one", True, without(heights=one_by_one)
    if asperity.eta:
        linear = without(asperity=replace(asperity, eta=0.0), heights=one_by_one)
        yield "linear asperities (eta = 0)", True, linear
    if asperity.mu:
        smooth = replace(asperity, mu=0.0, mu_residual=None, wear_slip=np.inf)
        yield "no friction on asperities", True, without(asperity=smooth)
    if np.isfinite(asperity.yield_interference):
        elastic = replace(asperity, yield_interference=np.inf)
        yield "elastic asperities", True, without(asperity=elastic)
    for key in ("b", "c"):
        if getattr(law.orientation, key):
            yield f"{key} = 0", True, partial(_with_part_zero, law, key)
    if np.isfinite(law.critical_slip):
        yield "no large shear", False, without(critical_slip=np.inf)
    lengths = law.critical_slip / law.closure_range, asperity.yield_interference / law.closure_range
    for name, resolution in named(*lengths).items():
        if law.resolution != resolution:
            yield f"resolution {name}", False, without(resolution=resolution)
    if law.resolution.depth > 1:
        yield "one depth cell", False, without(resolution=replace(law.resolution, depth=1))


def _with_part_zero(law: jl.JointLaw, key: str) -> jl.JointLaw:
    """The law with b or c of its orientation 0; the other may not allow it (Eq. 18)."""
    return replace(law, orientation=replace(law.orientation, **{key: 0.0}))


def _lacking(name: str, law: jl.JointLaw, stress: Stress | None) -> jl.JointLaw:
    """The law without an ingredient; as it is where it has none of this name."""
    for ingredient, stiffens, make in _removals(law):
        if ingredient == name:
            return _as_stiff(make(), law, stress) if stiffens else make()
    return law


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
