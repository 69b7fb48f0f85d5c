"""Laws that the unit tests share, and how Hypothesis runs here."""

import math

import hypothesis
import pytest

import jointlaw as jl

# Derandomized: the same cases on every machine, so that a failure is a change of the code.
hypothesis.settings.register_profile(
    "jointlaw", deadline=None, max_examples=40, derandomize=True, database=None
)
hypothesis.settings.load_profile("jointlaw")


def _make_law(
    a=3.0, b=0.5, c=0.1, K=2.0e8, lam=1.2, eta=0.5, mu=0.3, heights="population", damage=(), **more
) -> jl.JointLaw:
    if isinstance(heights, str):
        heights = jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6, formation=heights)
    defaults = {"asperity_density": 1e10, "closure_range": 1e-6, "resolution": "fast"}
    return jl.JointLaw(
        orientation=jl.Orientation(a, b, c),
        asperity=jl.Asperity(K=K, lam=lam, eta=eta, mu=mu, **dict(damage)),
        heights=heights,
        **(defaults | more),
    )


@pytest.fixture(scope="session")
def make_law():
    """Smooth Westerly granite at the coarsest resolution, any parameter to be replaced."""
    return _make_law


@pytest.fixture(scope="session")
def law():
    return _make_law()


KINDS = {
    "population": {},
    "individual": {"heights": "individual", "lam": 0.7},
    "no heights": {"heights": None, "a": 1.0, "b": -1.0, "c": 0.5},
    "linear": {"heights": None, "eta": 0.0, "a": 1.0, "mu": 0.0},
    "plane": {"plane": 0.4},
    "mating length": {"mating_length": 2e-6, "plane": math.pi},
    "yielding": {"mating_length": 2e-6, "damage": {"yield_interference": 2e-7}},
    "wear": {"plane": 0.4, "mating_length": 2e-6, "slope_wear": 100.0, "slope_residual": 0.1},
    "closure only": {"closure_only": True, "mating_length": 2e-6},
    "bond": {"bond": jl.Bond(1e12, 1e12, 5e4, 1e5, 5e-3, 2e-2)},
}


@pytest.fixture(scope="session", params=KINDS)
def any_law(request):
    """One law of each kind of joint that the code knows."""
    return _make_law(**KINDS[request.param])


@pytest.fixture(scope="session", params=[kind for kind in KINDS if kind != "closure only"])
def any_sheared_law(request):
    """One law of each kind that can shear."""
    return _make_law(**KINDS[request.param])


@pytest.fixture
def moved(law):
    """A batch of five joints, each somewhere else on its path."""
    batch = law.joints(5)
    batch.update([[1e-7 * (i + 1), 5e-8 * i, -2e-8 * i] for i in range(5)])
    return batch
