"""Examples of the docstrings run, and docstrings name arguments and errors."""

import doctest
import inspect
import re
from dataclasses import replace

import numpy as np
import pytest

import jointlaw as jl

WITHOUT = {"JointTable", "NonFiniteError", "PathError", "Record", "load_table"}  # made by others
NAMES = {name: getattr(jl, name) for name in jl.__all__ if not inspect.ismodule(getattr(jl, name))}
CALLED = NAMES | {
    f"{name}.{own}": getattr(thing, own)
    for name, thing in NAMES.items()
    for own in (vars(thing) if inspect.isclass(thing) else ())
    if not own.startswith("_") and callable(getattr(thing, own))
}


@pytest.mark.parametrize("name", CALLED)
def test_docstrings_name_arguments_and_errors(name):
    text, thing = inspect.getdoc(CALLED[name]), CALLED[name]
    # an error holds what it was raised with
    arguments = () if name.endswith("Error") else inspect.signature(thing).parameters
    named = [one for one in arguments if one not in ("self", "args")]
    assert [one for one in named if not re.search(rf"\b{one}\b", text)] == []
    assert inspect.isclass(thing) or not named or re.search(r"\b[Rr]aises\b", text)


@pytest.mark.parametrize("name", NAMES)
def test_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    law = jl.presets.load("westerly-smooth")
    sheared = jl.direct_shear(law.joint(), 1e-6, normal=5e6)
    space = {
        "jl": jl, "np": np, "replace": replace, "law": law, "joint": law.joint(),
        "record": jl.closure_test(law.joint(), 5e6), "sheared": sheared,
        "curve": jl.ShearCurve(sheared.shear[1:], sheared.shear_stress[1:], 5e6),
    }  # fmt: skip
    found = doctest.DocTestFinder().find(NAMES[name], name, globs=space)
    assert name in WITHOUT or any(one.examples for one in found)
    assert not any(doctest.DocTestRunner().run(one).failed for one in found)
