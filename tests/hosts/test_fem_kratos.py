"""The exported script in the real Kratos, against the laboratory test in Python."""

import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from fem_host import LAW, SEATING

import jointlaw as jl

PRESSED, TURN, END = 9, 49, 69  # rows


def run(folder):
    """Rows of the exported script's file."""
    if find_spec("KratosMultiphysics") is None:
        pytest.skip("Kratos is not installed (pip install 'jointlaw[fem]')")
    done = subprocess.run([sys.executable, "kratos.py"], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    test = np.genfromtxt(folder / "kratos.csv", delimiter=",", names=True)
    assert test["iterations"].max() <= 6
    return test


def test_direct_shear_of_two_blocks_with_an_interface_element(finite_elements):
    test = run(finite_elements)
    # closure: each load, on a joint of its own
    loads = -test["normal_Pa"][: PRESSED + 1]
    start = LAW.closure(SEATING)
    closed = start - test["opening_m"][: PRESSED + 1]
    assert np.abs(loads / LAW.normal_stress(closed) - 1).max() < 1e-3
    assert np.abs(loads / np.linspace(2e5, 2e6, PRESSED + 1) - 1).max() < 1e-3
    # shear at a constant normal stress, forth and back
    joint, slip = LAW.joint(normal_stress=SEATING), test["slip_m"]
    forth = jl.direct_shear(joint, slip[TURN], normal=2e6, steps=TURN - PRESSED)
    back = jl.direct_shear(joint, slip[END] - slip[TURN], normal=2e6, steps=END - TURN)
    peak, rise = forth.shear_stress.max(), np.ptp(forth.closure)
    for rows, record in ((slice(PRESSED, TURN + 1), forth), (slice(TURN, END + 1), back)):
        assert np.abs(test["shear_Pa"][rows] - record.shear_stress).max() < 1e-3 * peak
        assert np.abs(test["opening_m"][rows] - (start - record.closure)).max() < 1e-3 * rise
    assert forth.shear_stress[-1] - back.shear_stress[-1] > peak / 2, "the way back must differ"
