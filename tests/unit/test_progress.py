"""What is said of long work: on a terminal once, in a pipe nothing."""

import io

import pytest

from jointlaw.support import progress


class Elapsed:
    """A timer whose time is over at once."""

    def __init__(self, seconds, function, words):
        assert seconds == 2.0
        self.say = lambda: function(*words)
        self.cancelled = False

    def start(self):
        self.say()

    def cancel(self):
        self.cancelled = True


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(("stream", "told"), [(Terminal(), "compiling\n"), (io.StringIO(), "")])
def test_a_silent_wait_is_explained_on_a_terminal(monkeypatch, stream, told):
    monkeypatch.setattr(progress, "Timer", Elapsed)
    monkeypatch.setattr("sys.stderr", stream)
    with progress.explained("compiling"):
        pass
    assert stream.getvalue() == told


def test_short_work_is_not(monkeypatch):
    """The timer is stopped with the work, also where that fails."""
    made = []
    monkeypatch.setattr(progress, "Timer", lambda *words: made.append(Elapsed(*words)) or made[-1])
    with pytest.raises(ValueError, match="no"), progress.explained("compiling"):
        raise ValueError("no")
    assert made[0].cancelled
