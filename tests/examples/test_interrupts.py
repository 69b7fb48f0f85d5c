"""Ctrl-C: a command of jointlaw ends in one line, with exit code 130, and leaves nothing."""

import pytest

from jointlaw.cli.main import main


@pytest.mark.parametrize(
    ("line", "where"),
    [
        ("fit grimsel_vd1_closure --out o", "fit.fit_curves"),
        ("shear linear-a2 --to 1um --out o", "laboratory.direct_shear"),
    ],
)
def test_a_command_of_jointlaw_ends_in_one_line(line, where, tmp_path, capsys, monkeypatch):
    def pressed(*_args, **_keys):
        raise KeyboardInterrupt

    monkeypatch.setattr(f"jointlaw.cli.{where}", pressed)
    assert main(line.split()) == 130
    told = f"jointlaw {line.split()[0]}: interrupted; nothing more is written\n"
    assert capsys.readouterr().err == told
    assert not (tmp_path / "o").exists()
