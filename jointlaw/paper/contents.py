"""The paper as reproduced: its figures as files, and the table of its claims with our numbers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..support.files import replace_file, write_json
from ..support.progress import track
from . import asperity, closure, draw, elastic, shear, sliding, strength, surface

_SECTIONS = [
    module.SECTION for module in (surface, elastic, sliding, asperity, closure, shear, strength)
]
FIGURES = {
    number: figure
    for section in _SECTIONS
    for figure in section.figures
    for number in figure.numbers  # Figures 4 and 6 are one picture here
}
CLAIMS = {claim.key: claim for section in _SECTIONS for claim in section.claims}


def write_figures(folder: str | Path, numbers: Sequence[int] = ()) -> list[Path]:
    """Write figures (all if none are named) as PNG and CSV, and `summary.json` with the captions.

    Returns the files. Raises ValueError for a number that is no figure of the paper or one without
    content to compute (1 and 2), and ImportError without matplotlib.
    """
    for number in numbers:
        if number not in FIGURES:
            known = ", ".join(str(n) for n in sorted(FIGURES))
            raise ValueError(f"figure {number} is not one of {known} (1 and 2 are sketches)")
    wanted = sorted({FIGURES[number].numbers[0] for number in numbers or FIGURES})
    out, files, captions = Path(folder), [], {}
    for number in track(wanted, "figures", len(wanted)):
        figure = FIGURES[number]
        png, curves = draw.rendered(figure)
        out.mkdir(parents=True, exist_ok=True)
        for ending, data in ((".png", png), (".csv", curves.encode())):
            files.append(out / f"{figure.name}{ending}")
            replace_file(files[-1], data)
        captions[figure.name] = {"title": figure.title, "caption": figure.caption}
    write_json(out / "summary.json", {"figures": captions})
    return [*files, out / "summary.json"]


def claims_table(keys: Sequence[str] = ()) -> str:
    """The claims table (Markdown): all claims, or those of these keys in the order given.

    Raises ValueError for an unknown key, before anything is computed.
    """
    for key in keys:
        if key not in CLAIMS:
            raise ValueError(f"claim {key!r} is unknown; choose one of {', '.join(CLAIMS)}")
    head = (
        "| Place | The paper says | Verdict | We find | Command |\n| --- | --- | --- | --- | --- |"
    )
    chosen = keys or list(CLAIMS)
    return "\n".join([head, *(CLAIMS[key].row() for key in track(chosen, "claims", len(chosen)))])
