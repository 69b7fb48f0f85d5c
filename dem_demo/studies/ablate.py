"""A scene without each of its ingredients in turn: what that changes, and what it costs.

An ingredient is removed from all laws of a scene at once, or from its run. Where that changes how
stiff the joints are, the stiffness K of an asperity is scaled so that each law closes as far as
before at the normal stress that its joints carried: what is left is the change of form.
"""

import time
from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

import jointlaw as jl
from jointlaw.parameters.resolution import named

from ..dynamics.simulation import Simulation
from ..errors import Refused
from ..output.law_alone import friction_angle
from ..output.record import Record
from ..output.run import run
from ..scene import Scene, coulomb_law, is_coulomb

SHALLOW = 1e-3  # step of closure, as a share, over which a stiffness is read
LONGEST = 0.95  # of the stability limit
CELLS = 4  # depth cells at least, where they are placed for the scene
WARM = 20  # steps before the first run, which else would pay for compiled code
HALVINGS = 3  # of the time step, where a variant is too stiff for that of the scene
COST = ("steps", "time_step_s", "cpu_s", "time_ratio", "note")
VERSION = 1  # of summary.json

Law, Change = jl.JointLaw, Callable[[jl.JointLaw], jl.JointLaw]


def ablate(scene: Scene, until: float | None = None, leave_out: Collection[str] = ()) -> list[dict]:
    """Rows: the scene as it is, without each ingredient in turn, and as it is once more.

    until: model time to stop at (s); leave_out: names of variants that are not run. A row holds
    outcomes and "change of ..." against the first row, unit last in the name, and COST. Two rows of
    the whole scene tell how steady the times are. A variant that cannot be built or run is a row
    whose note says why.
    """
    warm = Simulation(scene)
    for _ in range(WARM):
        warm.step()
    whole, record = _run("whole scene", lambda: scene, until)
    if record is None:
        raise Refused(whole["note"])
    rows = [whole]
    for name, make in variants(scene, record):
        if name not in leave_out:
            row, other = _run(name, make, until)
            if other is not None:
                apart = np.hypot(*(other.motion[-1] - record.motion[-1])[:2])
                row["end, apart_mm"] = 1e3 * float(apart.max())
            rows.append(row)
    rows.append(_run("whole scene again", lambda: scene, until)[0])
    least = min(whole["cpu_s"], rows[-1]["cpu_s"])
    for row in rows:
        row["time_ratio"] = row["cpu_s"] / least
        numbers = {k: v for k, v in row.items() if isinstance(v, float) and k not in COST}
        for key in whole.keys() & numbers.keys():
            if isinstance(whole[key], float):
                row[f"change of {key}"] = numbers[key] - whole[key]
    return rows


def variants(scene: Scene, record: Record) -> Iterator[tuple[str, Callable[[], Scene]]]:
    """Names, and what makes the scene without an ingredient; that may raise ValueError.

    record: of the whole scene, for the normal stress that the joints of each law carried.
    """
    pressed: dict[str, list[float]] = {name: [] for name in scene.laws}
    for i, frame in enumerate(record.joints):
        for who, stress in zip(frame["who"].tolist(), record.joint(i, "normal_stress_Pa"), strict=True):  # fmt: skip
            if stress > 0:
                pressed[scene.law_of(tuple(who[:4]))].append(stress)
    joints = {name: law for name, law in scene.laws.items() if not is_coulomb(law)}

    def changed(change: Callable[[Law, list[float]], Law]) -> Scene:
        laws = {name: change(law, pressed[name]) for name, law in joints.items()}
        return replace(scene, laws={**scene.laws, **laws})

    lacking: dict[str, Callable[[Law, list[float]], Law]] = {}
    for law in joints.values():
        lacking |= {name: partial(_lacking, name) for name in _ingredients(law)}
    if joints:
        lacking |= {"depth cells at its own stress": _own_range, "plain Coulomb": _coulomb}
    for name, change in lacking.items():
        yield name, partial(changed, change)
    largest = max((max(stresses) for stresses in pressed.values() if stresses), default=0.0)
    for name, keys in _runs(scene, largest).items():
        yield name, partial(replace, scene, run=replace(scene.run, **keys))


def _ingredients(law: Law) -> dict[str, tuple[bool, Change]]:
    """By name: does the stiffness depend on it, and what makes a law that has it without it."""
    # Population curves are not convex at eta = 0, so heights are then counted one by one.
    single = law.heights and replace(law.heights, formation="individual")

    def asperity(**keys) -> Change:
        return lambda law: replace(law, asperity=replace(law.asperity, **keys))

    def angles(**keys) -> Change:
        return lambda law: replace(law, orientation=replace(law.orientation, **keys))

    smooth = asperity(mu=0.0, mu_residual=None, wear_slip=np.inf)
    found: dict[str, tuple[bool, Change]] = {
        "no heights": (True, lambda law: replace(law, heights=None)),
        "heights counted one by one": (True, lambda law: replace(law, heights=single)),
        "linear asperities (eta = 0)": (
            True, lambda law: replace(law, heights=single, asperity=replace(law.asperity, eta=0.0)),
        ),
        "no friction on asperities": (True, smooth),
        "elastic asperities": (True, asperity(yield_interference=np.inf)),
        "b = 0": (True, angles(b=0.0)),
        "c = 0": (True, angles(c=0.0)),
        "no large shear": (False, lambda law: replace(law, critical_slip=np.inf)),
    }  # fmt: skip
    has = {
        "no heights": law.heights, "linear asperities (eta = 0)": law.asperity.eta,
        "heights counted one by one": law.heights and law.heights != single,
        "no friction on asperities": law.asperity.mu, "b = 0": law.orientation.b,
        "elastic asperities": np.isfinite(law.asperity.yield_interference),
        "c = 0": law.orientation.c, "no large shear": np.isfinite(law.critical_slip),
    }  # fmt: skip
    found = {name: change for name, change in found.items() if has[name]}
    lengths = law.critical_slip / law.closure_range, law.asperity.yield_interference / law.closure_range
    others = {f"resolution {name}": r for name, r in named(*lengths).items()}
    others["one depth cell"] = replace(law.resolution, depth=1)
    for name, resolution in others.items():
        if resolution != law.resolution:
            found[name] = False, partial(replace, resolution=resolution)
    return found


def _lacking(name: str, law: Law, pressed: list[float]) -> Law:
    stiffens, change = _ingredients(law).get(name, (False, lambda law: law))
    without = change(law)
    if not stiffens:
        return without
    stress = np.median(_carried(pressed))
    K = law.asperity.K * stress / float(without.normal_stress(law.closure(stress)))
    return replace(without, asperity=replace(without.asperity, K=K))


def _own_range(law: Law, pressed: list[float]) -> Law:
    """Cells placed for the scene; by default they are for 20 MPa, and all but one lie idle."""
    closure = float(law.closure(max(_carried(pressed))))
    resolution = replace(law.resolution, depth=max(law.resolution.depth, CELLS))
    return replace(law, closure_range=closure, resolution=resolution)


def _coulomb(law: Law, pressed: list[float]) -> Law:
    """Constant stiffness and friction: those of the law at the normal stress of its joints."""
    stress = float(np.median(_carried(pressed)))
    closure = float(law.closure(stress))
    joints = law.joints(1)
    joints.update([[closure, 0.0]], tangent=False)
    _, C = joints.trial([[SHALLOW * closure, 0.0]])
    angle = np.radians(friction_angle(law, stress))
    return coulomb_law(float(C[0, 0, 0]), float(C[0, 1, 1]), float(np.tan(angle)))


def _carried(pressed: list[float]) -> list[float]:
    if not pressed:
        raise ValueError("no joint of this law carried any load, so there is no stress to match")
    return pressed


def _runs(scene: Scene, stress: float) -> dict[str, dict]:
    """Other keys of [run], by what they leave out or change."""
    run, found = scene.run, {}
    if run.dashpot_normal or run.dashpot_shear:
        found["no dashpots"] = {"dashpot_normal": 0.0, "dashpot_shear": 0.0}
    steps = 1 if run.law_steps > 1 else 4
    found[f"law_steps = {steps}"] = {"law_steps": steps}
    if run.seat:  # a load put down at once reaches its double
        fall = max(run.largest_stress, 2.0 * stress)
        found["not seated"] = {"seat": False, "largest_stress": fall}
    for name, times in (("half the time step", 0.5), ("twice the time step", 2.0)):
        if run.step:
            found[name] = {"step": times * run.step}
        elif times * run.fraction < LONGEST:
            found[name] = {"fraction": times * run.fraction}
    return found


def _run(name: str, make: Callable[[], Scene], until: float | None) -> tuple[dict, Record | None]:
    """A row, and the record of its run.

    Where a run is refused for its step it is tried with half of it, unless the step is what it is
    about.
    """
    row = {"without": name, "steps": 0, "time_step_s": np.nan, "cpu_s": np.nan, "note": ""}
    try:
        scene = make()
    except (ValueError, jl.PathError) as error:
        return row | {"note": f"cannot be built: {error}"}, None
    step = scene.run.step
    for halved in range(1 if "time step" in name else HALVINGS + 1):
        started, sim = time.process_time(), None
        try:
            sim = Simulation(replace(scene, title=name), step)
            record, summary = run(sim, None, until)
        except Refused as trouble:
            row["note"], step = f"refused: {trouble}", 0.5 * (step or (sim.dt if sim else 0.0))
            if "smaller step" in str(trouble) and step:
                continue
            break
        row |= {"steps": summary["steps"], "time_step_s": sim.dt, **_outcome(record, summary)}
        row["cpu_s"] = time.process_time() - started
        return row | {"note": f"time step / {2**halved}" if halved else ""}, record
    return row, None


def _outcome(record: Record, summary: dict) -> dict:
    """What a scene monitors, and what every scene has: the unit ends the name."""
    found = {f"{slip['block']}, slips at_deg": slip["slip_angle"] for slip in summary["slip"]}
    for moving, _ in record.scene.monitors.shear:
        name = record.scene.blocks[moving].name
        normal, shear = (record.column(f"{name}: {key}_Pa") for key in ("normal", "shear"))
        closure = record.column(f"{name}: closure_m")
        angle = np.degrees(np.arctan2(np.abs(shear), normal))
        found[f"{name}, peak friction_deg"] = float(angle.max())
        found[f"{name}, last shear_kPa"] = 1e-3 * float(shear[-1])
        found[f"{name}, dilation_mm"] = 1e3 * float(closure[0] - closure.min())
    for rock in summary["rocks"]:
        found[f"{rock['rock']}, state"] = rock["state"]
        found[f"{rock['rock']}, moved_m"] = rock["moved_m"]
    found["largest displacement_m"] = float(record.moved.max())
    found["friction_kJ"] = 1e-3 * summary["energy_J"]["friction"]
    found["energy error_1"] = summary["largest_energy_error"]
    return found
