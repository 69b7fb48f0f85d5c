"""Parameters are values: equal laws have one fingerprint, files keep every digit. The presets hold
the numbers that the paper prints, in its own units, converted here."""

import dataclasses
import math
import re
import warnings

import kinds
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointlaw as jl
from jointlaw.calibration.priors import PRIORS, TRANSFORMS
from jointlaw.parameters.resolution import (
    NAMED_RESOLUTIONS,
    RESOLUTIONS_LONG,
    RESOLUTIONS_SHORT,
    RESOLUTIONS_YIELDING,
    named_resolutions,
)

LAWS = kinds.LAWS | {
    "thirds": kinds.make_law(
        heights=jl.Heights(([1, 2.5, 1 / 3], [0.1e-6, 2e-6, 4e-6, 5e-6]), 1e-6, "individual"),
        K=1e8 / 3,
    ),
    "brittle bond": kinds.make_law(bond=jl.Bond(1e10, 1 / 3e-10, 0.0, 1e6)),
    "own resolution": kinds.make_law(resolution=jl.Resolution(3, 5, 7)),
    "cells for small loads": kinds.make_law(resolution=jl.Resolution(3, 5, 7, lowest=0.02)),
    "named_resolutions resolution": kinds.make_law(resolution="fine"),
    "default range": kinds.make_law(closure_range=None),
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_file_round_trip(law, tmp_path, monkeypatch):
    monkeypatch.setitem(jl.Law.kinds, "filled", kinds.FilledLaw)
    path = tmp_path / "law.toml"
    assert law.to_toml(path) == path.read_text(encoding="utf-8")
    back = jl.JointLaw.from_toml(path)
    assert (back, back.fingerprint) == (law, law.fingerprint)


@given(
    a=st.floats(1, 1e3), b=st.floats(-1, 2), share=st.floats(-1, 1), K=st.floats(1e-100, 1e100),
    mu=st.floats(0, 1e3), plane=st.none() | st.floats(-10, 10), slip=st.floats(1e-7, math.inf),
)  # fmt: skip
def test_every_number_is_kept_to_the_last_bit(make_law, a, b, share, K, mu, plane, slip):
    law = make_law(a=a, b=b, c=share * (1 / 3 - b / 6), K=K, mu=mu, plane=plane, mating_length=slip)
    assert jl.JointLaw.from_text(law.to_toml()) == law


@pytest.mark.parametrize(
    "write",
    [lambda law, path: law.to_toml(path), lambda law, path: law.joint().snapshot().save(path)],
)
def test_an_interrupted_write_leaves_the_old_file(law, make_law, tmp_path, monkeypatch, write):
    """The disk is full after nine bytes."""
    path = tmp_path / "old.npz"
    write(law, path)
    before, write_bytes = path.read_bytes(), type(path).write_bytes

    def fail(file, data):
        write_bytes(file, data[:9])
        raise OSError("disk full")

    monkeypatch.setattr(type(path), "write_bytes", fail)
    with pytest.raises(OSError, match="disk full"):
        write(make_law(a=5.0), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_tables_that_laws_share_are_not_writeable(any_law):
    """The virgin curve and the inclinations outlive the law: a later law reads the same arrays."""
    k = any_law.tables.asperities
    for shared in () if k is None else (k.curve, vars(k).values(), vars(any_law.facets).values()):
        for array in shared:
            if isinstance(array, np.ndarray):
                with pytest.raises(ValueError, match="read-only"):
                    array[...] *= 2


@given(a=st.floats(1.0, 20.0), b=st.floats(-1.0, 2.0))
def test_an_orientation_has_the_moments_that_it_is_made_from(a, b):
    o = jl.Orientation(a, b)
    back = jl.Orientation.from_moments(o.mean, o.variance)
    # 1e-9: where two values of b nearly coincide (b = 1.4), b itself is known to half the digits
    assert (back.mean, back.variance) == pytest.approx((o.mean, o.variance), rel=1e-9)


def test_equal_laws_have_one_fingerprint(make_law):
    """-0.0 == 0.0: a state goes from one to the other."""
    one, alternative = make_law(c=0.0), make_law(c=-0.0)
    assert (one, one.fingerprint) == (alternative, alternative.fingerprint)
    one.joint().restore(alternative.joint().snapshot())


@pytest.mark.parametrize("name", ["fast", "balanced", "fine", "reference"])
def test_the_mating_length_chooses_the_nodes(make_law, name):
    """Its own depth cells and facets; a file holds the name, not the nodes."""
    for ratio, chosen in (
        (2.4, named_resolutions(2.4)),
        (2.6, named_resolutions()),
        (101.0, named_resolutions(101.0)),
    ):
        law = make_law(resolution=name, closure_range=1e-6, mating_length=ratio * 1e-6)
        assert law.resolution == chosen[name]
        assert len(law.facets.theta) == len(law.tables.asperities.c1)
        assert (f'resolution = "{name}"' in law.to_toml()) == (name != "balanced")
        assert jl.JointLaw.from_text(law.to_toml()) == law
    assert (named_resolutions(2.4)[name] != named_resolutions()[name]) == (
        name in ("fast", "balanced")
    )
    assert (named_resolutions(101.0)[name] != named_resolutions()[name]) == (name == "fine")


def test_the_default_closure_range_is_the_same_for_every_resolution(make_law):
    fine, balanced = (make_law(closure_range=None, resolution=r) for r in ("fine", "balanced"))
    repeated = dataclasses.replace(balanced, resolution="fine")
    assert fine == repeated
    repeated.joint().restore(fine.joint().snapshot())
    # three rings against five: the law's own facets are not those of the default
    assert fine.closure(20e6) == pytest.approx(fine.closure_range, rel=0.02)


def test_linear_asperities_have_the_stiffness_given(make_law):
    asperity = jl.Asperity.linear(kn=3e5, ks=2e5, mu=0.4)
    law = make_law(
        K=asperity.K, lam=asperity.lam, eta=asperity.eta, mu=0.4, heights=None, a=1e6, b=0, c=0
    )
    _, C = law.joint().update([1e-7, 0.0, 0.0])  # nearly flat: every facet faces the joint normal
    # 1e-9: inclinations up to pi/2e6 rad leave errors of their square
    np.testing.assert_allclose(np.diag(C), 1e10 * np.array([3e5, 2e5, 2e5]), rtol=1e-9)


def test_lists_of_names_that_belong_together():
    """What replaces a resolution has its name; a prior is of what a fit can find."""
    assert {*RESOLUTIONS_SHORT, *RESOLUTIONS_LONG, *RESOLUTIONS_YIELDING} <= set(NAMED_RESOLUTIONS)
    assert set(PRIORS) <= set(TRANSFORMS)


UM, MM, GPA = 1e-6, 1e-3, 1e9

# K in GPa um^(1/2) (section 4.1 to 4.3), r0 and beta in um unless noted, N in 1/um2
HERTZ_200 = {"K": 200, "lam": 1.2, "eta": 0.5}
SMOOTH = {"alpha": 3.82, "beta": 1.15, "overlap": 2.0}
ROUGH = {"alpha": 6.14, "beta": 3.52, "overlap": 12.0}
PRINTED = {
    "westerly-smooth": ((6.0, 0.0, 0.0), HERTZ_200, SMOOTH, UM),
    "westerly-rough": ((3.0, 0.0, 0.0), HERTZ_200, ROUGH, UM),
    "biegel-smooth": ((3.0, 0.5, 0.0), HERTZ_200 | {"mu": 0.3}, SMOOTH, UM),
    "biegel-rough": ((2.5, 2.0, 0.0), HERTZ_200 | {"mu": 0.3}, ROUGH, UM),
    "jing-replica": (
        (3.0, -1.0, -0.3), {"K": 300, "lam": 0.33, "eta": 0.5, "mu": 0.47},
        SMOOTH | {"overlap": 3.0}, MM,
    ),
    "linear-a2": ((2.0, 0.0, 0.0), {"lam": 1.0, "eta": 0.0, "mu": 0.6}, None, UM),
    "linear-a3": ((3.0, 0.0, 0.0), {"lam": 1.0, "eta": 0.0, "mu": 0.6}, None, UM),
    "linear-a6": ((6.0, 0.0, 0.0), {"lam": 1.0, "eta": 0.0, "mu": 0.6}, None, UM),
    "linear-a9": ((9.0, 0.0, 0.0), {"lam": 1.0, "eta": 0.0, "mu": 0.6}, None, UM),
    "nonlinear-a3": ((3.0, 0.0, 0.0), {"K": 100, "lam": 1.0, "eta": 0.5, "mu": 0.6}, None, UM),
    "nonlinear-a6": ((6.0, 0.0, 0.0), {"K": 100, "lam": 1.0, "eta": 0.5, "mu": 0.6}, None, UM),
}  # fmt: skip


def test_every_printed_set_is_a_preset_and_every_preset_is_printed():
    assert jl.presets.names() == sorted(PRINTED)


@pytest.mark.parametrize("name", PRINTED)
def test_numbers_of_the_paper(name):
    """Each is a file with its source, and a law that closes and shears."""
    shape, asperity, heights, length = PRINTED[name]
    law = jl.presets.load(name)
    assert law.orientation == jl.Orientation(*shape)
    # K in GPa um^(1/2), for every length scale of the heights
    sizes = {"K": GPA * UM**0.5, "beta": length, "overlap": length}
    for part, values in ((law.asperity, asperity), (law.heights, heights or {})):
        printed = {key: value * sizes.get(key, 1.0) for key, value in values.items()}
        assert {key: getattr(part, key) for key in values} == pytest.approx(printed, rel=1e-12)
    if heights is None:
        assert (law.heights, law.closure_range) == (None, 1 * UM)  # the closure of Fig. 14 to 16
    else:
        assert law.heights.formation == "population"
    assert jl.JointLaw.from_text(jl.presets.text(name)) == law
    assert re.match(r"Misra 1999, .*section 4\.", jl.presets.about(name)["source"])
    F, C = law.joint().update([law.closure_range, 0.1 * law.closure_range, 0.0])
    assert (F[:2] > 0).all()
    assert np.isfinite(C).all()


def test_a_law_whose_facets_jam_warns():
    """Where atan(mu) + 90/a exceeds 90 degrees, unless a bond bears tension; such joints pull."""
    steep = {"a": 1.5, "mu": 0.7, "heights": None, "plane": 0.0}
    with pytest.warns(UserWarning, match=r"atan\(mu\) \+ 90/a = 94\.99 degrees is more than 90"):
        law = kinds.make_law(**steep)
    joint = law.joint()
    F = [joint.update(d)[0][0] for d in ([5e-7, 0.0], [0.0, 3e-6], *20 * [[-2e-7, 0.0]])]
    assert min(F) < -1e-3 * max(F)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        kinds.make_law(**steep, bond=jl.Bond(1e10, 1e10, 1e4, 1e6))
        kinds.make_law(**steep | {"mu": 0.5})
        kinds.make_law(**steep | {"plane": None}, closure_only=True)
        for name in jl.presets.names():
            jl.presets.load(name)


def test_a_fit_is_silent_about_laws_that_it_only_tries():
    """It starts at a law whose facets jam, and finds one whose facets do not."""
    law = kinds.make_law(plane=0.0)
    record = jl.direct_shear(law.joint(), 2 * law.closure(1e6), 1e6, steps=30)
    curve = jl.ShearCurve(record.shear[::6], record.shear_stress[::6], 1e6)
    steepness = 1.01 * np.degrees(np.pi / 2 - np.arctan(law.asperity.mu))
    with pytest.warns(UserWarning, match="jam"):
        steep = dataclasses.replace(
            law, orientation=dataclasses.replace(law.orientation, a=90.0 / steepness)
        )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fit = jl.fit_curves([curve], free=("a",), law=steep)
        assert fit.law.orientation.a == pytest.approx(law.orientation.a, rel=0.02)
