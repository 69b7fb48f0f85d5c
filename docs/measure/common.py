"""Shared by the scripts of this folder: command line, shortest times, tables in Markdown."""

import argparse
import inspect
from pathlib import Path

import numpy as np

from jointlaw.support.progress import track

ROOT = Path(__file__).parents[2]


def run_command(description, *functions):
    """Call the function that the command line names, with the options of the command line.

    description: text of --help, the docstring of a script. functions: with more than one, the first
    word of the command line is the name of a function, written with hyphens. A parameter with a
    default is an option of the same type (False: a switch); a parameter without a default is a
    required word, and a folder that is created if its annotation is Path.
    """
    parser = new_parser(argparse.ArgumentParser, description)
    if len(functions) == 1:
        add_arguments(parser, functions[0])
        parser.set_defaults(function=functions[0])
    else:
        commands = parser.add_subparsers(required=True, metavar="COMMAND")
        for function in functions:
            text = inspect.getdoc(function)
            name = function.__name__.replace("_", "-")
            command = new_parser(commands.add_parser, text, name=name, help=text.splitlines()[0])
            add_arguments(command, function)
            command.set_defaults(function=function)
    options = vars(parser.parse_args())
    options.pop("function")(**options)


def new_parser(make, description, **options):
    """A parser whose help keeps the line breaks of the description."""
    formatter = argparse.RawDescriptionHelpFormatter
    return make(description=description, formatter_class=formatter, **options)


def add_arguments(parser, function):
    """Add the parameters of a function to the parser of its command."""
    for name, parameter in inspect.signature(function).parameters.items():
        default = parameter.default
        if default is parameter.empty:
            is_folder = parameter.annotation is Path
            parser.add_argument(name, type=created_folder if is_folder else str)
        elif default is False:
            parser.add_argument(f"--{name}", action="store_true")
        else:
            parser.add_argument(f"--{name}", type=type(default), default=default,
                                help=f"(default: {default})")  # fmt: skip


def created_folder(name):
    """The folder of this name, created if missing."""
    path = Path(name)
    path.mkdir(parents=True, exist_ok=True)
    return path


def shortest_times(cases, rounds):
    """Shortest time of each case {name: function that returns a time}.

    The cases take turns in every round, so that a change of the processor's speed meets them all.
    """
    shortest = dict.fromkeys(cases, np.inf)
    for _ in track(range(rounds), "rounds", rounds):
        for name, measure in cases.items():
            shortest[name] = min(shortest[name], measure())
    return shortest


def print_table(head, rows):
    """Print a table in Markdown; all columns but the first are aligned to the right."""
    rule = ["---", *["---:"] * (len(head) - 1)]
    for row in (head, rule, *rows):
        print("| " + " | ".join(str(cell) for cell in row) + " |")
