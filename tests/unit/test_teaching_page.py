"""Numbers and links of docs/teaching.md and of the links to the browser page."""

import re
from pathlib import Path

import numpy as np
import pytest

import jointlaw as jl

DOCS = Path(__file__).parents[2] / "docs"
LAW = jl.presets.load("westerly-smooth")
STRESS = 10e6  # Pa
CLOSURE = float(LAW.closure(STRESS))


@pytest.fixture(scope="module")
def answers():
    """The answers by number, each in one line."""
    text = (DOCS / "teaching.md").read_text(encoding="utf-8").partition("## Answers")[2]
    parts = re.split(r"\n(?=[1-6]\. )", text.partition("## Further")[0].strip())
    return {int(part[0]): " ".join(part.split()) for part in parts}


def loaded_joint():
    """A joint under the normal stress of the page, without shear."""
    joint = LAW.joint()
    jl.direct_shear(joint, 0.0, normal=STRESS, steps=20)
    return joint


def sheared(closures):
    """Record of a shear over this many closures, in 100 steps each."""
    slip = closures * CLOSURE
    return jl.direct_shear(loaded_joint(), slip, normal=STRESS, steps=100 * closures)


def test_touch(answers):
    ratio = float(LAW.closure(STRESS / 2)) / CLOSURE
    assert f"5 MPa is {100 * ratio:.0f} % of the closure at 10 MPa" in answers[1]


def test_stick(answers):
    probe = sheared(1)
    slip = float(np.interp(0.5e6, probe.shear_stress, probe.shear_2))
    joint = loaded_joint()
    initial = joint.dissipated_energy
    record = jl.direct_shear(joint, [slip, 0.0], normal=STRESS, steps=200)
    stress = record.shear_stress[:201]
    work = np.sum(np.diff(record.shear_2[:201]) * (stress[1:] + stress[:-1]) / 2)
    share = (joint.dissipated_energy - initial) / work
    assert f"only {100 * share:.0f} % of the work" in answers[2]
    assert abs(record.shear_stress[-1]) < 0.1 * stress.max()


def test_slip_one_by_one(answers):
    sliding = 100 * sheared(1).sliding
    assert f"0.2 closures {sliding[20]:.0f} %" in answers[3]
    assert f"at 0.5 closures {sliding[50]:.0f} %" in answers[3]


def test_dilate(answers):
    record = sheared(6)
    opening = 1 - record.closure[-1] / record.closure[0]
    shear = 1e-6 * record.shear_stress
    assert f"opened by {100 * opening:.0f} % of its closure" in answers[4]
    assert f"{100 * record.separated[-1]:.0f} % of the facets" in answers[4]
    assert f"rises from {shear[100]:.2f} to {shear[-1]:.2f} MPa" in answers[4]


def test_turn_back_and_turn_the_direction():
    joint = loaded_joint()
    record = jl.direct_shear(joint, [5 * CLOSURE, 3 * CLOSURE], normal=STRESS, steps=500)
    assert record.shear_stress[-1] < 0 < record.shear_stress[500]
    joint = loaded_joint()
    jl.direct_shear(joint, 2 * CLOSURE, normal=STRESS, steps=200)
    forward = joint.F[1]
    jl.direct_shear(joint, CLOSURE, normal=STRESS, azimuth=np.pi / 2, steps=100)
    assert 0 < joint.F[1] < 0.5 * forward


def links():
    """Fragments of all links to the browser page, from the pages and the gallery."""
    files = [*DOCS.glob("*.md"), *(DOCS / "gallery").glob("*.py")]
    text = "".join(path.read_text(encoding="utf-8") for path in files)
    return sorted(set(re.findall(r"browser\.html#([^\s>\"]+)", text)))


def test_links_name_presets_tests_and_steps_that_exist():
    assert len(links()) > 10
    known = {
        "rock": jl.presets.names(),
        "play": ["closure", "shear", "cycle", "opening"],
        "step": [str(step) for step in range(1, 7)],
    }
    for link in links():
        for key, value in (part.split("=") for part in link.split("&")):
            assert value in known[key], link
