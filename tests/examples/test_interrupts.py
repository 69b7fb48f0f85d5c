"""Ctrl-C: one line and exit code 130, and a run of blocks goes on from where it was stopped."""

import json
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
import wrong_files

import dem_demo.cli
from dem_demo import Simulation, load
from dem_demo.output.interrupt import interruptible
from jointlaw.cli.main import main as jointlaw_main


@pytest.fixture(autouse=True)
def _as_in_a_terminal():
    """A shell that runs the tests in the background has them, and their children, ignore Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def _scene(tmp_path):
    wrong_files.make(tmp_path)


def press_after(monkeypatch, steps, times=1):
    """Ctrl-C in the middle of a step of a simulation."""
    step, count = Simulation.step, [0]

    def counted(self):
        step(self)
        count[0] += 1
        if count[0] == steps:
            for _ in range(times):
                signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(Simulation, "step", counted)


@pytest.mark.usefixtures("_scene")
def test_a_run_goes_on_where_it_was_stopped_bit_for_bit(tmp_path, capsys, monkeypatch):
    main = dem_demo.cli.main
    assert main(["good.toml", "--out", "whole", "--no-pictures"]) == 0
    with monkeypatch.context() as patch:
        press_after(patch, 7)
        assert main(["good.toml", "--out", "part", "--vtk"]) == 130
    told = capsys.readouterr().err.splitlines()
    assert told[-1].startswith("dem_demo: interrupted at 0.0007 s of model time; go on: python -m")
    written = {path.name for path in (tmp_path / "part").iterdir()}
    assert written > {"history.csv", "final.png", "vtk"}
    summary = json.loads((tmp_path / "part" / "summary.json").read_text())
    assert summary["interrupted"]
    assert summary["steps"] == 7
    resume = told[-1].split("python -m dem_demo ")[1].replace("NEW", "end").split()
    assert main([*resume, "--no-pictures"]) == 0
    whole, end = (np.load(tmp_path / name / "state" / "state.npz") for name in ("whole", "end"))
    for name in whole.files:
        np.testing.assert_array_equal(whole[name], end[name], err_msg=name)


@pytest.mark.usefixtures("_scene")
def test_all_that_a_run_writes_is_named_for_its_replacement(tmp_path):
    assert dem_demo.cli.main(["good.toml", "--out", "o", "--format", "pdf"]) == 0
    written = {path.name for path in (tmp_path / "o").iterdir()} - {"state", "summary.json"}
    assert set(json.loads((tmp_path / "o" / "summary.json").read_text())["files"]) == written
    assert (tmp_path / "o" / "energy.pdf").read_bytes().startswith(b"%PDF")


def test_a_second_one_quits_at_once(tmp_path):
    """Within the step: nothing is written, and no traceback shown."""
    wrong_files.make(tmp_path)
    code = (
        "import signal, sys\nimport dem_demo.cli\nfrom dem_demo import Simulation\n"
        "Simulation.step = lambda self: [signal.raise_signal(signal.SIGINT) for _ in range(2)]\n"
        "sys.exit(dem_demo.cli.main(['good.toml', '--out', 'o']))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 130
    assert done.stderr.splitlines()[-1] == "dem_demo: stopped at once; nothing more is written"
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "o" / "summary.json").exists()


@pytest.mark.usefixtures("_scene")
@pytest.mark.parametrize("words", [["check", "good.toml"], ["compare", "slope"]])
def test_before_the_first_step_it_ends_in_one_line(words, capsys, monkeypatch):
    def pressed(*_args):
        raise KeyboardInterrupt

    monkeypatch.setattr(dem_demo.dynamics.simulation, "begin", pressed)
    assert dem_demo.cli.main(words) == 130
    assert capsys.readouterr().err == "dem_demo: interrupted; nothing is written\n"


@pytest.mark.parametrize(
    ("line", "where"),
    [
        ("fit grimsel_vd1_closure --out o", "fit.fit_closure"),
        ("shear linear-a2 --to 1um --out o", "shear.direct_shear"),
        ("scan scan.csv --spacing 20um --height-unit um --out o", "scan.from_surface"),
    ],
)
@pytest.mark.usefixtures("_scene")
def test_a_command_of_jointlaw_ends_in_one_line(line, where, tmp_path, capsys, monkeypatch):
    def pressed(*_args, **_keys):
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(f"jointlaw.cli.{where}", pressed)
    assert jointlaw_main(line.split()) == 130
    told = f"jointlaw {line.split()[0]}: interrupted; nothing more is written\n"
    assert capsys.readouterr().err == told
    assert not (tmp_path / "o").exists()


def test_a_thread_leaves_ctrl_c_to_the_main_one():
    before, seen = signal.getsignal(signal.SIGINT), []

    def body():
        with interruptible() as pressed:
            seen.extend([pressed(), signal.getsignal(signal.SIGINT)])

    thread = threading.Thread(target=body)
    thread.start()
    thread.join()
    assert seen == [False, before]


def test_scenes_of_the_package_raise_no_doubt():
    for name in ("tilt", "shear-box", "stack", "slope", "slope-azimuth", "arch", "shake"):
        assert load(name).doubts == []
