"""What a claim of the paper is, and the list of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache

VERDICTS = ("holds", "misprint", "in part", "one reading", "fails")


@dataclass(frozen=True)
class Finding:
    """What we measured: a verdict, the sentence for the table, and the numbers in it.

    "holds": as printed, in both forms of the law where both apply. "misprint": the print is wrong,
    the form given here holds. "in part": true in a part of the range that the sentence names. "one
    reading": true under one reading that the sentence names. "fails": not so in either form.
    """

    verdict: str
    text: str
    numbers: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise ValueError(f"verdict = {self.verdict!r} is unknown; one of {', '.join(VERDICTS)}")


@dataclass(frozen=True)
class Claim:
    """A statement of the paper that can be decided, and the function that decides it."""

    key: str
    place: str
    says: str
    measure: Callable[[], Finding]


_CLAIMS: dict[str, Claim] = {}


def claim(
    key: str, place: str, says: str
) -> Callable[[Callable[[], Finding]], Callable[[], Finding]]:
    """Register the decorated function as the measurement of a claim; it then runs only once."""

    def register(measure: Callable[[], Finding]) -> Callable[[], Finding]:
        if key in _CLAIMS:
            raise ValueError(f"claim {key!r} is registered twice")
        once = cache(measure)
        _CLAIMS[key] = Claim(key, place, says, once)
        return once

    return register


def keys() -> list[str]:
    """Keys of all claims, in the order of the paper."""
    return list(_CLAIMS)


def get(key: str) -> Claim:
    """The claim of this key. Raises ValueError for an unknown key."""
    if key not in _CLAIMS:
        raise ValueError(f"claim {key!r} is unknown; choose one of {', '.join(_CLAIMS)}")
    return _CLAIMS[key]


def measure(key: str) -> Finding:
    """Our finding on a claim, computed once per process. Raises ValueError for an unknown key."""
    return get(key).measure()


def row(key: str) -> str:
    """The line of the claims table (Markdown) for one claim, with the command that prints it."""
    one = get(key)
    found = one.measure()
    command = f"`jointlaw figures --claims {key}`"
    cells = (one.place, one.says, found.verdict, found.text, command)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def header() -> str:
    """The head of the claims table (Markdown)."""
    return (
        "| Place | The paper says | Verdict | We find | Command |\n| --- | --- | --- | --- | --- |"
    )


def table(chosen: Sequence[str] = ()) -> str:
    """The claims table (Markdown): all claims, or the chosen ones in the order given."""
    return "\n".join([header(), *(row(key) for key in chosen or keys())])
