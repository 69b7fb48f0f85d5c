"""How the files of both packages hang together: imports one way, and those of public names."""

import ast
import re
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


def imported(path, types=False):
    """Files that a file imports anywhere when it runs, at its top and in functions; with `types`
    also what stands under TYPE_CHECKING.

    Importing a module also runs the `__init__.py` above it; that counts only where a name is taken
    from there, for the root's imports everything.
    """
    found, nodes = set(), list(ast.walk(trees()[path]))
    for node in nodes:
        if (
            isinstance(node, ast.If)
            and getattr(node.test, "id", "") == "TYPE_CHECKING"
            and not types
        ):
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


def test_no_circle_of_files_or_folders():
    """Types count for folders, too: a folder that names those of another lies above it."""
    folders = {}
    for path in trees():
        folder = path.rpartition("/")[0]
        others = {file.rpartition("/")[0] for file in imported(path, types=True)}
        if "/" in folder:
            folders[folder] = folders.get(folder, set()) | (others - {folder, *PACKAGES})
    for graph in ({path: imported(path) for path in trees()}, folders):
        found = circle(graph)
        assert not found, f"{' -> '.join(found)}: move what both need into one below them"


def test_a_circle_is_found_and_imports_in_functions_count():
    graph = {"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}
    assert circle(graph) in (["a", "b", "c", "a"], ["b", "c", "a", "b"], ["c", "a", "b", "c"])
    assert circle(graph | {"c": set()}) == []
    assert "jointlaw/accuracy/tradeoff.py" in imported("jointlaw/laws/joint_law.py")


def test_jointlaw_never_imports_the_demo():
    for path in trees():
        if path.startswith("jointlaw/"):
            assert not [f for f in imported(path) if f.startswith("dem_demo/")], path


def public_names():
    """Full names of what docs/api.md shows; "MODULE.*" where it shows all of a module."""
    names, inside, module = set(), "", ""
    for line in (ROOT / "docs/api.md").read_text(encoding="utf-8").splitlines():
        if found := re.match(r"\.\. currentmodule:: (\S+)", line):
            inside = f"{found[1]}."
        elif found := re.match(r"\.\. auto(\w+):: (\S+)", line):
            module = found[2] if found[1] == "module" else ""
            names.add(found[2] if "." in found[2] else inside + found[2])
        elif module and (found := re.match(r"   :members:(.*)", line)):
            names |= {f"{module}.{name.strip() or '*'}" for name in found[1].split(",")}
    return names


def test_the_example_host_imports_public_names_only():
    """What dem_demo takes of jointlaw stands in docs/api.md: a host of others has it too."""
    public, taken = public_names(), set()
    for path in trees():
        for node in ast.walk(trees()[path]) if path.startswith("dem_demo/") else ():
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names = [f"{node.module}.{alias.name}" for alias in node.names]
            else:
                continue
            taken |= {(path, name) for name in names if name.startswith("jointlaw")}
    hidden = {
        (path, name)
        for path, name in taken
        if name != "jointlaw" and not {name, f"{name.rpartition('.')[0]}.*"} & public
    }
    assert not hidden, f"give them a public place, or do without: {sorted(hidden)}"
    assert ("dem_demo/cli.py", "jointlaw.PathError") in taken
