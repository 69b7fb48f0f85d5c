"""Wheels for other machines: all are built by one command, and that for ARM runs here by qemu."""

import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from c_host import HERE, random_law, random_path
from programs import find_program, run_program

from jointlaw.hosts.c.export import table_text
from jointlaw.native import build

ROOT = Path(__file__).parents[2]
ARM = "aarch64-linux-gnu.2.17"
SYSROOT = "/usr/aarch64-linux-gnu"  # Debian: libc6-arm64-cross
JOINTS = 11
PLAIN = (0, 10, 14)  # laws that take no expm1, log1p or hypot, whose last digit may differ on ARM


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """Folder of all wheels; the command itself looks into their libraries."""
    for name in ("build", "lief", "ziglang"):  # of the extra `wheels`
        pytest.importorskip(name)
    folder = tmp_path_factory.mktemp("wheels")
    run_program(sys.executable, ROOT / "builder" / "wheels.py", folder, timeout=3000)
    return folder


def test_a_wheel_for_each_machine(wheels):
    built = {path.stem.partition("-py3-none-")[2] for path in wheels.glob("*.whl")}
    assert built == set(build.TARGETS.values())


def test_arm_gives_the_bits_of_this_machine(wheels, tmp_path):
    """The library of the wheel and the header agree on ARM, for laws of all kinds."""
    qemu = find_program("qemu-aarch64")
    wheel = next(wheels.glob(f"*{build.TARGETS[ARM]}.whl"))
    library = zipfile.ZipFile(wheel).extract("jointlaw/native/built/libjointlaw.so", tmp_path)
    program = tmp_path / "library"
    flags = [*build.FLAGS, f"-I{build.BUILT}", f"-I{build.HERE}"]
    build.zig(ARM).run(*flags, HERE / "library.c", "-o", program, "-lm", "-ldl")
    for seed in (*PLAIN, 3, 7, 13, 20):
        law = random_law(seed)
        paths = np.stack([random_path(law.dim, seed + 100 * k) for k in range(JOINTS)], axis=1)
        file = tmp_path / "law.jlaw"
        file.write_text(table_text(law))
        command = [qemu, "-L", SYSROOT, program, file, library, str(JOINTS)]
        done = subprocess.run(command, input=paths.tobytes(), capture_output=True)
        assert done.returncode == 0, done.stderr.decode()
        batch = law.joints(JOINTS)
        here = np.array([np.concatenate([*map(np.ravel, batch.update(d))]) for d in paths])
        there = np.frombuffer(done.stdout).reshape(here.shape)
        if seed in PLAIN:
            np.testing.assert_array_equal(there, here)
        for part in (slice(0, JOINTS * law.dim), slice(JOINTS * law.dim, None)):  # F, C
            off = np.abs(there - here)[:, part].max()
            assert off < 1e-12 * np.abs(here[:, part]).max()
