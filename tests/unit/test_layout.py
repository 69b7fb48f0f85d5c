"""How the files of both packages hang together: imports one way."""

import ast
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("jointlaw", "dem_demo")


@cache
def trees():
    """Syntax tree of every file of both packages, by its path from the root of the repository."""
    files = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    return {p.relative_to(ROOT).as_posix(): ast.parse(p.read_text(encoding="utf-8")) for p in files}


def file_of(module):
    """The file that a dotted name stands for, if it is one of ours."""
    stem = module.replace(".", "/")
    return next((f for f in (f"{stem}.py", f"{stem}/__init__.py") if f in trees()), None)


def imported(path):
    """Files that a file imports anywhere when it runs: at its top and in functions.

    What stands under TYPE_CHECKING only names types, as that of the law which joints belong to.
    Importing a module also runs the `__init__.py` above it; that counts only where a name is taken
    from there, for the root's imports everything.
    """
    found, nodes = set(), list(ast.walk(trees()[path]))
    for node in nodes:
        if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            typing = {id(part) for one in node.body for part in ast.walk(one)}
            nodes = [part for part in nodes if id(part) not in typing]
    for node in nodes:
        if isinstance(node, ast.Import):
            found |= {file_of(alias.name) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = path.split("/")[: -node.level] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            found |= {file_of(f"{base}.{alias.name}") or file_of(base) for alias in node.names}
    return found - {None, path}


def circle(graph):
    """A circle of imports, each file before the one that it imports; empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return error.args[1][::-1]  # graphlib goes from a predecessor to what needs it
    return []


def test_no_circle_of_files():
    found = circle({path: imported(path) for path in trees()})
    assert not found, f"{' -> '.join(found)}: move what both need into a file below them"


def test_a_circle_is_found_and_imports_in_functions_count():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}
    assert circle(graph) in (["a", "b", "c", "a"], ["b", "c", "a", "b"], ["c", "a", "b", "c"])
    assert circle(graph | {"c": set()}) == []
    assert "jointlaw/accuracy/tradeoff.py" in imported("jointlaw/laws/joint_law.py")


def test_jointlaw_never_imports_the_demo():
    for path in trees():
        if path.startswith("jointlaw/"):
            assert not [f for f in imported(path) if f.startswith("dem_demo/")], path
