"""The exported script in the real Kratos, against the laboratory test in Python."""

import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
from fem_host import LAW, SEATING, is_the_test_in_python

PRESSED, TURN = 9, 49  # rows


def test_direct_shear_of_two_blocks_with_an_interface_element(finite_elements):
    if find_spec("KratosMultiphysics") is None:
        pytest.skip("Kratos is not installed (pip install 'jointlaw[fem]')")
    command, folder = [sys.executable, "kratos.py"], finite_elements
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    test = np.genfromtxt(folder / "kratos.csv", delimiter=",", names=True)
    assert test["iterations"].max() <= 6
    # closure: each load, on a joint of its own
    loads = -test["normal_Pa"][: PRESSED + 1]
    closed = LAW.closure(SEATING) - test["opening_m"][: PRESSED + 1]
    assert np.abs(loads / LAW.normal_stress(closed) - 1).max() < 1e-3
    assert np.abs(loads / np.linspace(2e5, 2e6, PRESSED + 1) - 1).max() < 1e-3
    is_the_test_in_python(test["slip_m"], test["opening_m"], test["shear_Pa"], PRESSED, TURN)
