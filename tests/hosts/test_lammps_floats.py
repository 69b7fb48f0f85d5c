"""The LAMMPS plug-in with slider forces as float: forces, restarts, memory, refusals."""

import numpy as np
import pytest
from lammps_host import LAWS, build, dumped, run
from test_lammps_identity import PAIR
from test_lammps_spheres import DRIFT, RESTARTED, STEPS, differ, scene


@pytest.fixture(scope="module")
def floats(tmp_path_factory):
    """A folder with the plug-in for float sliders, and the laws."""
    return build(tmp_path_factory.mktemp("floats"), "-DJOINTLAW_FLOAT_SLIDERS")


@pytest.mark.parametrize("law", ["rock", "worn", "bonded"])
def test_a_collision_is_as_with_doubles(plugin, floats, law):
    """On one processor, and on two with the same bits, as the joint crosses the border."""
    motion = scene(law=law, velocity=DRIFT)
    frames = []
    for folder, processors in ((plugin, 1), (floats, 1), (floats, 2)):
        run(folder, motion, processors)
        frames.append(dumped(folder / "out")[1:, :, 1:13])
    double, single, parallel = frames
    # some hundred roundings of each slider by 2^-24, which the motion amplifies a little
    assert 0.0 < differ(single, double) < 1e-6
    np.testing.assert_array_equal(parallel, single)


@pytest.mark.parametrize("processors", [1, 2])
def test_a_restart_continues_and_is_smaller(plugin, floats, processors):
    moment = 150
    pause = f"run {moment}\nwrite_restart held\nrun {STEPS - moment}"
    sizes = []
    for folder in (plugin, floats):
        run(folder, scene(damping=0.1, run=pause), processors)
        whole = dumped(folder / "out")[moment + 1 :, :, 1:13]
        run(folder, RESTARTED.format(law="rock", steps=STEPS - moment), processors)
        assert differ(dumped(folder / "rest")[1:, :, 1:13], whole) < 1e-12
        sizes.append((folder / "held").stat().st_size)
    sliders = LAWS["rock"].tables.row_counts["q"] // 2
    assert sizes[0] - sizes[1] == 8 * sliders


def test_two_runs_are_one_run(floats):
    """The setup of a run is no step, also of a joint whose sliders are at their friction limit."""
    dump = """dump 1 all custom 10 {} fx fy fz tqx tqy tqz id
dump_modify 1 sort id format float %.17g
"""
    half = f"run {STEPS // 2}\n"
    run(floats, PAIR + dump.format("twice") + half + "run 0\n" + half)
    run(floats, PAIR + dump.format("once") + f"run {STEPS}\n")
    once, twice = (dumped(floats / name) for name in ("once", "twice"))
    np.testing.assert_array_equal(twice, once)


def test_a_restart_of_the_other_storage_is_refused(plugin, floats):
    for writer, reader in ((plugin, floats), (floats, plugin)):
        run(writer, scene(damping=0.1, run="run 150\nwrite_restart held"))
        (reader / "moved").write_bytes((writer / "held").read_bytes())
        script = RESTARTED.format(law="rock", steps=1).replace("restart held", "restart moved")
        text = run(reader, script, code=1)
        assert "or of a plug-in with other storage (JOINTLAW_FLOAT_SLIDERS)" in text
