"""Faults in what a user reads, generated from the tables of columns, keys, units, states and pages.

    columns   two columns of a table are exchanged
    keys      an optional key of a scene, a parameter of a law file or an option of a command is
              ignored
    units     a factor of a unit is ten times too large, degrees are not converted
    pictures  an artist is drawn with the other sign or with x and y exchanged, an axis has
              another unit
    state     an entry of a saved state is not restored
    pages     a digit of a number that a command prints is another one

A fault is a file, the first and the last byte of the text that it replaces, and the new text.
`tests/mutants.py --outputs` inserts them.
"""

import ast
import importlib
import itertools
import re
from collections import defaultdict
from dataclasses import MISSING, fields
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
UNIT_AT_END = re.compile(
    r"[_: ](m|mm|um|m2|m3|N|kN|Pa|kPa|MPa|J|s|deg|rad|m/s|rad/s|m_per_s|J_per_m2|Pa_per_m)$"
)
TABLE_NAME = re.compile(r"_?[A-Z_]*(COLUMNS|ENERGIES|TITLES|UNITS)$")
UNIT_TABLE_NAME = re.compile(r"_?[A-Z_]*(UNITS|PREFIX|PREFIXES|FACTORS|STRESS|COMMON)$")
POWERS_OF_TEN = {1e3, 1e6, 1e9, 1e-3, 1e-6}  # 1e-9 is a tolerance wherever it stands
ARTISTS = {
    "plot", "quiver", "scatter", "errorbar", "fill_between", "axhline", "axvline", "annotate",
    "text", "bar", "add_mesh", "add_arrows", "add_lines", "add_points", "LineCollection",
    "PolyCollection", "Polygon", "Line2D",
}  # fmt: skip
UNIT_IN_LABEL = re.compile(r"\((mm|µm|um|m|kPa|MPa|Pa|°|%|degrees|s|J/m²|m/s)\)")
OTHER_UNIT = {
    "mm": "m", "µm": "mm", "um": "mm", "m": "mm", "kPa": "MPa", "MPa": "kPa", "Pa": "kPa",
    "°": "rad", "%": "1", "degrees": "rad", "s": "ms", "J/m²": "kJ/m²", "m/s": "mm/s",
}  # fmt: skip
# Commands by which a page says where its numbers come from
COMMAND_ON_PAGE = re.compile(r"docs/make_all\.py|pytest |python -m |`jointlaw \w+ ")
# 2-D and 2-norm are words
NUMBER = re.compile(r"(?<![\w.^/\[-])\d[\d_]*(?:\.\d+)?(?=(?:e-?\d+)?(?![\w.]*\w|-[a-zA-Z]))")
NOT_PROSE = re.compile(r"`[^`]*`|\$[^$]*\$|\]\([^)]*\)|Eq\. [\d, -]+|Figure \d+|<[^>]*>")
DROP = """
    def _without(table, key, *rest):
        if isinstance(table, list | tuple):
            return [_without(one, key, *rest) for one in table]
        if not isinstance(table, dict) or key not in table:
            return table
        other = {k: v for k, v in table.items() if k != key}
        return other | {key: _without(table[key], *rest)} if rest else other
    top = DEFAULTS | _without(top, *%r)
"""


class Fault(NamedTuple):
    """A fault: kind, file in the repository, bytes that it replaces, new text, description."""

    kind: str
    file: str
    start: int
    end: int
    new: str
    what: str


class Source:
    """A file of Python with the positions of its nodes."""

    def __init__(self, file):
        self.file = file
        self.module = file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        self.text = (ROOT / file).read_bytes()
        self.tree = ast.parse(self.text)
        lines = self.text.splitlines(keepends=True)
        self.line_starts = [0, *itertools.accumulate(map(len, lines))]

    @cached_property
    def nodes(self):
        """All nodes of the tree."""
        return [*ast.walk(self.tree)]

    def span(self, node):
        return (
            self.line_starts[node.lineno - 1] + node.col_offset,
            self.line_starts[node.end_lineno - 1] + node.end_col_offset,
        )

    def source(self, node):
        start, end = self.span(node)
        return self.text[start:end].decode()

    def replacement(self, kind, node, new, what=""):
        """A fault that replaces a node."""
        start, end = self.span(node)
        return Fault(kind, self.file, start, end, new, what or f"{self.source(node)} -> {new}")

    def exchange(self, kind, one, other):
        """A fault that exchanges two nodes; `one` comes first."""
        first_start, first_end = self.span(one)
        second_start, second_end = self.span(other)
        first, second = self.source(one), self.source(other)
        between = self.text[first_end:second_start].decode()
        new = f"{second}{between}{first}"
        return Fault(kind, self.file, first_start, second_end, new, f"{first} <-> {second}")

    def insertion(self, kind, after, new, what):
        """A fault that inserts lines after the line of a text that occurs once."""
        assert self.text.count(after.encode()) == 1, (self.file, after)
        place = self.text.index(b"\n", self.text.index(after.encode()) + len(after) - 1)
        return Fault(kind, self.file, place, place, new.rstrip("\n"), what)


def sources():
    """All sources of the two packages but scripts for hosts."""
    for folder in ("jointlaw", "dem_demo"):
        for path in sorted(ROOT.glob(f"{folder}/**/*.py")):
            if "files" not in path.parts and "native" not in path.parts:
                yield Source(str(path.relative_to(ROOT)))


def texts(nodes):
    """Values of constant texts, None for other nodes."""
    return [
        node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None
        for node in nodes
    ]


def has_unit(names):
    return any(name and UNIT_AT_END.search(name) for name in names)


def constants_of_module(source):
    """Names and values that a module assigns."""
    for node in source.tree.body:
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            for name in ast.walk(target):
                if isinstance(name, ast.Name):
                    yield name.id, node.value


def column_faults(source):
    """Exchanges of neighbours in tables of columns: values in dicts, titles in lists."""
    if "support" in source.file:
        return
    synonyms = {  # other names of one column, in any order
        one
        for node in source.nodes
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "Quantity"
        for one in node.args
    }
    tables = {value for name, value in constants_of_module(source) if TABLE_NAME.match(name)}
    for node in source.nodes:
        if isinstance(node, ast.Dict):
            names = texts(node.keys)
            if has_unit(names) or node in tables:
                for i in range(len(names) - 1):
                    one, other = node.values[i : i + 2]
                    if None not in names[i : i + 2] and ast.dump(one) != ast.dump(other):
                        yield source.exchange("columns", one, other)
        elif isinstance(node, ast.Tuple | ast.List) and node not in synonyms:
            names = texts(node.elts)
            if has_unit(names) or node in tables:
                for i in range(len(names) - 1):
                    if None not in names[i : i + 2]:
                        yield source.exchange("columns", *node.elts[i : i + 2])


def unit_faults(source):
    """Factors of tables of units, powers of ten that multiply or divide, and degrees."""
    tables = {value for name, value in constants_of_module(source) if UNIT_TABLE_NAME.match(name)}
    for inner in (node for table in tables for node in ast.walk(table)):
        if not isinstance(inner, ast.Constant):
            continue
        if isinstance(inner.value, float):
            yield source.replacement("units", inner, repr(10.0 * inner.value))
        elif isinstance(inner.value, str) and re.match(r"[\d.]+[a-zA-Z]", inner.value):
            number, unit = re.fullmatch(r"([\d.]+)(.*)", inner.value).groups()
            yield source.replacement("units", inner, f'"{10 * float(number):.7g}{unit}"')
    for node in source.nodes:
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult | ast.Div):
            for side in (node.left, node.right):
                if isinstance(side, ast.Constant) and side.value in POWERS_OF_TEN:
                    what = f"{source.source(node)}: {side.value:g} ten times larger"
                    yield source.replacement("units", side, f"{10 * side.value:g}", what)
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in (
            "np.degrees", "np.radians", "math.degrees", "math.radians",
        ):  # fmt: skip
            yield source.replacement("units", node, f"({source.source(node.args[0])})")


def picture_faults(source):
    """Signs and order of the data of artists, and units in the labels, where pictures are made."""
    calls = [
        node
        for node in source.nodes
        if isinstance(node, ast.Call)
        and ast.unparse(node.func).rpartition(".")[2] in ARTISTS
        and (node.args or node.keywords)
    ]
    if not calls or not re.search(rb"matplotlib|pyplot|pyvista", source.text):
        return
    for call in calls:
        data = [
            one for one in call.args if not isinstance(one, ast.Starred | ast.List | ast.Constant)
        ]
        for one in data:
            yield source.replacement("pictures", one, f"(-1 * ({source.source(one)}))")
        if len(data) >= 2:
            yield source.exchange("pictures", *data[:2])
    docstrings = {node.value for node in source.nodes if isinstance(node, ast.Expr)}
    for node in source.nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            if node in docstrings:
                continue
            match = UNIT_IN_LABEL.search(node.value)
            is_short = node.lineno == node.end_lineno
            if match and is_short and f"({match[1]})" in source.source(node):
                text = source.source(node)
                new = text.replace(f"({match[1]})", f"({OTHER_UNIT[match[1]]})", 1)
                yield source.replacement("pictures", node, new)
        elif isinstance(node, ast.Dict):  # curves and colours by their labels
            names = texts(node.keys)
            for i in range(len(names) - 1):
                one, other = node.values[i : i + 2]
                if None not in names[i : i + 2] and ast.dump(one) != ast.dump(other):
                    yield source.exchange("pictures", one, other)


def key_faults(all_sources):
    """Optional keys of scenes, parameters of law files and options of commands, ignored."""
    import dem_demo.cli
    import dem_demo.scene.keys
    import dem_demo.space.keys
    import jointlaw.cli.main
    from jointlaw.cli.command import Group
    from jointlaw.parameters.declared import parameters_of

    for file, keys in (
        ("dem_demo/scene/read.py", dem_demo.scene.keys),
        ("dem_demo/space/read.py", dem_demo.space.keys),
    ):
        refused = getattr(keys, "not_there_yet", None)
        source = Source(file)
        after = "top = DEFAULTS | keys.validate_table(data, SCENE, where)"
        for path in optional_paths(keys.SCENE, refused):
            what = f"key {'.'.join(path)} is ignored"
            yield source.insertion("keys", after, DROP % (path,), what)
    source = Source("jointlaw/parameters/toml.py")
    after = "values = validate_table(table, keys_of(kind), where, path)"
    for kind in classes_built_from_tables(all_sources):
        for name in parameters_of(kind):
            line = (
                f"\n    if kind.__name__ == {kind.__name__!r}:\n        values.pop({name!r}, None)"
            )
            yield source.insertion("keys", after, line, f"{kind.__name__}.{name} is ignored")
    for file, commands in (
        ("jointlaw/cli/main.py", jointlaw.cli.main.COMMANDS),
        ("dem_demo/cli.py", dem_demo.cli.COMMANDS),
    ):
        source = Source(file)
        for command in commands:
            groups = [one.options if isinstance(one, Group) else (one,) for one in command.options]
            for names, settings in itertools.chain(*groups):
                name = names[-1]
                if not name.startswith("--") or settings.get("required"):
                    continue
                attribute = settings.get("dest", name[2:].replace("-", "_"))
                default = False if settings.get("action") == "store_true" else None
                default = settings.get("default", default)
                if default is not None and not isinstance(default, str | int | float):
                    continue
                line = (
                    f"\n        if options.command == {command.name!r}:\n"
                    f"            options.{attribute} = {default!r}"
                )
                yield source.insertion(
                    "keys", "options = _parse(words)", line, f"{command.name} {name} is ignored"
                )


def optional_paths(rules, refused, above=()):
    """Paths of optional keys that hold a value."""
    for key, rule in rules.items():
        path = (*above, key.rstrip("!"))
        inner = rule[0] if isinstance(rule, list) else rule
        if isinstance(inner, dict):
            yield from optional_paths(inner, refused, path)
        elif not key.endswith("!") and (rule is not refused or rule is None):
            yield path


def classes_built_from_tables(all_sources):
    """All classes that declare parameters, but those that read their own table."""
    for source in all_sources:
        for node in source.tree.body:
            decorators = [ast.unparse(one) for one in getattr(node, "decorator_list", ())]
            methods = [getattr(one, "name", "") for one in getattr(node, "body", ())]
            if "declared" in decorators and "from_table" not in methods:
                yield getattr(importlib.import_module(source.module), node.name)


def table_faults(source):
    """Keys of tables that are read without rules, ignored.

    Fields of classes that read their own table (`from_table`) have their default, or 1; and keys
    that a function looks for in one of its parameters, a table, are not there.
    """
    if not re.search(rb"from_table|: Table|: Mapping\[str", source.text):
        return
    for kind in (node for node in source.tree.body if isinstance(node, ast.ClassDef)):
        methods = [one for one in kind.body if getattr(one, "name", "") == "from_table"]
        returns = [
            one for method in methods for one in ast.walk(method) if isinstance(one, ast.Return)
        ]
        for node in returns:
            for item in fields(getattr(importlib.import_module(source.module), kind.name)):
                is_factory = item.default_factory is not MISSING
                default = item.default_factory() if is_factory else item.default
                value = repr(1.0 if default is MISSING else default)
                made = source.source(node.value)
                new = f'__import__("dataclasses").replace({made}, {item.name}={value})'
                what = f"{kind.name}.{item.name} is ignored"
                yield source.replacement("keys", node.value, new, what)
    for function in (one for one in source.nodes if isinstance(one, ast.FunctionDef)):
        tables = {
            one.arg for one in function.args.args
            if one.annotation and re.match(r"Tables?$|Mapping\[str", ast.unparse(one.annotation))
        }  # fmt: skip
        for node in ast.walk(function):
            match node:
                case ast.Compare(
                    left=ast.Constant(value=str(key)),
                    ops=[ast.In()],
                    comparators=[ast.Name(id=name)],
                ) if name in tables:
                    yield source.replacement("keys", node, "False", f"key {key} is not there")
                case ast.Call(
                    func=ast.Attribute(value=ast.Name(id=name), attr="get"),
                    args=[ast.Constant(value=str(key)), *default],
                ) if name in tables:
                    new = source.source(default[0]) if default else "None"
                    yield source.replacement("keys", node, f"({new})", f"key {key} is not there")


def state_faults():
    """Entries of saved states that are not restored."""
    import kinds

    from dem_demo import Simulation
    from dem_demo.space.simulation import SpaceSimulation

    source = Source("dem_demo/dynamics/simulation.py")
    for kind in (Simulation, SpaceSimulation):
        for path in kind.state_paths:
            line = (
                f"\n            if path == {path!r} and type(self).__name__ == {kind.__name__!r}:"
                "\n                continue"
            )
            what = f"{path} of {kind.__name__} is not restored"
            yield source.insertion("state", "for path in self.state_paths:\n", line, what)
    source = Source("dem_demo/contact/joints.py")
    for node in source.nodes:
        if isinstance(node, ast.FunctionDef) and node.name == "restore":
            for statement in node.body:
                if isinstance(statement, ast.Assign) and "self" in ast.unparse(statement.targets):
                    yield source.replacement("state", statement, "pass")
    source = Source("jointlaw/joints/batch.py")
    rows = {name for law in kinds.LAWS.values() for name in law.tables.row_counts}
    for name in sorted(rows):
        line = f"""
        if {name!r} in self.law.tables.row_counts:
            first = self.law.tables.first_rows[{name!r}]
            dropped = state.values.copy()
            dropped[:, first : first + self.law.tables.row_counts[{name!r}]] = 0.0
            state = JointState(state.fingerprint, dropped)"""
        yield source.insertion(
            "state",
            "require_admissible_states(self.law.tables, state.values)\n",
            line,
            f"rows {name} are not restored",
        )


def pages():
    return [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md"))]


def printed_parts(text):
    """Spans (start, end) of a page whose numbers a command prints.

    Tables between marks; paragraphs that name a command, and tables below them; all of README,
    for whose numbers a table of validation.md names the commands.
    """
    for match in re.finditer(r"<!-- ([\w-]+) -->\n(.*?)<!-- end of \1 -->", text, re.DOTALL):
        yield match.span(2)
    outside = re.sub(
        r"<!-- ([\w-]+) -->\n.*?<!-- end of \1 -->|^```.*?^```$|^    [^\n]*$",
        lambda match: re.sub(r"[^\n]", " ", match[0]),
        text,
        flags=re.DOTALL | re.MULTILINE,
    )
    item = r"- |\d+\. "  # of a list: a paragraph of its own
    pattern = rf"^.*\S.*$\n?(?:^(?!{item}).*\S.*$\n?)*"
    paragraphs = list(re.finditer(pattern, outside, re.MULTILINE))
    is_readme = "<!-- test command -->" in text  # a table of validation.md has its commands
    end = 0
    previous = ""
    for paragraph in paragraphs:
        follows = not text[end : paragraph.start()].strip()
        above = previous if paragraph[0].startswith("|") and follows else ""
        if COMMAND_ON_PAGE.search(paragraph[0] + above) or is_readme:
            yield paragraph.span()
        end = paragraph.end()
        previous = paragraph[0]


def page_faults():
    """Another last digit of a number that a command prints."""
    for path in pages():
        text = path.read_text(encoding="utf-8")
        for start, end in printed_parts(text):
            part = NOT_PROSE.sub(lambda match: " " * len(match[0]), text[start:end])
            for match in NUMBER.finditer(part):
                if len(match[0]) == 1 and not part[: match.start()].endswith(("| ", "+", "-")):
                    continue  # a small number of prose: two laws, three points
                place = len(text[: start + match.end() - 1].encode())
                digit = str((int(match[0][-1]) + 1) % 10)
                line = text[: start + match.start()].count("\n") + 1
                what = f"{match[0]} -> {match[0][:-1]}{digit} in line {line}"
                yield Fault("pages", str(path.relative_to(ROOT)), place, place + 1, digit, what)


def all_faults():
    """Faults by kind."""
    faults = defaultdict(list)
    all_sources = [*sources()]
    for source in all_sources:
        for find in (column_faults, unit_faults, picture_faults, table_faults):
            for fault in find(source):
                faults[fault.kind].append(fault)
    for fault in itertools.chain(key_faults(all_sources), state_faults(), page_faults()):
        faults[fault.kind].append(fault)
    return {kind: sorted({*found}) for kind, found in faults.items()}
