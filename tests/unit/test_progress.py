"""What is said of long work: on a terminal once, in a pipe nothing."""

import io
from unittest.mock import MagicMock

import pytest

from jointlaw.support import progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(("stream", "told"), [(Terminal(), "compiling\n"), (io.StringIO(), "")])
def test_a_silent_wait_is_explained_on_a_terminal(monkeypatch, stream, told):
    """The time is over at once here; the timer is stopped with the work, also where that fails."""
    timer = MagicMock()
    monkeypatch.setattr("sys.stderr", stream)
    monkeypatch.setattr(progress, "Timer", timer)
    with pytest.raises(ValueError, match="no"), progress.explained("compiling"):
        raise ValueError("no")
    seconds, say, words = timer.call_args.args
    assert seconds == progress.PATIENCE
    for _ in timer.return_value.start.call_args_list:
        say(*words)
    assert stream.getvalue() == told
    assert timer.return_value.cancel.called
