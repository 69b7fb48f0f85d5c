"""Advance simulations of blocks."""


def steps(sim, count, observe=lambda: None):
    """Take `count` steps; list of the results of `observe` after each."""
    observed = []
    for _ in range(count):
        sim.step()
        observed.append(observe())
    return observed


def until(sim, time, observe=lambda: None):
    """Step to a time (s); list of the results of `observe` after each step."""
    observed = []
    while sim.time < time:
        observed += steps(sim, 1, observe)
    return observed
