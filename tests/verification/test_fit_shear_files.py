"""`jointlaw fit --shear`: laboratory files in, a law that predicts another normal stress out."""

import json
from dataclasses import replace

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.cli.main import main

U = np.concatenate([np.linspace(0, 0.5e-3, 9), np.linspace(0.75e-3, 3e-3, 10)])  # m
NOISE = 0.005  # of the largest shear stress


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")


@pytest.fixture(scope="module")
def law():
    return jl.JointLaw(
        orientation=jl.Orientation(4.0),
        asperity=jl.Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.55),
        heights=jl.GammaHeights(3.8, 3e-5, 0.0, "individual"),
        asperity_density=3e5,
        critical_slip=0.4e-3,
    )


def shear_stress(law, normal):
    """Shear stress (Pa) at the displacements U."""
    return jl.direct_shear(law.joint(), U[1:].tolist(), normal, steps=1).shear_stress


def write_shear(path, law, normals, rng):
    """A file as a spreadsheet saves it in half of Europe."""
    tau = np.column_stack([shear_stress(law, 1e6 * n) for n in normals])
    tau = tau + NOISE * tau.max(axis=0) * rng.standard_normal(tau.shape) * (U > 0)[:, None]
    lines = [";".join(["us", *(f"tau at {n} MPa" for n in normals)])]
    lines += [";".join(["[mm]", *("[kPa]" for _ in normals)])]
    for u, row in zip(U, tau, strict=True):
        lines.append(";".join([f"{1e3 * u:.4f}", *(f"{t / 1e3:.2f}" for t in row)]))
    path.write_text("\n".join(lines).replace(".", ","))


def write_closure(path, law, rng):
    stress = np.geomspace(0.2e6, 8e6, 14)
    closure = law.closure(stress)
    closure = (closure - closure[0]) * (1 + 0.003 * rng.standard_normal(14))
    rows = [f"{s / 1e6:.4f},{1e6 * u:.3f}" for s, u in zip(stress, closure, strict=True)]
    path.write_text("\n".join(["sigma_n [MPa],closure [um]", *rows]))


@pytest.fixture
def specimen(tmp_path, law):
    """Three shear files, at 1, 3 and 5 MPa, and a closure file."""
    rng = np.random.default_rng(3)
    for n in (1, 3, 5):
        write_shear(tmp_path / f"s{n}.csv", law, [n], rng)
    write_closure(tmp_path / "c.csv", law, rng)
    return "c.csv --shear s1.csv s3.csv s5.csv"


def test_three_shear_files_and_a_closure_file_predict_a_fourth(specimen, tmp_path, law, capsys):
    """Heights held, which the closure curve does not fix. 0.5 % of noise at 57 points leaves 0.3 %
    of a plateau unknown; 2 % holds that and the step of the record."""
    line = f"fit {specimen} --set alpha=3.8 --set beta=3e-5 --out o"
    assert main(line.split()) == 0
    told = capsys.readouterr().out
    assert "Shear curves, measured and by the law" in told
    assert "- s3.csv: 3 MPa, 19 of 19 points fitted" in told
    assert "soften after their peak" not in told
    assert "do not bend" not in told
    assert (tmp_path / "o" / "fit.png").read_bytes().startswith(b"\x89PNG")
    summary = json.loads((tmp_path / "o" / "summary.json").read_text())
    assert {"mu", "a", "critical_slip", "asperity_density"} <= set(summary["identifiable"])
    assert summary["parameters_SI"]["critical_slip"] == pytest.approx(0.4e-3, rel=0.1)
    fourth = "shear o/law.toml --normal-stress 4MPa --to 3mm --steps 100 --out p"
    assert main(fourth.split()) == 0
    table = np.genfromtxt(tmp_path / "p" / "shear.csv", delimiter=",", names=True)
    truth = shear_stress(law, 4e6)
    found = np.interp(U, table["shear_2_m"], table["F2_Pa"])
    np.testing.assert_allclose(found[6:], truth[6:], rtol=0.02)


def test_a_cycle_and_shear_files_are_fitted_together(tmp_path, law, capsys):
    yielding = replace(law, asperity=replace(law.asperity, yield_interference=2e-5))
    write_shear(tmp_path / "s.csv", yielding, [3], np.random.default_rng(6))
    record = jl.closure_test(replace(yielding, closure_only=True).joint(), 8e6, steps=12)
    table = np.column_stack([record.F1, record.closure])
    header = "stress [Pa],closure [m]"
    np.savetxt(tmp_path / "c.csv", table, delimiter=",", header=header, comments="")
    held = "--set alpha=3.8 --set beta=3e-5 --set asperity_density=3e5 --set critical_slip=0.4e-3"
    assert main(f"fit c.csv --cycle --shear s.csv {held} --out o".split()) == 0
    summary = json.loads((tmp_path / "o" / "summary.json").read_text())
    assert {"mu", "a", "yield_interference"} <= set(summary["identifiable"])
    assert summary["parameters_SI"]["yield_interference"] == pytest.approx(2e-5, rel=0.1)
    assert summary["parameters_SI"]["mu"] == pytest.approx(0.55, rel=0.05)


def test_a_curve_that_softens_is_told_and_its_wear_can_be_fitted(tmp_path, law, capsys):
    """Peak and residual: the law without wear says that it has none, and which names to free."""
    worn = replace(law.asperity, mu_residual=0.35, wear_slip=0.6e-3)
    write_shear(tmp_path / "s.csv", replace(law, asperity=worn), [3], np.random.default_rng(4))
    held = "--set alpha=3.8 --set beta=3e-5 --set asperity_density=3e5"
    assert main(f"fit --shear s.csv {held} --out o".split()) == 0
    told = capsys.readouterr().out
    assert "**These curves soften after their peak**, at 3 MPa by" in told
    free = told.split("--free ")[1].split()[0]
    assert free == "mu,a,critical_slip,mu_residual,wear_slip"
    assert main(f"fit --shear s.csv {held} --free {free} --out w".split()) == 0
    told = capsys.readouterr().out
    assert "soften after their peak" not in told
    found = json.loads((tmp_path / "w" / "summary.json").read_text())["parameters_SI"]
    # the friction of the worn faces, of which the points at the end are the plateau
    ratio = found["mu_residual"] / found["mu"]
    assert ratio == pytest.approx(0.35 / 0.55, rel=0.15)


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ("--up-to half", "--up-to holds back a part of one closure test"),
        ("--law nothing", "'nothing' is neither a preset"),
        ("--cycle", "--cycle is about a closure test: name its file before --shear"),
        ("--noise 0.01", "--noise is about a closure test"),
        ("--normal-stress 1", "--normal-stress = 1 has no unit"),
        ("--normal-column sn:MPa", "which column is the normal stress, and in which unit?"),
    ],
)
def test_refused(more, told, tmp_path, law, capsys):
    write_shear(tmp_path / "s.csv", law, [1], np.random.default_rng(5))
    assert main(f"fit --shear s.csv {more} --out o".split()) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "o").exists()
