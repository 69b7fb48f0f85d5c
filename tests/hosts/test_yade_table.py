"""Table mode in the real YADE: what the table says is the force on the body."""

import shutil
import subprocess

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.hosts.yade.export import export_yade
from jointlaw.tables.table import load_table

R = 0.5
AREA = np.pi * R**2


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """The Jing replica (anisotropic, mm-sized) exported once."""
    folder = tmp_path_factory.mktemp("export")
    export_yade(jl.presets.load("jing-replica"), folder / "made")
    shutil.move(folder / "made", folder / "elsewhere")  # as if copied to another machine
    return folder / "elsewhere"


PATHS = """
legs, out = np.load("path.npy"), []
for name in ("joint.txt", "joint.npz"):
    for leg in legs:
        slab_and_sphere()
        engines()
        Joints(TableLaw(name)).attach()
        O.dt = 1e-6
        out.append(drive(leg))
result(force=np.array(out))
"""


def test_normal_force_and_shear_follow_the_table(yade, exported, tmp_path):
    """Closure in uneven steps, opening, shear at three azimuths, reversal, unloading under shear.

    The slab is id1: its displacement against the sphere is minus the sphere's, in axes x and y;
    the force on the sphere is +area F. Positions of 0.5 m resolve 1e-16 m, closures are 1e-3 m.
    """
    table = load_table(exported / "joint.txt")
    end, legs = table.closure[-1], []
    rng = np.random.default_rng(1)
    closure = np.concatenate([np.sort(rng.uniform(0, end, 240)), rng.uniform(-end / 9, end, 160)])
    legs.append(np.stack([closure, 0 * closure, 0 * closure], axis=1))
    for azimuth in (0.0, 40.0, 110.0):
        direction = np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))])
        s = np.concatenate(
            [np.zeros(50), np.linspace(0, end, 120), np.linspace(end, -end / 2, 180)]
        )
        u = np.concatenate([np.linspace(0, end / 2, 50), np.full(250, end / 2),
                            np.linspace(end / 2, end / 9, 50)])  # fmt: skip
        s = np.concatenate([s, np.full(50, s[-1])])
        legs.append(np.column_stack([u[: len(s)], s[: len(u), None] * direction])[:350])
        legs[-1] = np.concatenate([legs[-1], np.repeat(legs[-1][-1:], 50, axis=0)])
    shutil.copy(exported / "joint.txt", tmp_path)
    shutil.copy(exported / "joint.npz", tmp_path)
    np.save(tmp_path / "path.npy", np.array(legs))
    force = yade(PATHS)["force"]
    text, npz = force[:4], force[4:]
    assert np.array_equal(text, npz)  # 17 digits: both files hold the same numbers
    peak = AREA * table.normal_stress[-1]
    expected = AREA * table.lookup(closure).normal_stress
    assert np.abs(text[0, :, 0] - expected).max() < 1e-9 * peak
    touching = closure > 1e-3 * end
    assert np.allclose(text[0, touching, 0], expected[touching], rtol=1e-6)
    for leg, measured in zip(legs[1:], text[1:], strict=True):
        F = table.follow(leg * [1, -1, -1])  # displacement of the slab against the sphere
        assert np.abs(measured - AREA * F).max() < 1e-9 * peak
        assert np.abs(F[:, 1:]).max() > 0.1 * table.normal_stress[-1]


def test_shear_error_against_the_law_is_the_one_stated(yade, exported, tmp_path):
    """The host adds nothing to the table's own error: the reported path, followed in YADE."""
    table = load_table(exported / "joint.txt")
    law = jl.JointLaw.from_toml(exported / "law.toml")
    stated = table.report(law)["shear and reversal"]
    u, s, n = table.closure[-1] / 2, table.closure[-1], 60
    shear = [np.zeros(n), np.linspace(0, s, n + 1)[1:], np.linspace(s, -s, n + 1)[1:]]
    path = np.zeros((3 * n, 3))
    path[:, 0] = np.concatenate([np.linspace(0, u, n + 1)[1:], np.full(2 * n, u)])
    path[:, 1] = np.concatenate(shear)
    joint = law.joint()
    exact = np.array([joint.update(d)[0] for d in np.diff(path, axis=0, prepend=np.zeros((1, 3)))])
    shutil.copy(exported / "joint.txt", tmp_path)
    shutil.copy(exported / "joint.npz", tmp_path)
    np.save(tmp_path / "path.npy", (path * [1, -1, -1])[None])
    force = yade(PATHS)["force"][0] / AREA
    size = np.linalg.norm(exact, axis=1).max()
    error = np.linalg.norm(force - exact, axis=1).max() / size
    print(error, stated.largest)
    assert error == pytest.approx(stated.largest, abs=1e-6)


def test_exported_folder_runs_without_jointlaw(yade, exported):
    """Settling sphere and incline, in a folder elsewhere, with no jointlaw to import."""
    check = subprocess.run(
        ["/usr/bin/env", "-u", "PYTHONPATH", "yade", "-n", "-x",
         str(exported / "settle_and_incline.py")],
        capture_output=True, text=True, cwd=exported, timeout=300, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    text = check.stdout
    assert "import jointlaw" not in (exported / "settle_and_incline.py").read_text()
    settled = next(line for line in text.splitlines() if line.startswith("settled"))
    assert float(settled.rsplit(" ", 1)[1]) < 1e-9
    lines = [line for line in text.splitlines() if line.startswith("azimuth")]
    assert len(lines) == 6
    for line in lines:
        assert ("-0.1 deg: sticks" in line) or ("+0.1 deg: slides" in line), line


def test_direct_shear_script_of_two_blocks(yade, exported):
    """Table mode, run from another folder; the normal stress is checked by the script itself."""
    out = yade(None, folder=exported, name="direct_shear.py")
    error = next(line for line in out.splitlines() if "against the table" in line)
    assert float(error.split("largest error ")[1].split()[0]) < 1e-9


def test_assembly_script_balances_its_weight(yade, exported):
    """Contacts come and go; in the end the box carries the heap (at 1 % unbalanced force)."""
    out = yade(None, folder=exported, name="assembly.py").splitlines()
    last = next(line for line in out if line.startswith("force on the box"))
    numbers = [float(word) for word in last.split() if word[0].isdigit()]
    assert numbers[0] == pytest.approx(numbers[1], rel=0.02)
