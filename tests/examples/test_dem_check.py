"""`check` of block scenes: excavation stages, number of blocks, duplicate names, flat polygons;
`resume` of an edited scene."""

import numpy as np
import pytest
from scene_text import PLAIN, block, lines, on_base

from dem_demo import parse
from dem_demo.cli import main
from dem_demo.scene.cutting import JointSet, cut, estimate_block_count

PILLAR = (
    f"[laws.plain]\n{PLAIN}"
    + block("floor", box=[6.0, 1.0], at=[0.0, -0.5], fixed=True)
    + block("pillar", box=[1.0, 2.0], at=[0.0, 1.0])
    + block("roof", box=[3.0, 0.5], at=[0.0, 2.25])
    + block("top", box=[3.0, 0.5], at=[0.0, 2.75])
    + "[[excavate]]\n"
    + lines(corners=[[-0.6, 0.0], [0.6, 0.0], [0.6, 2.0], [-0.6, 2.0]], release_time=0.1)
    + "[run]\nend = 0.1\n"
)
SQUARE = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]


def rock(spacing, outline=SQUARE):
    sets = "".join(
        f"[[rock.set]]\ndip = {dip}\nspacing = {spacing}\n" for dip in (0.0, 60.0)
    )  # fmt: skip
    return (
        f"[laws.plain]\n{PLAIN}[[rock]]\n" + lines(name="slope", outline=outline) + sets
        + "[run]\nend = 0.1\n"
    )  # fmt: skip


def test_check_reports_blocks_that_fall_after_an_excavation(tmp_path, capsys):
    """The pillar carries both blocks; once it is excavated nothing does."""
    (tmp_path / "pillar.toml").write_text(PILLAR)
    assert main(["check", "pillar.toml"]) == 0
    before, _, after = capsys.readouterr().out.partition("after excavation stage 1")
    assert "initial state: in equilibrium" in before
    assert "initial state: without equilibrium" in after
    assert "2 blocks have no static equilibrium" in after
    assert "roof" in after
    assert "top" in after
    assert "no equilibrium exists: proved" in after


def test_number_of_blocks_is_estimated_and_refused_before_cutting(capsys):
    with pytest.raises(ValueError, match=r"rock\['slope'\].*about 1\.4e\+09 blocks.*1e\+05"):
        parse(rock(1e-4))
    sets = [JointSet(0.0, 0.2, "j"), JointSet(60.0, 0.25, "j"), JointSet(-50.0, 0.3, "j")]
    outline = np.array(SQUARE)
    result = len(cut(outline, sets, 0, 1e-6).shapes)
    assert estimate_block_count(outline, sets) == pytest.approx(result, rel=0.05)


def test_errors_name_duplicate_blocks_and_flat_polygons():
    text = on_base(PLAIN, [1.0, 0.3])
    with pytest.raises(ValueError, match="two blocks have the same name 'base'"):
        parse(text.replace('"block"', '"base"'))
    with pytest.raises(ValueError, match=r"outline: all corners lie on one line"):
        parse(rock(1.0, [[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]]))


def test_resume_says_that_an_edited_scene_has_no_effect(tmp_path, capsys):
    (tmp_path / "slab.toml").write_text(on_base(PLAIN, [1.0, 0.3], end=0.01))
    assert main(["slab.toml", "--out", "out", "--no-pictures"]) == 0
    assert "saved state" not in capsys.readouterr().out
    assert main(["resume", "out", "--until", "0.02", "--no-pictures", "--out", "more"]) == 0
    message = "continues with the scene of its saved state: changes of the scene file since then"
    assert message in capsys.readouterr().out
