"""Work along steps: an adaptive quadrature that finds the places where anything changes branch."""

import numpy as np

# Lobatto's rule of four points on 0 to 1, which looks at both ends of each part
_X, _W = [0.0, 0.5 - 0.05**0.5, 0.5 + 0.05**0.5, 1.0], np.array([1, 5, 5, 1]) / 12
# a step may change branch at once
_EDGES = np.array([0.0, *np.geomspace(1e-5, 1.0, 20)])


def work(power, exact):
    """int_0^1 power(j, t) dt (n,) of n steps, to about exact (n,).

    power: of the steps j (m,) at their times t (m,), what they do per time (m,).
    """

    def rule(j, a, b):
        return (b - a) * sum(w * power(j, a + x * (b - a)) for x, w in zip(_X, _W, strict=True))

    n, total = len(exact), np.zeros(len(exact))
    j, a, b = np.tile(np.arange(n), 20), np.repeat(_EDGES[:-1], n), np.repeat(_EDGES[1:], n)
    whole = rule(j, a, b)
    while len(j):
        middle = 0.5 * (a + b)
        left, right = rule(j, a, middle), rule(j, middle, b)
        good = (np.abs(left + right - whole) <= exact[j]) | (b - a < 1e-14)
        np.add.at(total, j[good], (left + right)[good])
        j, whole = np.tile(j[~good], 2), np.concatenate([left[~good], right[~good]])
        a, b = np.concatenate([[a, middle], [middle, b]], axis=1)[:, np.tile(~good, 2)]
    return total


def work_of_step(element, delta, d, state, exact):
    """Work (n,) of the tractions of an element that the steps t d (dim, n) lead to, t from 0 to 1,
    from places delta (dim, n) and states (rows, n)."""

    def power(j, t):
        new = state[:, j].copy()
        F = element.step(delta[:, j], t * d[:, j], state[:, j], new, False).F
        return np.sum(F * d[:, j], axis=0)

    return work(power, exact)
