"""What the tests of all hosts share: the mark, and LAMMPS' plug-in."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from lammps_host import build, soft


def pytest_collection_modifyitems(items):
    """Every test with a host is slow: hosts are installed apart, and start slowly."""
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents:
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def plugin(tmp_path_factory):
    """A folder with LAMMPS' plug-in, built, and rock.jlaw, a soft joint in space."""
    return build(tmp_path_factory.mktemp("lammps"), soft())
