"""How the files of both packages hang together: imports one way, small files, few at the root."""

import ast
import re
from functools import cache
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = {"jointlaw": 10, "dem_demo": 8}  # Python files at the root, at most
LINES = 400
LONGER = {"jointlaw/hosts/yade/files/yade_joint.py"}
# what a user runs prints; everything else returns, warns or logs
PRINTS = re.compile(r"(jointlaw|dem_demo)/(cli/|cli\.py|__main__\.py|hosts/(yade|lammps)/files/)")


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


def circles(graph):
    """Circles of a graph, each as the nodes along it; one edge of each is cut to find the next."""
    graph, found = {node: set(to) for node, to in graph.items()}, []
    while True:
        try:
            TopologicalSorter(graph).prepare()
        except CycleError as error:
            circle = error.args[1][::-1]  # graphlib goes from a predecessor to what needs it
            graph[circle[0]].discard(circle[1])
            found.append(circle)
        else:
            return found


def test_no_circle_of_files():
    found = circles({path: imported(path) for path in trees()})
    shown = "\n".join(" -> ".join(circle) for circle in found)
    assert not found, (
        f"{len(found)} circles of imports:\n{shown}\nMove what both need into a file below them."
    )


def test_circles_are_found():
    graph = {"a": {"b"}, "b": {"c"}, "c": set()}
    assert circles(graph) == []
    graph |= {"c": {"a"}, "d": {"e", "a"}, "e": {"d"}}
    found = circles(graph)
    assert sorted(sorted(set(circle)) for circle in found) == [["a", "b", "c"], ["d", "e"]]
    for circle in found:  # printed along the imports, and closed
        assert circle[0] == circle[-1]
        assert all(to in graph[node] for node, to in pairwise(circle))


def test_imports_are_read_wherever_they_stand():
    """The front door takes its annotation from one file and its rooms within functions."""
    assert "jointlaw/parameters/orientation.py" in imported("jointlaw/law.py")
    assert "jointlaw/accuracy/tradeoff.py" in imported("jointlaw/law.py")


def test_jointlaw_never_imports_the_demo():
    for path in trees():
        if path.startswith("jointlaw/"):
            assert not [f for f in imported(path) if f.startswith("dem_demo/")], path


@pytest.mark.parametrize("package", PACKAGES)
def test_few_files_at_the_root(package):
    files = sorted(path.name for path in (ROOT / package).glob("*.py"))
    assert len(files) <= PACKAGES[package], (
        f"{package} has {len(files)} files at its root, at most {PACKAGES[package]}: move one into "
        f"the room that holds its kind (CONTRIBUTING.md): {', '.join(files)}"
    )


def test_files_are_short():
    lengths = {path: (ROOT / path).read_text(encoding="utf-8").count("\n") for path in trees()}
    long = {p: n for p, n in lengths.items() if n > LINES and p not in LONGER}
    assert not long, f"more than {LINES} lines, split by what they hold: {long}"
    assert set(lengths) >= LONGER, "LONGER names a file that is gone"


def test_library_code_does_not_print():
    printing = [
        f"{path}:{node.lineno}"
        for path, tree in trees().items()
        if not PRINTS.match(path)
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, "id", None) == "print"
    ]
    assert not printing, f"return it, or use logging; commands (cli) print: {printing}"


def test_only_pages_of_this_project_are_cited():
    pages = {path.name for path in ROOT.glob("docs/*.md")} | {p.name for p in ROOT.glob("*.md")}
    # names of files that tests and commands write or make up
    made = {"ablation.md", "report.md", "comparison.md"}
    wrong = {}
    for folder in (*PACKAGES, "tests", "docs", "benchmarks"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".md", ".toml") and "_build" not in path.parts:
                cited = re.findall(r"[\w-]+\.md\b", path.read_text(encoding="utf-8"))
                if strange := sorted(set(cited) - pages - made):
                    wrong[path.relative_to(ROOT).as_posix()] = strange
    assert not wrong, f"cite docs/theory.md or docs/theory-incremental.md instead: {wrong}"
