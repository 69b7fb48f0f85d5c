"""What the demo refuses."""


class Refused(RuntimeError):
    """A state that the method cannot carry; the run leaves a snapshot that replays it."""
