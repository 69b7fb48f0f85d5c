"""Every file that a program reads back carries a version; specimens of each are kept and read.

`specimens/` holds what the first release writes. A change of a format keeps them and adds new ones
beside them; a version that is no longer read is refused with the remedy.
"""

from pathlib import Path

import pytest

import jointlaw as jl
from jointlaw.joints.state import JointState

SPECIMENS = Path(__file__).with_name("specimens")
TRACTION = [63304360.5971507, 23287604.80354232, 7718342.099482712]  # Pa, of state.npz


@pytest.fixture(scope="module")
def law():
    return jl.JointLaw.from_toml(SPECIMENS / "law.toml")


def test_a_state_of_version_1(law):
    joint = law.joint()
    joint.restore(jl.load_state(SPECIMENS / "state.npz"))
    assert joint.delta == pytest.approx([5e-7, 3e-7, 1e-7])
    assert pytest.approx(TRACTION, rel=1e-9) == joint.F


def test_a_state_of_another_discretisation_is_refused(law):
    state = law.joint().snapshot()
    version, _, parameters = state.fingerprint.partition(":")
    other = JointState(f"{int(version) + 1}:{parameters}", state.values)
    with pytest.raises(ValueError, match="run the path again, or install the version"):
        law.joint().restore(other)
