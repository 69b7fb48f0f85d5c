"""What a section of the paper holds: its figures, and its claims with the verdict on each."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

Numbers = dict[str, float]
FORMS = ("total", "law")
TOTAL, LAW = "total form (as printed)", "incremental law (this package)"
QUOTED = {"alpha": 0.16, "lw": 0}  # style of a range that the paper's text quotes


class Bound(NamedTuple):
    """The open interval in which a measured number must lie for a statement to be true.

    Its ends are values or the names of other numbers of the same claim; `why` is the reason for
    ends that the paper does not print.
    """

    number: str
    least: float | str = -math.inf
    most: float | str = math.inf
    why: str = ""

    def holds(self, numbers: Numbers) -> bool:
        """Whether the number is inside; NaN is not."""
        least, most = (
            numbers[end] if isinstance(end, str) else end for end in (self.least, self.most)
        )
        return least < numbers[self.number] < most


def largest(values: ArrayLike) -> float:
    """Largest absolute value."""
    return float(np.max(np.abs(values)))


def near(number: str, value: float, tolerance: float, why: str) -> Bound:
    """The number is this value, to the tolerance."""
    return Bound(number, value - tolerance, value + tolerance, why)


def rounding(number: str, value: float = 0.0) -> Bound:
    """The number is this value but for the rounding of sums of some hundred terms of order one."""
    return near(number, value, 1e-12, "rounding")


@dataclass(frozen=True)
class Claim:
    """A statement of the paper that can be decided, and how it is decided.

    `measure` returns the numbers that go into the sentence `found`. `rules` gives for each verdict
    the bounds that they must keep, the best verdict first:

    "holds": as printed, in both forms of the law where both apply. "misprint": the print is wrong,
    the form given here holds. "in part": true in a part of the range that the sentence names. "one
    reading": true under one reading that the sentence names. "fails", where no rule is met: not so
    in either form.
    """

    key: str
    place: str
    says: str
    found: str
    rules: dict[str, Sequence[Bound]]
    measure: Callable[[], Numbers]

    def verdict(self, numbers: Numbers) -> str:
        """The first verdict whose bounds the numbers keep."""
        for verdict, bounds in self.rules.items():
            if all(bound.holds(numbers) for bound in bounds):
                return verdict
        return "fails"

    def row(self) -> str:
        """Line of the claims table (Markdown), with the command that prints it."""
        numbers = self.measure()
        command = f"`jointlaw figures --claims {self.key}`"
        found = self.found.format_map(numbers)
        cells = (self.place, self.says, self.verdict(numbers), found, command)
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


@dataclass(frozen=True)
class Figure:
    """A figure of the paper: `draw` is given as many matplotlib axes as the figure has panels."""

    numbers: tuple[int, ...]  # two where one picture stands for two figures
    title: str
    caption: str
    panels: int
    polar: bool
    draw: Callable[..., None]

    @property
    def name(self) -> str:
        """File name without its ending."""
        return "-".join(["figure", *(f"{number:02d}" for number in self.numbers)])


@dataclass(frozen=True)
class Section:
    """Figures and claims of one section of the paper, in the order of its file."""

    figures: list[Figure] = field(default_factory=list)
    claims: list[Claim] = field(default_factory=list)

    def figure(
        self, *numbers: int, title: str, caption: str, panels: int = 1, polar: bool = False
    ) -> Callable[[Callable[..., None]], Callable[..., None]]:
        """Enter the decorated function as the one that draws this figure (or these two)."""

        def enter(draw: Callable[..., None]) -> Callable[..., None]:
            self.figures.append(Figure(numbers, title, caption, panels, polar, draw))
            return draw

        return enter

    def claim(
        self,
        key: str,
        place: str,
        says: str,
        found: str,
        holds: Sequence[Bound],
        **weaker: Sequence[Bound],
    ) -> Callable[[Callable[[], Numbers]], Callable[[], Numbers]]:
        """Enter the decorated function as the measurement of this claim; it then runs only once.

        weaker: bounds for the verdicts `misprint`, `in_part`, `one_reading`.
        """
        rules = {"holds": holds} | {name.replace("_", " "): rule for name, rule in weaker.items()}

        def enter(measure: Callable[[], Numbers]) -> Callable[[], Numbers]:
            once = cache(measure)
            self.claims.append(Claim(key, place, says, found, rules, once))
            return once

        return enter
