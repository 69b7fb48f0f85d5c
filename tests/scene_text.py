"""Parts of scenes that several tests write: the keys of two laws, a joint's and plain Coulomb."""

ROCK = """\
asperity_density = 1e4
mating_length = 2e-3
orientation = { a = 3.0 }
asperity = { K = 9.5e6, lam = 1.2, eta = 0.5, mu = 0.4 }
heights = { alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }
"""

PLAIN = """\
kind = "coulomb"
normal_stiffness = 1e9
shear_stiffness = 1e9
friction = 0.3
"""
