"""The command line of the block demo: help, examples, JSON on the standard output, messages."""

import json
import math
import re
import shlex

import pytest
from scene_text import PLAIN, block, coulomb, on_base

import jointlaw as jl
from dem_demo import cli
from dem_demo.cli import COMMANDS, main
from dem_demo.dynamics import relaxation
from dem_demo.scene import shipped
from dem_demo.space import SpaceSimulation, parse

SLAB = on_base(PLAIN, [1.0, 0.3], 10.0, end=0.01)


def help_of(capsys, *words):
    with pytest.raises(SystemExit) as stop:
        main([*words, "--help"])
    assert stop.value.code == 0
    return capsys.readouterr().out


def test_without_arguments_the_help_lists_commands_scenes_and_examples(capsys):
    assert main([]) == 0
    text = capsys.readouterr().out
    assert text == help_of(capsys)
    assert re.findall(r"^    (\w[\w-]*)", text, re.MULTILINE) == [one.name for one in COMMANDS]
    listed = text.partition("scenes: ")[2].partition("\n\n")[0]
    assert re.split(r",\s+", listed) == list(shipped())


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("strenght-reduction", "did you mean 'strength-reduction'?"),
        ("slop", "did you mean 'slope'?"),
        ("xyz", "no command or scene 'xyz': give one of run, new, check"),
        ("missing.toml", "no file 'missing.toml'"),
    ],
)
def test_an_unknown_command_or_scene_is_named_with_similar_ones(word, message, capsys):
    assert main([word]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
def test_each_command_has_help_of_its_own_with_an_example(command, capsys):
    text = help_of(capsys, command.name)
    (example,) = re.findall(r"^example:\n  python -m dem_demo (.*)$", text, re.MULTILINE)
    options = cli._parse(shlex.split(example))
    assert options.run is command.run
    for names, settings in command.options:
        assert names[-1].lstrip("-") in text
        assert settings["help"]


def test_the_version_is_printed(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"dem_demo {jl.__version__}\n"


def test_json_is_all_that_is_on_the_standard_output(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(SLAB)
    assert main(["scene.toml", "--out", "out", "--no-pictures", "--json"]) == 0
    printed = capsys.readouterr()
    summary = json.loads(printed.out)
    assert summary == json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["rocks"][0]["state"] == "stable"
    assert "blocks: stable" in printed.err
    words = ["resume", "out", "--until", "0.02", "--no-pictures", "--json", "--out", "more"]
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)["model_time_s"] == pytest.approx(0.02, abs=1e-3)
    words = ["strength-reduction", "scene.toml", "--until", "0.01", "--json", "--out", "strength"]
    assert main(words) == 0
    printed = capsys.readouterr()
    (row,) = json.loads(printed.out)["rows"]
    assert row["factor_of_safety"] == pytest.approx(1.7, rel=0.01)  # 0.3 / tan(10 degrees)
    assert row["limit_analysis"] == pytest.approx(1.7014, rel=1.5e-3)  # the search leaves 1e-3
    assert "scene: factor of safety 1.7 (at most 1.7 by limit analysis)" in printed.err


def test_the_estimate_counts_figures_and_animation(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(SLAB)
    for option, expected in (([], True), (["--no-pictures"], False)):
        assert main(["scene.toml", "--force", "--out", "out", *option]) == 0
        (line,) = re.findall(r"^estimated .*$", capsys.readouterr().out, re.MULTILINE)
        assert ("s for figures and animation" in line) == expected


@pytest.mark.parametrize("with_pictures", [True, False])
def test_the_estimate_in_space_says_that_it_leaves_out_the_pictures(with_pictures, capsys):
    text = f"[laws.rock]\n{coulomb()}" + block("base", box=[2, 2, 1], fixed=True)
    text += block("slab", box=[1, 1, 0.5], at=[0, 0, 0.75])
    sim = SpaceSimulation(parse(f"{text}[run]\nend = 0.1\n"))
    cli._print_estimate(sim, 100, None, with_pictures)
    (line,) = re.findall(r"^estimated .*$", capsys.readouterr().out, re.MULTILINE)
    assert line.endswith(" s, without the pictures") == with_pictures


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.123, "0.12 s"), (99.0, "99 s"), (120.0, "2 min"), (7200.0, "2 hours")]
)
def test_durations_have_the_unit_of_their_size(seconds, text):
    assert cli._format_duration(seconds) == text


TILTING = f"""
gravity = [0.0, -9.81]
[laws.plain]
{PLAIN}{block("base", box=[6.0, 1.0], at=[0.0, -0.5], fixed_motions=["x", "y"])}
{block("slab", box=[1.0, 0.2], at=[0.0, 0.1])}
[[drive]]
block = "base"
motion = "turn"
times = [0.0, 1.0, 1.5, 2.5]
values = [0.0, 25.0, 25.0, 0.0]
[monitor]
slip = [["slab", "base"]]
[run]
end = 4.0
skin = 0.02
"""


@pytest.mark.slow
def test_a_slab_that_slid_in_a_tilt_test_is_at_rest_and_has_not_failed(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(TILTING)
    assert main(["scene.toml", "--out", "out", "--no-pictures"]) == 0
    printed = capsys.readouterr().out
    slip = float(
        re.findall(r"slab: slipped at .* degrees.*; slip (.*) m$", printed, re.MULTILINE)[0]
    )
    assert slip > 0.1
    (rock,) = json.loads((tmp_path / "out" / "summary.json").read_text())["rocks"]
    assert rock["state"] == "at rest"
    assert rock["displacement_m"] > rock["failure_displacement_m"]
    assert "blocks: at rest; largest displacement" in printed


def test_all_blocks_stable_at_twice_the_strength_are_reported_in_one_plain_line(tmp_path, capsys):
    """A slab steeper than its friction: unstable as drawn, stable at twice the strength."""
    (tmp_path / "steep.toml").write_text(on_base(PLAIN, [1.0, 0.3], 20.0, end=0.01))
    words = ["strength-reduction", "steep.toml", "--until", "0.01", "--out", "out"]
    assert main(words) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "scene: 1 of 1 blocks are unstable: block (0.00, 0.15)" in lines
    assert "scene: 0 blocks stay unstable at strength x 2" in lines


STEEP_BOUND = 0.3 / math.tan(math.radians(20.0))  # 0.8242, the search adds up to 1e-3 of it
PROOF = "no equilibrium exists: proved (at most 0.824 by limit analysis)"


def lines_of(capsys, *words):
    assert main([*words]) == 0
    return capsys.readouterr().out.splitlines()


@pytest.mark.usefixtures("assumed_drawing_time")
def test_check_and_summary_say_whether_the_scene_starts_in_equilibrium(
    tmp_path, capsys, monkeypatch
):
    """A slab at 10 degrees holds with a friction of 0.3, at 20 degrees it slides: tan(20) = 0.364.

    A search without iterations decides neither where Newton's method has no solution.
    """
    steep = on_base(PLAIN, [1.0, 0.3], 20.0, end=0.01)
    (tmp_path / "stable.toml").write_text(SLAB)
    (tmp_path / "steep.toml").write_text(steep)
    (tmp_path / "drawn.toml").write_text(steep + "settle = false\n")
    printed = lines_of(capsys, "check", "stable.toml")
    assert "initial state: in equilibrium" in printed
    assert "factor of safety: at most 1.7 by limit analysis" in printed  # 0.3 / tan(10 degrees)
    printed = lines_of(capsys, "check", "steep.toml")
    assert "initial state: without equilibrium" in printed
    assert f"factor of safety: {PROOF}" in printed
    printed = "\n".join(lines_of(capsys, "check", "drawn.toml"))
    assert "initial state" not in printed
    assert "limit analysis" not in printed
    verdicts = {}
    for name in ("stable", "steep", "drawn"):
        lines_of(capsys, f"{name}.toml", "--out", name, "--no-pictures")
        verdicts[name] = json.loads((tmp_path / name / "summary.json").read_text())["equilibrium"]
    assert verdicts == {
        "stable": "in equilibrium",
        "steep": "without equilibrium",
        "drawn": None,
    }
    words = ["resume", "steep", "--until", "0.02", "--no-pictures", "--out", "more"]
    printed = lines_of(capsys, *words)
    assert not any(line.startswith("initial state") for line in printed)
    summary = json.loads((tmp_path / "more" / "summary.json").read_text())
    assert summary["equilibrium"] == "without equilibrium"
    monkeypatch.setattr(relaxation, "MAX_ITERATIONS", 2000)
    printed = lines_of(capsys, "steep.toml", "--out", "short", "--no-pictures")
    assert "initial state: not decided" in printed
    assert any("and no steady motion that excludes one" in line for line in printed)
    summary = json.loads((tmp_path / "short" / "summary.json").read_text())
    assert summary["equilibrium"] == "not decided"
    assert [block["block"] for block in summary["unstable"]] == ["block"]


def test_strength_reduction_reports_the_proof_of_limit_analysis(tmp_path, capsys):
    """A slab that is too steep, and a second one in the air: it has no equilibrium at any
    strength, and without it the bound is the ratio 0.3 / tan(20 degrees) again."""
    falling = block("falling", box=[0.5, 0.5], at=[0.0, 5.0])
    steep = on_base(PLAIN, [1.0, 0.3], 20.0, end=0.01).replace("[run]", falling + "[run]")
    (tmp_path / "steep.toml").write_text(steep)
    words = ["strength-reduction", "steep.toml", "--until", "0.01", "--out", "out"]
    printed = lines_of(capsys, *words)
    (row,) = json.loads((tmp_path / "out" / "strength.json").read_text())["rows"]
    assert row["limit_analysis"] == 0.0
    assert row["factor_of_safety"] is None
    assert row["limit_without_excluded"] == pytest.approx(STEEP_BOUND, rel=1.5e-3)
    assert row["factor_without_excluded"] <= row["limit_without_excluded"]
    (line,) = [line for line in printed if line.startswith("scene: no factor of safety")]
    assert "no equilibrium exists: proved (also with 64 times the strength)" in line
    assert PROOF in line
