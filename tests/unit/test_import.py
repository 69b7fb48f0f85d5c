"""`import jointlaw` needs numpy and scipy alone, and leaves the slow parts until they are asked."""

import subprocess
import sys

HEAVY = ("matplotlib", "pymunk", "numba", "tqdm", "dask", "pandas", "scipy.stats")


def modules_after(code):
    listing = subprocess.run(
        [sys.executable, "-c", f"import sys; {code}; print(*sys.modules)"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return set(listing.stdout.split())


def test_import_pulls_in_nothing_heavy():
    assert not modules_after("import jointlaw, jointlaw.cli").intersection(HEAVY)


def test_a_code_that_embeds_the_law_loads_no_tools_for_measurements():
    modules = modules_after("import jointlaw")
    assert not modules.intersection((*HEAVY, "scipy.optimize", "scipy.spatial"))
    assert not {
        m
        for m in modules
        if m.startswith(("jointlaw.calibration", "jointlaw.surface", "jointlaw.tables.tabulate"))
    }


def test_presets_and_gamma_heights_need_no_scipy_stats():
    code = "import jointlaw as jl; jl.presets.load('biegel-rough').normal_stress(1e-7)"
    assert "scipy.stats" not in modules_after(code)


def test_promised_names():
    import jointlaw as jl

    names = (
        "JointLaw Orientation Asperity GammaHeights Heights Resolution Joint JointBatch JointState "
        "NonFiniteError PathError Record closure_test direct_shear load_state presets"
    )
    for name in names.split():
        assert hasattr(jl, name)
        assert name in jl.__all__


def test_every_public_name_loads_and_is_what_it_is_called():
    import jointlaw as jl

    for name in jl.__all__:
        found = getattr(jl, name)
        if name not in ("closed_form", "presets"):
            assert callable(found), name
        assert found.__name__.rpartition(".")[2] == name
