"""How the dissipated energy and the asperity degradation of a joint depend on the size of the step.

    python docs/measure/dissipation.py [--laws 24] [--seed 1]

Random laws in units of their closure range, half with a mating length, are closed and sheared on
six legs of random direction, each in 1 to 30 steps. The table gives `dissipated_energy` over the
energy that is lost, the work along the path of each step less the stored energy, as the median, the
smallest and the largest value of the laws. Then the law of `from_field` (JRC 10, JCS 100 MPa, at 1
MPa) is sheared to and fro, ten times, from a sixteenth to a quarter of its mating length on both
sides, in the same numbers of steps: the lost fraction of its slopes over the fraction in 128 steps.
"""

from dataclasses import replace

import numpy as np
from common import run_command
from energy_gain import integration_rules, random_law

import jointlaw as jl
from jointlaw.joints.state import JointState

STEPS = 1, 3, 10, 30  # per leg
LEGS = 6
POINTS_PER_LEG = 60  # panels of the integral of the work
AMPLITUDES = 16, 8, 4  # mating length over amplitude
ROUNDS = 10
FINE_STEPS = 128
MIN_LOSS = 1e-3  # of the work: laws that lose less have no ratio


def random_legs(law, rng):
    """Legs (LEGS, dim) of a path that stays closed, in closure ranges or mating lengths."""
    length = min(1.0, law.mating_length)
    closures = rng.uniform(0.2, 1.0, LEGS)
    shear = (
        rng.normal(size=(LEGS, law.dim - 1)) * length * 10.0 ** rng.uniform(-1.0, 0.0, (LEGS, 1))
    )
    return np.column_stack([np.diff(closures, prepend=0.0), shear])


def dissipation_ratio(law, legs, steps):
    """Dissipated energy over the loss, not a number if the loss is too small."""
    times, weights = integration_rules(max(1, POINTS_PER_LEG // steps))
    points = law.joints(times.size)
    joint = law.joints(1)
    work = 0.0
    for increment in np.repeat(legs / steps, steps, axis=0):
        values = np.repeat(joint.snapshot().values, times.size, axis=0)
        points.restore(JointState(law.fingerprint, values))
        F = points.trial(times[:, None] * increment, tangent=False)[0]
        work += weights[0] @ (F @ increment)
        joint.update(increment[None], tangent=False)
    loss = work - joint.stored_energy[0]
    return joint.dissipated_energy[0] / loss if loss > MIN_LOSS * abs(work) else np.nan


def lost_slopes(law, amplitude, steps):
    """Lost fraction of the slopes after ROUNDS shear cycles, in so many steps from side to side."""
    joint = law.joint()
    joint.update([law.closure(1e6), 0.0])
    joint.update([0.0, amplitude])
    for _ in range(ROUNDS):
        for direction in (-1.0, 1.0):
            for _ in range(steps):
                joint.update([0.0, direction * 2.0 * amplitude / steps], tangent=False)
    return 1.0 - joint.slope_retention


def step_sizes(laws=24, seed=1):
    rng = np.random.default_rng(seed)
    ratios = {steps: [] for steps in STEPS}
    for number in range(laws):
        law = random_law(rng)
        if number % 2:
            law = replace(law, mating_length=np.inf, slope_wear=np.inf)
        legs = random_legs(law, rng)
        for steps, values in ratios.items():
            values.append(dissipation_ratio(law, legs, steps))
    print("| steps a leg | dissipated energy over loss: median | smallest | largest |")
    print("| --- | --- | --- | --- |")
    for steps, values in ratios.items():
        median, low, high = (f(values) for f in (np.nanmedian, np.nanmin, np.nanmax))
        print(f"| {steps} | {median:.2f} | {low:.2f} | {high:.2f} |")
    field_law = jl.from_field(
        jrc=10, jcs=100e6, length=0.1, normal_stress=1e6, normal_stiffness=30e9
    )
    field_law = replace(field_law, plane=0.0)
    for part in AMPLITUDES:
        amplitude = field_law.mating_length / part
        fine = lost_slopes(field_law, amplitude, FINE_STEPS)
        lost = [f"{lost_slopes(field_law, amplitude, steps) / fine:.2f}" for steps in STEPS]
        print(f"cycles of {2 / part:g} D, lost slopes over {fine:.2f}: {', '.join(lost)}")


if __name__ == "__main__":
    run_command(__doc__, step_sizes)
