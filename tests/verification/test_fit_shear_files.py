"""`jointlaw fit --shear`: laboratory files in, a law that predicts another normal stress out."""

import json

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.cli.main import main

pytestmark = pytest.mark.slow
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
        mating_length=0.4e-3,
    )


def shear_stress(law, normal):
    """Shear stress (Pa) at the displacements U."""
    return jl.direct_shear(law.joint(), U[1:].tolist(), normal, steps=1).shear_stress


def write_shear(path, law, normal, rng):
    """A file as a spreadsheet saves it in half of Europe; normal stress in MPa."""
    tau = shear_stress(law, 1e6 * normal)
    tau = tau + NOISE * tau.max() * rng.standard_normal(tau.shape) * (U > 0)
    rows = [f"{1e3 * u:.4f};{t / 1e3:.2f};{normal}" for u, t in zip(U, tau, strict=True)]
    path.write_text("\n".join(["us;tau;sn", "[mm];[kPa];[MPa]", *rows]).replace(".", ","))


def write_closure(path, law, rng):
    stress = np.geomspace(0.2e6, 8e6, 14)
    closure = law.closure(stress)
    closure = (closure - closure[0]) * (1 + 0.003 * rng.standard_normal(14))
    rows = [f"{s / 1e6:.4f},{1e6 * u:.3f}" for s, u in zip(stress, closure, strict=True)]
    path.write_text("\n".join(["sigma_n [MPa],closure [um]", *rows]))


def test_three_shear_files_and_a_closure_file_predict_a_fourth(tmp_path, law, capsys):
    """Heights held, which the closure curve does not fix. 0.5 % of noise at 57 points leaves 0.3 %
    of a plateau unknown; 2 % holds that and the step of the record."""
    rng = np.random.default_rng(3)
    for n in (1, 3, 5):
        write_shear(tmp_path / f"s{n}.csv", law, n, rng)
    write_closure(tmp_path / "c.csv", law, rng)
    line = "fit c.csv --shear s1.csv s3.csv s5.csv --set alpha=3.8 --set beta=3e-5 --out o"
    assert main(line.split()) == 0
    assert "another shape than the law" not in capsys.readouterr().out
    assert (tmp_path / "o" / "fit.png").read_bytes().startswith(b"\x89PNG")
    summary = json.loads((tmp_path / "o" / "summary.json").read_text())
    assert {"mu", "a", "mating_length", "asperity_density"} <= set(summary["identifiable"])
    assert summary["parameters_SI"]["mating_length"] == pytest.approx(0.4e-3, rel=0.1)
    fourth = "shear o/law.toml --normal-stress 4MPa --to 3mm --steps 100 --out p"
    assert main(fourth.split()) == 0
    table = np.genfromtxt(tmp_path / "p" / "shear.csv", delimiter=",", names=True)
    truth = shear_stress(law, 4e6)
    found = np.interp(U, table["shear_2_m"], table["F2_Pa"])
    np.testing.assert_allclose(found[6:], truth[6:], rtol=0.02)
