"""Trials of a search, each kept in a file as soon as it is finished: what was stopped goes on."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from jointlaw.support.files import write_json

from ..scene import Scene

FILE = "trials.json"
VERSION = 2  # of trials.json


class Trials:
    """What has been found about a scene, by name; with a `folder` also in its trials.json.

    Raises ValueError for a folder with trials of another scene.
    """

    def __init__(self, scene: Scene, folder: Path | None = None) -> None:
        self.path = folder and folder / FILE
        self.of = {"version": VERSION, "scene": scene.text, "files": dict(scene.files)}
        self.known: dict[str, Any] = {}
        if self.path and self.path.exists():
            kept = json.loads(self.path.read_text(encoding="utf-8"))
            self.known = kept.pop("trials")
            if kept != self.of:
                raise ValueError(
                    f"{self.path} holds trials of another scene: give another --out, or --force to "
                    "replace them"
                )

    def ask(self, name: str, find: Callable[[], Any]) -> Any:
        """What `find` says, as JSON keeps it; known from before, it is not asked again."""
        if name not in self.known:
            self.known[name] = find()
            if self.path:
                write_json(self.path, {**self.of, "trials": self.known})
        return self.known[name]
