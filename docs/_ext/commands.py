"""The directive `help`: the text that a command prints for --help, under a heading of its own."""

import os
import re
import subprocess
import sys

from docutils import nodes
from docutils.parsers.rst import Directive


def help_text(*words):
    """Return the output of `python -m WORDS --help`, as wide as a page of the site."""
    environment = os.environ | {"COLUMNS": "96"}
    command = [sys.executable, "-m", *words, "--help"]
    finished = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    return finished.stdout


def subcommands(text):
    """Return the words that a help text lists as commands with a help text of their own."""
    listed = re.search(r"^  (?:COMMAND|HOST)\n((?:    .*\n)+)", text, re.MULTILINE)
    return re.findall(r"^    (\w[\w-]*)", listed[1], re.MULTILINE) if listed else []


def example_commands(text):
    """Return the words after the program's name in the examples of its help text."""
    return re.findall(r"^  python -m \w+ ([a-z][a-z-]*)\b", text, re.MULTILINE)


class Help(Directive):
    """``help`` with the name of a module: its help text, then the one of each of its commands."""

    required_arguments = 1

    def run(self):
        program = self.arguments[0]
        overview = help_text(program)
        first_words = dict.fromkeys(subcommands(overview) or example_commands(overview))
        pending = [[], *([word] for word in first_words)]
        sections = []
        for words in pending:  # grows while commands with subcommands are found
            name = " ".join([program, *words])
            section = nodes.section(ids=[nodes.make_id(name)])
            section += nodes.title(text=name)
            text = help_text(program, *words) if words else overview
            if words:
                pending += [[*words, word] for word in subcommands(text)]
            section += nodes.literal_block(text, text, language="text")
            sections.append(section)
        return sections


def setup(app):
    app.add_directive("help", Help)
    return {"parallel_read_safe": True}
