"""The directive `hosts`: the table of all hosts of `jointlaw export`, then their functions."""

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList

from jointlaw.hosts import HOSTS

HEADINGS = "host", "command", "files"


def rows():
    """Return a row for each host of `HOSTS`: codes, command, contents of the folder."""
    for host in HOSTS.values():
        yield host.codes, f"``jointlaw export {host.name} PRESET --out DIR``", host.contents


class Hosts(Directive):
    """``hosts`` without arguments."""

    def run(self):
        lines = [".. list-table::", "   :header-rows: 1", ""]
        for row in (HEADINGS, *rows()):
            lines += [f"   {'*' if i == 0 else ' '} - {cell}" for i, cell in enumerate(row)]
        lines.append("")
        lines += [f".. autofunction:: {host.function}" for host in HOSTS.values()]
        container = nodes.Element()
        self.state.nested_parse(StringList(lines, source="hosts"), self.content_offset, container)
        return container.children


def setup(app):
    app.add_directive("hosts", Hosts)
    return {"parallel_read_safe": True}
