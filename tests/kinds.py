"""The kinds of joints that the code knows, one law each: every test that goes through them does so
by this list."""

import math

import jointlaw as jl


def make_law(
    a=3.0, b=0.5, c=0.1, K=2.0e8, lam=1.2, eta=0.5, mu=0.3, heights="population", damage=(), **more
) -> jl.JointLaw:
    """Smooth Westerly granite at the coarsest resolution, any parameter to be replaced."""
    if isinstance(heights, str):
        heights = jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6, formation=heights)
    defaults = {"asperity_density": 1e10, "closure_range": 1e-6, "resolution": "fast"}
    return jl.JointLaw(
        orientation=jl.Orientation(a, b, c),
        asperity=jl.Asperity(K=K, lam=lam, eta=eta, mu=mu, **dict(damage)),
        heights=heights,
        **(defaults | more),
    )


HISTOGRAM = jl.Heights(([1, 3, 2], [0.0, 2e-6, 5e-6, 8e-6]), overlap=2e-6)
LAWS = {
    "population": make_law(),
    "individual": make_law(heights="individual", lam=0.7),
    "histogram": make_law(heights=HISTOGRAM),
    "no heights": make_law(heights=None, a=1.0, b=-1.0, c=0.5),
    "linear": make_law(heights=None, eta=0.0, a=1.0, mu=0.0),
    "plane": make_law(plane=0.4),
    "mating length": make_law(mating_length=2e-6, plane=math.pi),
    "yielding": make_law(mating_length=2e-6, damage={"yield_interference": 2e-7}),
    "wear": make_law(plane=0.4, mating_length=2e-6, slope_wear=100.0, slope_residual=0.1),
    "closure only": make_law(closure_only=True, mating_length=2e-6),
    "bond": make_law(bond=jl.Bond(1e12, 1e12, 5e4, 1e5, 5e-3, 2e-2)),
    "coulomb": jl.CoulombLaw(1e12, 5e11, 0.6, 1e5, 5e4, 0.5, 2e4, 1e-6),
    "coulomb in a plane": jl.CoulombLaw(1e12, 5e11, 0.6, 1e5, plane=0.0),
}
