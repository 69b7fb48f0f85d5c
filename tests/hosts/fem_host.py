"""Exports a law to finite elements, builds it, and calls its behaviours as MGIS does."""

import ctypes
import subprocess

import numpy as np
from c_host import FAST, STRICT, compiler

import jointlaw as jl

LAW = jl.presets.load("westerly-rough")
SEATING = 1e4  # Pa
NUMBER, TEXT = ctypes.POINTER(ctypes.c_double), ctypes.c_char_p
STATE_VIEW = ("gradients", "forces", "density", "properties", "state", "stored", "dissipated")


class View(ctypes.Structure):
    """`mgis_bv_BehaviourDataView` of MGIS 1.2.2 to 3.1."""

    _fields_ = [
        ("message", TEXT),
        ("dt", ctypes.c_double),
        *((name, NUMBER) for name in ("K", "rdt", "speed_of_sound")),
        *((f"{name}{end}", NUMBER) for end in "01" for name in (*STATE_VIEW, "external")),
    ]


def export(folder, law=LAW, level="-O3", target="all"):
    """Export a law as rock and build its libraries, without a warning."""
    compiler("cc")
    jl.export_fem(law, folder, "rock", SEATING)
    quiet = ["-Wno-psabi", "-Wno-maybe-uninitialized"]  # of the header, not of these files
    flags = f"CFLAGS={' '.join([level, '-std=c99', *FAST[1:], *STRICT, *quiet])}"
    done = subprocess.run(["make", "-C", folder, target, flags], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def is_the_test_in_python(slip, opening, shear, pressed, turn):
    """Direct shear of a host at 2 MPa, from step `pressed` forth to step `turn`, then back."""
    joint = LAW.joint(normal_stress=SEATING)
    start = joint.delta[0]
    forth = jl.direct_shear(joint, slip[turn], normal=2e6, steps=turn - pressed)
    back = jl.direct_shear(joint, slip[-1] - slip[turn], normal=2e6, steps=len(slip) - 1 - turn)
    peak, rise = forth.shear_stress.max(), np.ptp(forth.closure)
    for rows, record in ((slice(pressed, turn + 1), forth), (slice(turn, None), back)):
        assert np.abs(shear[rows] - record.shear_stress).max() < 1e-3 * peak
        assert np.abs(opening[rows] - (start - record.closure)).max() < 1e-3 * rise
    assert forth.shear_stress[-1] - back.shear_stress[-1] > peak / 2, "the way back must differ"


class Behaviour:
    """One point of a behaviour, loaded by its symbols; `update` and `revert` as a host has them."""

    def __init__(self, folder, name="rock", hypothesis="Tridimensional", properties=()):
        self.lib, self.name = ctypes.CDLL(str(folder / "librock_mgis.so")), name
        self.function = self.lib[f"{name}_{hypothesis}"]
        size = {
            1: {"Tridimensional": 6}.get(hypothesis, 4),
            2: 3 - (hypothesis != "Tridimensional"),
        }
        self.size = n = size[self.types("Gradients")[0]]
        rows, made = self.number("nInternalStateVariables"), np.zeros
        self.old = {"gradients": made(n), "forces": made(n), "state": made(rows)}
        self.old |= {"properties": np.array(properties, float), "stored": made(1)}
        self.old |= {"dissipated": made(1), "density": made(1), "external": made(1)}
        self.new = {key: value.copy() for key, value in self.old.items()}
        self.state = self.new["state"]
        self.rdt, self.message = np.ones(1), ctypes.create_string_buffer(512)

    def number(self, name):
        return ctypes.c_ushort.in_dll(self.lib, f"{self.name}_{name}").value

    def text(self, name):
        return TEXT.in_dll(self.lib, f"{self.name}_{name}").value.decode()

    def names(self, name):
        array = (TEXT * self.number(f"n{name}")).in_dll(self.lib, f"{self.name}_{name}")
        return [word.decode() for word in array]

    def types(self, name):
        array = ctypes.c_int * self.number(f"n{name}")
        return list(array.in_dll(self.lib, f"{self.name}_{name}Types"))

    def integrate(self, gradients, want=4.0):
        """What the function returns, and K (size, size), NaN where it was not written."""
        self.new["gradients"][:] = gradients
        K = np.full((self.size, self.size), np.nan)
        K[0, 0] = want
        view = View(dt=1.0, K=at(K), rdt=at(self.rdt), speed_of_sound=at(np.zeros(1)))
        view.message = ctypes.addressof(self.message)
        for end, data in enumerate((self.old, self.new)):
            for key, array in data.items():
                setattr(view, f"{key}{end}", at(array))
        return self.function(ctypes.byref(view)), K

    def update(self):
        for key, array in self.new.items():
            self.old[key][:] = array

    def step(self, by):
        """Advance by a difference of gradients; forces and K."""
        done, K = self.integrate(self.old["gradients"] + by)
        assert done == 1, self.message.value.decode()
        self.update()
        return self.new["forces"].copy(), K

    @property
    def energies(self):
        """Stored and dissipated, J/m2 or J/m3."""
        return [self.new["stored"][0], self.new["dissipated"][0]]


class Umat:
    """One point of the UMAT, with n components."""

    def __init__(self, folder, n):
        self.function, self.size = ctypes.CDLL(str(folder / "librock_umat.so")).umat_, n
        self.stress, self.state, self.K = (
            np.zeros(n),
            np.zeros(LAW.state_size + 1),
            np.zeros((n, n)),
        )
        self.energies, self.pnewdt = np.zeros(2), np.ones(1)

    def step(self, by, rows=LAW.state_size + 1):
        """Advance by an increment of the jump; stress and K."""
        arguments, by = [None] * 37, np.ascontiguousarray(by)
        numbers = self.stress, self.state, self.K, self.energies[:1], self.energies[1:]
        arguments[:5] = map(at, numbers)
        arguments[11], arguments[27] = at(by), at(self.pnewdt)
        for place, whole in ((21, self.size), (22, rows), (24, 0)):
            arguments[place] = ctypes.byref(ctypes.c_int(whole))
        self.function(*arguments)
        return self.stress.copy(), self.K.T.copy()  # its columns come first in Fortran


def at(array):
    """Pointer to an array's numbers."""
    return array.ctypes.data_as(NUMBER)
