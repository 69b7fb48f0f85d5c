"""Exports a law to finite elements, builds it, and calls its behaviours as MGIS does."""

import ctypes

import numpy as np
from c_host import FAST, STRICT, at
from programs import find_program, run_program

import jointlaw as jl

LAW = jl.presets.load("westerly-rough")
SEATING = 1e4  # Pa
STATE_VIEW = (
    "gradients", "forces", "density", "properties", "state", "stored", "dissipated", "external",
)  # fmt: skip


class View(ctypes.Structure):
    """`mgis_bv_BehaviourDataView` of MGIS 1.2.2 to 3.1."""

    _fields_ = [
        ("message", ctypes.c_void_p),
        ("dt", ctypes.c_double),
        *((name, ctypes.c_void_p) for name in ("K", "rdt", "speed_of_sound")),
        *((f"{name}{end}", ctypes.c_void_p) for end in "01" for name in STATE_VIEW),
    ]


def export(folder, law=LAW, level="-O3", target="all"):
    """Export a law as rock and build its libraries, without a warning."""
    jl.export_fem(law, folder, "rock", SEATING)
    quiet = ["-Wno-psabi", "-Wno-maybe-uninitialized"]  # of the header, not of these files
    flags = f"CFLAGS={' '.join([level, '-std=c99', *FAST[1:], *STRICT, *quiet])}"
    run_program(find_program("make"), "-C", folder, target, flags)
    return folder


class Behaviour:
    """A point of a behaviour, loaded by its symbols; it keeps the state of a successful step."""

    def __init__(self, folder, name="rock", hypothesis="Tridimensional", properties=()):
        self.lib = ctypes.CDLL(str(folder / "librock_mgis.so"))
        self.function = self.lib[f"{name}_{hypothesis}"]
        space = hypothesis == "Tridimensional"
        self.size = (3 if space else 2) if name == "rock" else (6 if space else 4)
        rows = ctypes.c_ushort.in_dll(self.lib, f"{name}_nInternalStateVariables").value
        sizes = {"gradients": self.size, "forces": self.size, "state": rows}
        self.old = {key: np.zeros(sizes.get(key, 1)) for key in STATE_VIEW}
        self.old["properties"] = np.array(properties, float)
        self.new = {key: value.copy() for key, value in self.old.items()}
        self.state = self.new["state"]
        self.rdt = np.ones(1)
        self.message = ctypes.create_string_buffer(512)

    def integrate(self, gradients, want=4.0):
        """Integrate; returns the exit status, and K (size, size), NaN where it was not written."""
        self.new["gradients"][:] = gradients
        K = np.full((self.size, self.size), np.nan)
        speed = np.zeros(1)
        K[0, 0] = want
        view = View(dt=1.0, K=at(K), rdt=at(self.rdt), speed_of_sound=at(speed))
        view.message = ctypes.addressof(self.message)
        for end, data in enumerate((self.old, self.new)):
            for key, array in data.items():
                setattr(view, f"{key}{end}", at(array))
        return self.function(ctypes.byref(view)), K

    def step(self, by):
        """Advance by a difference of gradients; forces and K."""
        done, K = self.integrate(self.old["gradients"] + by)
        assert done == 1, self.message.value.decode()
        for key, array in self.new.items():
            self.old[key][:] = array
        return self.new["forces"].copy(), K

    @property
    def energies(self):
        """Stored and dissipated, J/m2 or J/m3."""
        return [self.new["stored"][0], self.new["dissipated"][0]]


class Umat:
    """One point of the UMAT, with n components."""

    def __init__(self, folder, n):
        self.function = ctypes.CDLL(str(folder / "librock_umat.so")).umat_
        self.size = n
        self.stress, self.state, self.K = map(np.zeros, (n, LAW.state_size + 1, (n, n)))
        self.energies = np.zeros(2)
        self.pnewdt = np.ones(1)

    def step(self, by, rows=LAW.state_size + 1):
        """Advance by an increment of the jump; stress and K."""
        arguments = [None] * 37
        by = np.ascontiguousarray(by)
        numbers = self.stress, self.state, self.K, self.energies[:1], self.energies[1:]
        arguments[:5] = map(at, numbers)
        arguments[11] = at(by)
        arguments[27] = at(self.pnewdt)
        for place, whole in ((21, self.size), (22, rows), (24, 0)):
            arguments[place] = ctypes.byref(ctypes.c_int(whole))
        self.function(*arguments)
        return self.stress.copy(), self.K.T.copy()  # its columns come first in Fortran
