"""What the demo refuses: a scene file, or a state that the method cannot carry."""


class SceneError(ValueError):
    """A scene file that cannot be run: says which key, its value, the bound and the remedy."""


class Refused(RuntimeError):
    """A state that the method cannot carry; the run leaves a snapshot that replays it."""
