"""Errors and costs of a law by resolution, and of simpler variants of a law.

python docs/measure/resolutions.py named
python docs/measure/resolutions.py cost-list
python docs/measure/resolutions.py one-plane
python docs/measure/resolutions.py tilt-friction
python docs/measure/resolutions.py reduced-models [--rounds 6] [--seconds 0.1]
"""

import os
import re
from dataclasses import replace
from functools import partial
from itertools import cycle
from timeit import Timer

import numpy as np
from common import print_table, run_command, shortest_times

import dem_demo
import jointlaw as jl
from jointlaw.accuracy.suite import standard_suite
from jointlaw.accuracy.tolerance import EXCURSIONS
from jointlaw.parameters.resolution import NAMED_RESOLUTIONS

# m: of the path of the study of one plane
PLANE_CLOSURE = 0.5e-6
PLANE_SHEAR = 1.5e-6
# the law of the studies of one plane and, with other orientations, of reduced models
ANISOTROPIC = jl.JointLaw(
    orientation=jl.Orientation(3.0, 0.0, 0.3),
    asperity=jl.Asperity(K=2.0e8, lam=1.2, eta=0.5, mu=0.3),
    # "individual" is convex at every eta
    heights=jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6, formation="individual"),
    asperity_density=1e10,
    closure_range=2e-6,
)
TILT_RESOLUTIONS = (2, 3, 1), (2, 4, 1), (2, 10, 1), (4, 6, 1), (4, 10, 1), (4, 10, 6), (16, 24, 1)
TILT_STRESSES = 26e3, 6e3  # Pa
INCREMENT_SETS = 4  # several, so that the branch predictor does not learn one of them


def named():
    """Largest error, in % of the peak, of the named resolutions for each preset.

    Motion in one plane, on the standard paths and the random paths of `at_tolerance`.
    """
    sliders = dict.fromkeys(NAMED_RESOLUTIONS, 0)
    rows = []
    for preset in jl.presets.names():
        law = replace(jl.presets.load(preset), plane=0.0)
        suite = standard_suite(law, excursions=EXCURSIONS)
        errors = []
        for name, resolution in NAMED_RESOLUTIONS.items():
            variant = replace(law, resolution=resolution)
            sliders[name] = max(sliders[name], variant.tables.sliders)
            errors.append(f"{100 * suite.errors(variant).traction.max():.2f}")
        rows.append([preset, *errors])
    print_table(["preset", *NAMED_RESOLUTIONS], [*rows, ["sliders, at most", *sliders.values()]])
    random_paths = [name for name in suite.names if re.fullmatch(r"(excursion|slip) \d+", name)]
    print(f"{len(random_paths)} of the {len(suite.names)} paths are random")


def cost_list():
    """Errors and times of resolutions of the preset westerly-smooth, on one thread.

    The named resolutions, and every other that no resolution with as few sliders beats;
    `print(law.tradeoff())` prints them all.
    """
    os.environ["JOINTLAW_THREADS"] = "1"
    tradeoff = replace(jl.presets.load("westerly-smooth"), plane=0.0).tradeoff()
    names = {resolution: f"{name}: " for name, resolution in tradeoff.named.items()}
    selected = {cost.resolution for cost in tradeoff.pareto_front()} | set(names)
    rows = []
    for cost in sorted(tradeoff.rows, key=lambda cost: cost.sliders):
        r = cost.resolution
        if r in selected:
            rows.append(
                [
                    f"{names.get(r, '')}{r.u}, {r.phi}, {r.depth}",
                    cost.sliders,
                    cost.bytes_per_joint,
                    f"{cost.max_error:.2%}",
                    f"{cost.friction_error:.2f}°",
                    f"{cost.dilation_error:.2f}°",
                    f"{cost.update_ns:.0f}",
                    f"{cost.tangent_update_ns:.0f}",
                ]
            )
    print_table(["`Resolution`", "sliders", "bytes", "error", "friction", "dilation", "ns",
                 "with tangent"], rows)  # fmt: skip


def one_plane():
    """Difference between a law with `plane` and the law in 3-D, on a shear path in that plane."""
    names = "balanced", "fine", "reference"
    rows = []
    for degrees in (0.0, 22.5, 45.0, 67.5, 90.0):
        cells = []
        for name in names:
            law = replace(ANISOTROPIC, resolution=name)
            difference, shear_across = plane_error(law, np.radians(degrees))
            cells.append(f"{difference:.0e}")
        rows.append([f"{degrees:g}", *cells, f"{shear_across:.1%}"])
    print(f"closed by {1e6 * PLANE_CLOSURE:.1f} um, sheared by {1e6 * PLANE_SHEAR:.1f} um and back")
    head = ["azimuth (deg)", *(f"difference at {name}" for name in names), "shear across the plane"]
    print_table(head, rows)


def plane_error(law, azimuth):
    """Largest difference of the shear in the plane, and largest shear across it, over the peak."""
    along = np.array([np.cos(azimuth), np.sin(azimuth)])
    across = np.array([-along[1], along[0]])
    spatial_joint = law.joint()
    planar_joint = replace(law, plane=azimuth).joint()
    stresses = []
    close = [[PLANE_CLOSURE, 0.0]]
    steps = round(PLANE_SHEAR / 1e-8)
    shear_forward = [[0.0, 1e-8]] * steps
    shear_back = [[0.0, -1e-8]] * steps
    for closing, shearing in close + shear_forward + shear_back:
        F, _ = spatial_joint.update([closing, *(shearing * along)], tangent=False)
        G, _ = planar_joint.update([closing, shearing], tangent=False)
        stresses.append([F[1:] @ along, G[1], F[1:] @ across])
    spatial, planar, shear_across = np.array(stresses).T
    peak = np.abs(spatial).max()
    return np.abs(spatial - planar).max() / peak, np.abs(shear_across).max() / peak


def tilt_friction():
    """Peak friction angles (deg) of the two laws of the scene `tilt`, by stress and resolution."""
    laws = dem_demo.load("tilt").laws
    rows = []
    for resolution in TILT_RESOLUTIONS:
        angles = []
        for stress in TILT_STRESSES:
            for direction in ("along", "across"):
                law = replace(laws[direction], resolution=jl.Resolution(*resolution))
                # friction peaks within a mating length
                record = jl.direct_shear(law.joint(), 1.2 * law.mating_length, stress, steps=120)
                angles.append(f"{record.peak_friction_angle:.2f}")
        rows.append([", ".join(map(str, resolution)), *angles])
    print_table(["u, phi, depth", "along, 26 kPa", "across, 26 kPa", "along, 6 kPa",
                 "across, 6 kPa"], rows)  # fmt: skip


def reduced_models(rounds=6, seconds=0.1):
    """Nanoseconds per joint and update of a law, and of the same law without an ingredient.

    The shortest of several rounds in which all cases take turns. Motion in one plane unless 3-D is
    named, random steps around a closure of 1 um, one thread; traction alone unless a tangent or
    the dissipated energy is named.
    """
    os.environ |= {"JOINTLAW_KERNEL": "native", "JOINTLAW_THREADS": "1"}
    space = replace(ANISOTROPIC, orientation=jl.Orientation(3.0, 0.5, 0.0))
    plane = replace(space, plane=0.0)
    closure = replace(space, closure_only=True)
    linear = replace(plane, asperity=replace(plane.asperity, eta=0.0))
    with_c = replace(space, orientation=jl.Orientation(3.0, 0.5, 0.1))

    def case(law, n=10_000, tangent=False, track_dissipation=False):
        return law, n, tangent, track_dissipation

    pairs = {
        "one `Joint` by Python, in a batch (tangent, dissipated energy)": (
            case(plane, n=1, tangent=True, track_dissipation=True),
            case(plane, tangent=True, track_dissipation=True),
        ),
        "no tangent (3-D, with dissipated energy)": (
            case(space, tangent=True, track_dissipation=True), case(space, track_dissipation=True),
        ),
        "no tangent (one plane)": (case(plane, tangent=True), case(plane)),
        "no dissipated energy (one plane)": (case(plane, track_dissipation=True), case(plane)),
        "motion in one plane, of 3-D": (case(space), case(plane)),
        "closure only, of 3-D": (case(space), case(closure)),
        "closure only, of one plane": (case(plane), case(closure)),
        "no heights": (case(plane), case(replace(plane, heights=None))),
        "no heights, linear asperities: one cell a facet": (
            case(linear), case(replace(linear, heights=None)),
        ),
        "no large shear: `mating_length = inf`": (
            case(replace(plane, mating_length=1e-3)), case(plane),
        ),
        "c = 0": (case(with_c), case(space)),
    }  # fmt: skip
    cases = {case: partial(update_time, *case, seconds) for pair in pairs.values() for case in pair}
    times = shortest_times(cases, rounds)
    rows = []
    for name, pair in pairs.items():
        before, after = (times[case] for case in pair)
        sizes = [law.joints(0).bytes_per_joint for law, *_ in pair]
        rows.append([name, f"{before:.0f}", f"{after:.0f}", f"{after / before:.2f}", *sizes])
    print_table(["left out", "ns before", "ns after", "after / before", "bytes before", "after"],
                rows)  # fmt: skip


def update_time(law, n, tangent, track_dissipation, seconds):
    """Shortest time (ns) per joint of an update during so many seconds.

    n: joints; a single joint is a `Joint`, more are a batch.
    """
    rng = np.random.default_rng(0)
    increments = rng.normal(0.0, 1e-7, (INCREMENT_SETS, n, law.dim))
    increments *= [0.3] + [1.0] * (law.dim - 1)
    increments = np.concatenate([increments, -increments])
    closing = np.zeros((n, law.dim))
    closing[:, 0] = rng.uniform(5e-7, 1.5e-6, n)
    if n == 1:
        joints = law.joint()
        calls = 50
        closing = closing[0]
        increments = increments[:, 0]
    else:
        joints = law.joints(n, track_dissipation=track_dissipation)
        calls = 1
    joints.update(closing, tangent=False)
    steps = cycle(increments)
    timer = Timer(lambda: joints.update(next(steps), tangent=tangent))
    repetitions = max(2, round(seconds / timer.timeit(calls)))
    return 1e9 * min(timer.repeat(repetitions, calls)) / (calls * n)


if __name__ == "__main__":
    run_command(__doc__, named, cost_list, one_plane, tilt_friction, reduced_models)
