"""Parts of scenes that several tests write: laws, blocks, and a block on a fixed base."""

import json

import numpy as np

ROCK = """\
asperity_density = 1e4
mating_length = 2e-3
orientation = { a = 3.0 }
asperity = { K = 9.5e6, lam = 1.2, eta = 0.5, mu = 0.4 }
heights = { alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }
"""


def lines(**keys):
    """Keys of a table, a line each."""
    said = {key: json.dumps(value, default=np.ndarray.tolist) for key, value in keys.items()}
    return "".join(f"{key} = {said[key].replace('Infinity', 'inf')}\n" for key in keys)


def coulomb(friction=0.7, normal=1e10, shear=5e9, **more):
    """Keys of a Coulomb law."""
    given = {"normal_stiffness": normal, "shear_stiffness": shear, "friction": friction}
    return lines(kind="coulomb", **given, **more)


PLAIN = coulomb(0.3, 1e9, 1e9)


def block(name, **keys):
    """A block, of `box` and `at` or of `corners`."""
    return "[[block]]\n" + lines(name=name, **keys)


def dipping(degrees):
    """Gravity (m/s2) in the frame of a slope that falls to the right."""
    return (9.81 * np.array([np.sin(np.radians(degrees)), -np.cos(np.radians(degrees))])).tolist()


def on_base(law, box, dip=0.0, base=(12.0, 1.0), at=None, end=1.0, **more):
    """A block on a fixed base whose top is y = 0, with gravity as on a slope of dip (degrees). The
    text ends in the table [run]. more: keys of the block."""
    base_at, at = [0.0, -0.5 * base[1]], at or [0.0, 0.5 * box[1]]
    text = lines(gravity=dipping(dip)) + f"[laws.rock]\n{law}"
    text += block("base", box=base, at=base_at, fixed=True)
    return text + block("block", box=box, at=at, **more) + f"[run]\nend = {end}\n"
