"""Files that a scene names: records to shake with, parameters of laws."""

from collections.abc import Iterable
from pathlib import Path


class Files(dict[str, str]):
    """Texts of the files that a scene names, by their names; read from `folder` when first used.

    A name is a path relative to the scene's file.
    """

    def __init__(self, folder: str | Path = "", known: Iterable[tuple[str, str]] = ()) -> None:
        super().__init__(known)
        self.folder = Path(folder)

    def __missing__(self, name: str) -> str:
        self[name] = (self.folder / name).read_text(encoding="utf-8-sig")
        return self[name]
