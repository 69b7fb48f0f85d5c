"""The directive `help`: what a command prints for --help, under a heading of its own."""

import os
import re
import subprocess
import sys

from docutils import nodes
from docutils.parsers.rst import Directive


def told(*words):
    """What a command prints for --help, as wide as a page of the site."""
    env = os.environ | {"COLUMNS": "96"}
    command = [sys.executable, "-m", *words, "--help"]
    return subprocess.run(command, check=True, capture_output=True, text=True, env=env).stdout


def verbs(text):
    """Words that a help lists as commands with a help of their own."""
    listed = re.search(r"^  (?:COMMAND|HOST)\n((?:    .*\n)+)", text, re.MULTILINE)
    return re.findall(r"^    (\w[\w-]*)", listed[1], re.MULTILINE) if listed else []


def shown(text):
    """Words after the program's name in the examples of its own help."""
    return re.findall(r"^  python -m \w+ ([a-z][a-z-]*)\b", text, re.MULTILINE)


class Help(Directive):
    """``help`` with the name of a module: its own help, then that of each of its commands."""

    required_arguments = 1

    def run(self):
        program = self.arguments[0]
        whole, parts = told(program), []
        todo = [[], *([verb] for verb in dict.fromkeys(verbs(whole) or shown(whole)))]
        for words in todo:
            name = " ".join([program, *words])
            part = nodes.section(ids=[nodes.make_id(name)])
            part += nodes.title(text=name)
            text = told(program, *words) if words else whole
            todo += [[*words, verb] for verb in verbs(text)] if words else []
            part += nodes.literal_block(text, text, language="text")
            parts.append(part)
        return parts


def setup(app):
    app.add_directive("help", Help)
    return {"parallel_read_safe": True}
