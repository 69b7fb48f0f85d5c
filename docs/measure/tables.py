"""What the scripts here share: words after a command, least times, tables in Markdown."""

import argparse
from pathlib import Path

import numpy as np

from jointlaw.support.progress import track

ROOT = Path(__file__).parents[2]


def asked(about, **words):
    """The words after a command, by name; --help shows `about`, the text of its script.

    words: by name the default of an option, which has its type (False: a switch), or a function
    that reads a word that must be given, or those that may be.
    """
    parser = argparse.ArgumentParser(
        description=about, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name, value in words.items():
        if callable(value):
            parser.add_argument(name, type=value)
        elif isinstance(value, tuple):
            parser.add_argument(name, choices=value)
        elif value is False:
            parser.add_argument(f"--{name}", action="store_true")
        else:
            parser.add_argument(f"--{name}", type=type(value), default=value, help=f"({value})")
    return parser.parse_args()


def folder(word):
    """The folder of this name, made if missing."""
    path = Path(word)
    path.mkdir(parents=True, exist_ok=True)
    return path


def least(cases, rounds):
    """The least of what each function {name: function} returned; they take turns in every round."""
    best = dict.fromkeys(cases, np.inf)
    for _ in track(range(rounds), "rounds", rounds):
        for name, once in cases.items():
            best[name] = min(best[name], once())
    return best


def table(head, rows):
    """All columns but the first are aligned to the right."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in row) + " |" for row in lines)
