"""Build jointlaw.h with the compilers of this machine, and call it from Python."""

import ctypes
from pathlib import Path

import numpy as np
from programs import find_program, run_program

import jointlaw as jl
from jointlaw.hosts.c.export import table_text
from jointlaw.native.build import BUILT

STRICT = ["-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror"]
FAST = ["-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"]
SOURCE = '#define JOINTLAW_IMPLEMENTATION\n#include "jointlaw.h"\n'
HERE = Path(__file__).parent / "c"


def build(folder, source, *flags, cc="cc", name="program"):
    """Compile a source file or text in the folder; returns the path of the program."""
    path = source
    if not isinstance(source, Path):
        path = folder / ("source.cpp" if cc.endswith("++") else "source.c")
        path.write_text(source)
    run_program(find_program(cc), *flags, f"-I{BUILT}", path, "-o", folder / name, "-lm")
    return folder / name


def library(folder, *flags, cc="cc", more=""):
    """Build jointlaw.h and further source text as a library, without a warning, and load it."""
    flags = ["-shared", "-fPIC", *STRICT, *flags]
    path = build(folder, SOURCE + more, *flags, cc=cc, name="libjointlaw.so")
    lib = ctypes.CDLL(str(path))
    pointer = ctypes.c_void_p
    for function in ("normal_stress", "closure", "max_stiffness"):
        getattr(lib, f"jlaw_{function}").argtypes = [pointer, ctypes.c_double]
    lib.jlaw_preload.argtypes = [pointer, pointer, ctypes.c_double, pointer]
    lib.jlaw_rotate.argtypes = [pointer, pointer, ctypes.c_double]
    for function in (
        "normal_stress",
        "closure",
        "max_stiffness",
        "stored_energy",
        "dissipated_energy",
        "tensile_opening",
    ):
        getattr(lib, f"jlaw_{function}").restype = ctypes.c_double
    lib.jlaw_read.restype = pointer
    lib.jlaw_fingerprint.restype = ctypes.c_char_p
    return lib


class CLaw:
    """A law in C, with one joint's state."""

    def __init__(self, lib, law, folder):
        file = folder / "law.jlaw"
        file.write_text(table_text(law))
        self.lib = lib
        self.message = ctypes.create_string_buffer(300)
        self.law = ctypes.c_void_p(lib.jlaw_read(str(file).encode(), self.message, 300))
        assert self.law, self.message.value.decode()
        self.dim = lib.jlaw_dim(self.law)
        self.state = np.zeros(lib.jlaw_state_size(self.law))

    def step(self, d, tangent=True, keep=True):
        """Advance the joint; returns F and C. Raises ValueError for an invalid step."""
        d = np.ascontiguousarray(d, float)
        F = np.full(self.dim, 4711.0)
        C = np.full((self.dim, self.dim), 4711.0)
        new = self.state if keep else self.state.copy()
        if self.lib.jlaw_update(
            self.law, at(self.state), at(new), at(d), at(F), at(C) if tangent else None,
            self.message, 300,
        ):  # fmt: skip
            assert (F == 4711.0).all()
            raise ValueError(self.message.value.decode())
        return F, C

    def preload(self, normal_stress):
        """Close the virgin joint to a normal stress; returns F. Raises ValueError if it cannot."""
        F = np.full(self.dim, 4711.0)
        if self.lib.jlaw_preload(self.law, at(self.state), normal_stress, at(F)):
            assert not F.any()
            assert not self.state.any()
            raise ValueError("no closure bears this normal stress")
        return F

    def measures(self):
        """Fractions sliding, slipping and separated; stored and dissipated energy."""
        shares = np.zeros(3)
        state = at(self.state)
        self.lib.jlaw_contact_fractions(self.law, state, at(shares))
        energies = (
            f(self.law, state)
            for f in (self.lib.jlaw_stored_energy, self.lib.jlaw_dissipated_energy)
        )
        return [*shares, *energies]


def at(array):
    """Pointer to an array's numbers."""
    return ctypes.c_void_p(array.ctypes.data)


def random_law(seed):
    """A law of any kind; every choice occurs within a few consecutive seeds."""
    rng = np.random.default_rng(seed)
    formation = [None, "population", "individual"][seed % 3]
    eta = [0.5, 0.0, 1.0, 0.37, 0.5][seed % 5]
    if formation == "population" and eta == 0.0:
        eta = 0.8  # not convex
    heights = formation and jl.GammaHeights(3.82, 1.15e-6, 2e-6, formation)
    if seed % 7 == 6:  # a density infinite at the point of contact
        heights = jl.GammaHeights(-0.6, 3e-6, 0.0, "individual")
    kind = {"closure_only": True} if seed % 8 == 5 else {"plane": [None, 0.0, 0.7][seed // 2 % 3]}
    mu = [0.0, 0.3, 0.7][rng.integers(3)]
    damage = {"yield_interference": 10.0 ** rng.uniform(-8.0, -6.0)} if seed // 4 % 2 else {}
    kind["mating_length"] = [np.inf, 8e-7][seed % 2]
    if mu and seed // 5 % 3 == 1:
        kind |= {"mating_length": 8e-7, "slope_residual": rng.uniform()}
        kind["slope_wear"] = 10.0 ** rng.uniform(1.0, 4.0)
    bond = random_bond(np.random.default_rng(seed)) if seed % 7 in (2, 5, 6) else None
    return jl.JointLaw(
        orientation=jl.Orientation(
            rng.uniform(1.0, 6.0), rng.uniform(-0.4, 0.8), rng.uniform(-0.15, 0.15)
        ),
        asperity=jl.Asperity(2e8, rng.uniform(0.5, 2.0), eta, mu, **damage),
        heights=heights,
        asperity_density=1e10,
        closure_range=1e-6,
        resolution=jl.Resolution(int(rng.integers(1, 4)), int(rng.integers(3, 6)), 1 + seed % 6),
        bond=bond,
        **kind,
    )


def random_bond(rng):
    """A bond that fails on `random_path`, brittle or not in each mode."""
    stiffness = 10.0 ** rng.uniform(9.0, 12.0, 2)
    length = 10.0 ** rng.uniform(-8.0, -6.0, 2)
    elastic = 0.5 * stiffness * length**2
    energies = np.where(rng.random(2) < 0.3, 1.0, 10.0 ** rng.uniform(0.0, 2.0, 2)) * elastic
    return jl.Bond(*stiffness, *(stiffness * length), *energies)


def random_path(dim, seed, steps=60):
    """Increments (steps, dim) of all sizes, with separation and new contact and exact zeros."""
    rng = np.random.default_rng(1000 + seed)
    d = rng.normal(size=(steps, dim)) * 10.0 ** rng.uniform(-9.0, -6.0, (steps, 1))
    d[0, 0] = 5e-7
    d[:, 0] += 3e-8
    d[rng.integers(0, steps, 4), 0] = -1.5e-6
    d[rng.integers(1, steps, 6)] = 0.0
    for component in range(dim):
        d[rng.integers(1, steps, 6), component] = 0.0
    d[rng.integers(1, steps, 5), 1:] = 0.0
    return d
