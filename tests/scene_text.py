"""Parts of scenes as text: laws, blocks, and a block on a fixed base."""

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
    """Keys of a table in TOML, one a line."""
    values = {key: json.dumps(value, default=np.ndarray.tolist) for key, value in keys.items()}
    return "".join(f"{key} = {values[key].replace('Infinity', 'inf')}\n" for key in keys)


def coulomb(friction=0.7, normal=1e10, shear=5e9, **more):
    """Keys of a Coulomb law."""
    strength = {"normal_stiffness": normal, "shear_stiffness": shear, "friction": friction}
    return lines(kind="coulomb", **strength, **more)


PLAIN = coulomb(0.3, 1e9, 1e9)


def block(name, **keys):
    """A block with `box` and `at`, or with `corners`."""
    return "[[block]]\n" + lines(name=name, **keys)


def dipping(degrees):
    """Gravity (m/s2) in the frame of a slope that dips to the right."""
    dip = np.radians(degrees)
    return (9.81 * np.array([np.sin(dip), -np.cos(dip)])).tolist()


def on_base(law, box, dip=0.0, base=(12.0, 1.0), at=None, end=1.0, **more):
    """A block on a fixed base whose top is y = 0, with gravity as on a slope of dip (degrees).

    The text ends in the table [run]. at: centre of the block, by default above the centre of the
    base; more: keys of the block.
    """
    base_centre = [0.0, -0.5 * base[1]]
    centre = at or [0.0, 0.5 * box[1]]
    text = lines(gravity=dipping(dip)) + f"[laws.rock]\n{law}"
    text += block("base", box=base, at=base_centre, fixed=True)
    return text + block("block", box=box, at=centre, **more) + f"[run]\nend = {end}\n"
