"""Two empirical closure laws, fitted to the points that the joint law is fitted to.

    python docs/measure/baselines.py

    power law        stress = s (closure + u0)^n                       three parameters
    Barton-Bandis    stress = k (closure + u0)/(1 - (closure + u0)/V)  three parameters

(Bandis, Lumsden & Barton 1983 for the hyperbola.) u0 is the closure before the test began. Both
are fitted to the stress itself, the usual way and the one that serves them best beyond the data:
fitted to its logarithm, as the joint law is, the hyperbola runs away even earlier. Printed are the
errors on the Grimsel fracture above 5.3 MPa, which the fits did not see; and the range of those of
the joint law over nine choices: three priors of alpha, and data up to three stresses. Then the
same with the deformation of rock and machine taken off, of which the measured closure is a third.
"""

import numpy as np
from scipy.optimize import least_squares
from tables import asked, table

import jointlaw as jl
from jointlaw.calibration import datasets
from jointlaw.calibration.measured import first_loading


def power_law(q, x):
    """Stress at closures, both as shares of those at the last point, by logarithms (3,)."""
    return np.exp(q[0]) * (np.exp(q[1]) + x) ** np.exp(q[2])


def barton_bandis(q, x):
    """The same by the hyperbola, whose largest closure lies beyond the last point."""
    offset = np.exp(q[1])
    y, largest = x + offset, (1 + offset) * (1 + np.exp(q[2]))
    return np.where(y < largest, np.exp(q[0]) * y / np.maximum(1 - y / largest, 1e-9), np.inf)


LAWS = {"power law": power_law, "Barton-Bandis": barton_bandis}


def fitted(name, stress, closure):
    """Stress (Pa) by closure (m): the law of this name of least squares through points (n,)."""
    law, first, span = LAWS[name], closure[0], closure[-1] - closure[0]
    x, share = (closure - first) / span, stress / stress[-1]
    starts = [
        (-n * np.log1p(o), np.log(o), np.log(n))
        for o in (0.02, 0.2, 2.0)
        for n in (0.05, 0.5, 1.5, 4.0)
    ]
    bounds = ([-60, -12, -12], [60, 8, 8])
    fits = [
        least_squares(lambda q: law(q, x) - share, start, bounds=bounds, x_scale="jac", xtol=1e-12)
        for start in starts
    ]
    best = min(fits, key=lambda fit: fit.cost).x
    return lambda closure: stress[-1] * law(best, (closure - first) / span)


CHOICES = [(top, alpha) for top in (3.2e6, 4.2e6, 5.3e6) for alpha in ((0, 20), (1, 10), (0, 100))]


ROCK = 42.8e-6 / 10.27e6  # m/Pa: of the rock and the machine of this specimen


def main():
    stress, measured = first_loading(*datasets.load("grimsel_vd1_closure"))
    rows, seen = [], stress <= 5.3e6
    for what, closure in (("", measured), ("fracture alone: ", measured - ROCK * stress)):
        points = stress[seen], closure[seen]
        laws = {"jointlaw": jl.fit_curves([jl.ClosureCurve(*points)]).predict}
        laws |= {name: fitted(name, *points) for name in LAWS}
        for name, law in laws.items():
            error = 100 * (law(closure[~seen]) / stress[~seen] - 1)
            rms = np.sqrt(np.mean(error**2))
            rows.append([what + name, f"{error[-1]:+.1f} %", f"{rms:.1f} %"])
        choices = []
        for top, alpha in CHOICES:
            curve = jl.ClosureCurve(stress[stress <= top], closure[stress <= top])
            fit = jl.fit_curves([curve], priors={"alpha": alpha})
            choices.append(100 * (fit.predict(closure[-1]) / stress[-1] - 1))
        spread = f"{min(choices):+.1f} to {max(choices):+.1f} %"
        rows.append([f"{what}jointlaw, nine choices", spread, ""])
    print(table(["law", "error at 10.3 MPa", "rms from 6 to 10.3 MPa"], rows))


if __name__ == "__main__":
    asked(__doc__)
    main()
