"""The numpy peer of benchmarks/peers.py is the law: springs of the slow bed, and finer ones."""

import sys
from pathlib import Path

import numpy as np
import pytest
from builders import law, slow_heights
from slow_bed import SlowBed, cap_quadrature

from jointlaw.accuracy.suite import errors, standard_suite

sys.path.append(str(Path(__file__).parents[2] / "benchmarks"))
from plain_bed import PlainBed, even, tuned


def test_tuned_springs_are_those_of_the_slow_bed():
    one = law(a=3.0, b=0.5, c=0.1, formation="population", plane=0.0)
    rng = np.random.default_rng(5)
    d = rng.normal(0.0, 0.05, (60, 3)) * [1.0, 2.0, 0.0]
    d[0] = [0.6, 0.0, 0.0]
    rule = (2, 6, 30)
    springs = tuned(one, rule)
    normals, weights = cap_quadrature(3.0, 0.5, 0.1, *rule[:2])
    slope = np.tan(np.arccos(normals[:, 0]))
    reach = np.maximum(1.2 * (1.0 + slope), 0.5 + 3.0 * slope)
    slow = SlowBed(normals, weights, reach, K=1.0, lam=1.2, eta=0.5, mu=0.4, density=1.0,
                   heights=slow_heights("population"), n_depth=rule[2])  # fmt: skip
    plain = PlainBed(one, springs, 3)
    for step in d:
        F, G = slow.update(step), plain.update(np.tile(step[:2, None], 3))
        np.testing.assert_allclose(G, np.tile(F[:2, None], 3), rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize(("place", "coarse", "fine"), [(even, 0.06, 0.006), (tuned, 0.04, 0.002)])
def test_springs_converge_on_the_law(place, coarse, fine):
    one = law(a=3.0, b=0.5, c=0.1, formation="population", plane=0.0)
    suite = standard_suite(one)
    found = []
    for rule in ((2, 6, 10), (6, 12, 40)):
        bed = PlainBed(one, place(one, rule), suite.d.shape[1])
        F = np.stack([bed.update(step.T).T for step in suite.d])
        found.append(errors(F, suite.F)[0])
    assert found[0].max() < coarse
    assert found[1].max() < fine
