"""Shared by the tests of all hosts: the mark, the LAMMPS plug-in, finite-element libraries."""

from pathlib import Path

import pytest
from fem_host import export
from lammps_host import build


def pytest_collection_modifyitems(items):
    """Every test with a host is slow: hosts are installed apart, and start slowly."""
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents:
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def plugin(tmp_path_factory):
    """A folder with LAMMPS' plug-in, built, and NAME.jlaw of each of `lammps_host.LAWS`."""
    folder = tmp_path_factory.mktemp("lammps")
    build(folder / "other", "-O0 -DJOINTLAW_LAMMPS=20240829")  # for another LAMMPS
    return build(folder)


@pytest.fixture(scope="session")
def finite_elements(tmp_path_factory):
    """A folder with the libraries of `fem_host.LAW` for MGIS and UMAT, built."""
    return export(tmp_path_factory.mktemp("fem"))
