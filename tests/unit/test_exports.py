"""The table of hosts, and exports of laws whose parameters no law file can hold."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from kinds import ExponentialHeights, make_law

import jointlaw as jl
from jointlaw.hosts import HOSTS
from jointlaw.parameters.heights import KINDS

ROOT = Path(__file__).parents[2]
LAW = make_law(heights=ExponentialHeights(1e-6), c=0.0)


def slug(heading):
    """The anchor of a heading of a page."""
    return re.sub(r"[^a-z0-9 -]", "", heading.lower()).replace(" ", "-")


@pytest.mark.parametrize("host", HOSTS.values(), ids=HOSTS)
def test_a_host_is_in_the_package_the_readme_and_the_guide(host):
    assert host.function in jl.__all__
    assert getattr(jl, host.function) is host.load(host.function)
    assert f"`jointlaw export {host.name} PRESET --out DIR`" in (ROOT / "README.md").read_text()
    page, _, anchor = host.guide.partition("#")
    guide = (ROOT / "docs" / page).read_text()
    assert f"jointlaw export {host.name} " in guide
    headings = re.findall(r"^#+ (.*)$", guide, re.MULTILINE)
    assert not anchor or anchor in map(slug, headings)


@pytest.mark.parametrize("host", HOSTS.values(), ids=HOSTS)
def test_heights_of_a_class_of_the_user_are_exported(host, tmp_path):
    (tmp_path / "law.toml").write_text("an earlier export")
    host.load(host.function)(LAW, tmp_path)
    reason = "no file can name ExponentialHeights"
    with pytest.raises(ValueError, match=reason):
        LAW.to_toml()
    if host.name in ("yade", "lammps"):  # the other hosts have no law.toml
        assert not (tmp_path / "law.toml").exists()
    texts = [path.read_text(errors="replace") for path in tmp_path.iterdir()]
    assert any(reason in text for text in texts)
    if host.name == "yade":
        assert "law.toml" not in json.loads((tmp_path / "summary.json").read_text())["files"]


def test_a_table_of_such_a_law_is_saved_and_read(tmp_path):
    table = jl.tabulate(LAW, azimuths=3, tolerance=1e-2)
    table.save(tmp_path / "joint.txt")
    read = jl.load_table(tmp_path / "joint.txt")
    np.testing.assert_array_equal(read.normal_stress, table.normal_stress)
    # between rows the table interpolates to the tolerance, relative to the stress of the law
    closure = 0.37 * table.closure[-1]
    assert read.lookup(closure).normal_stress == pytest.approx(LAW.normal_stress(closure), rel=1e-2)


def test_a_named_class_without_declared_parameters_writes_no_law_file(monkeypatch):
    """Its file would lack them, and be read with other values."""
    monkeypatch.setitem(KINDS, "exponential", ExponentialHeights)
    with pytest.raises(ValueError, match="scale of ExponentialHeights is no declared parameter"):
        LAW.to_toml()
