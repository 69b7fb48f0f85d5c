"""Steps of blocks."""


def steps(sim, count, see=lambda: None):
    """Take so many steps; what `see` gives after each."""
    seen = []
    for _ in range(count):
        sim.step()
        seen.append(see())
    return seen


def until(sim, time, see=lambda: None):
    """Step on to a time (s); what `see` gives after each step."""
    seen = []
    while sim.time < time:
        seen += steps(sim, 1, see)
    return seen
