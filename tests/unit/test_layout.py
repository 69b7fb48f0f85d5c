"""How the files of both packages hang together: imports one way, those of public names, and slow
ones only when they are asked for."""

import ast
import re
import subprocess
import sys
from collections import defaultdict
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import jointlaw as jl

ROOT = Path(__file__).parents[2]
PACKAGES = ("jointlaw", "dem_demo")
LATE = (
    "matplotlib", "pymunk", "tqdm", "pandas", "scipy.stats", "scipy.optimize", "scipy.spatial",
    "jointlaw.calibration", "jointlaw.surface", "jointlaw.tables.tabulate",
)  # fmt: skip


@cache
def trees():
    """Syntax tree of every file of both packages, by its path from the root of the repository."""
    files = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    return {p.relative_to(ROOT).as_posix(): ast.parse(p.read_text(encoding="utf-8")) for p in files}


def file_of(module):
    """The file that a dotted name stands for, if it is one of ours."""
    stem = module.replace(".", "/")
    return next((f for f in (f"{stem}.py", f"{stem}/__init__.py") if f in trees()), None)


def names(path, types=False):
    """Dotted names that a file imports anywhere when it runs, at its top and in functions; with
    `types` also those under TYPE_CHECKING."""
    nodes = list(ast.walk(trees()[path]))
    tests = [one for one in nodes if isinstance(one, ast.If) and not types]
    typing = [one for one in tests if getattr(one.test, "id", "") == "TYPE_CHECKING"]
    skipped = {id(part) for one in typing for part in ast.walk(one)}
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and id(node) not in skipped:
            above = path.split("/")[: -node.level] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from (f"{base}.{alias.name}" for alias in node.names)


def imported(path, types=False):
    """Files that a file imports.

    Importing a module also runs the `__init__.py` above it; that counts only where a name is taken
    from there, for the root's imports everything.
    """
    found = {file_of(name) or file_of(name.rpartition(".")[0]) for name in names(path, types)}
    return found - {None, path}


def test_no_circle_of_files_or_folders():
    """graphlib names the circle: move what both need into one below them.

    Types count for folders, too: a folder that names those of another lies above it.
    """
    folders = defaultdict(set)
    for path in trees():
        others = {file.rpartition("/")[0] for file in imported(path, types=True)}
        folders[path.rpartition("/")[0]] |= others - set(PACKAGES)
    inner = {folder: folders[folder] - {folder} for folder in folders.keys() - set(PACKAGES)}
    for graph in ({path: imported(path) for path in trees()}, inner):
        TopologicalSorter(graph).prepare()
    assert "jointlaw/accuracy/tradeoff.py" in imported("jointlaw/laws/joint_law.py")  # in functions


def test_jointlaw_never_imports_the_demo():
    ours = [path for path in trees() if path.startswith("jointlaw/")]
    assert not [name for path in ours for name in names(path) if name.startswith("dem_demo")]


def public_names():
    """Full names of what docs/api.md shows; "MODULE.*" where it shows all of a module."""
    shown = set()
    inside = ""
    module = ""
    for line in (ROOT / "docs/api.md").read_text(encoding="utf-8").splitlines():
        if found := re.match(r"\.\. currentmodule:: (\S+)", line):
            inside = f"{found[1]}."
        elif found := re.match(r"\.\. auto(\w+):: (\S+)", line):
            module = found[2] if found[1] == "module" else ""
            shown.add(found[2] if "." in found[2] else inside + found[2])
        elif module and (found := re.match(r"   :members:(.*)", line)):
            shown |= {f"{module}.{name.strip() or '*'}" for name in found[1].split(",")}
    return shown


def test_every_public_name_loads_and_stands_on_the_api_page():
    shown = {name for name in public_names() if re.fullmatch(r"jointlaw\.\w+", name)}
    assert shown == {f"jointlaw.{name}" for name in jl.__all__}
    for name in jl.__all__:
        assert getattr(jl, name).__name__.rpartition(".")[2] == name


def test_the_example_host_imports_public_names_only():
    """What dem_demo takes of jointlaw stands in docs/api.md: a host of others has it too."""
    public = public_names()
    demo = [path for path in trees() if path.startswith("dem_demo/")]
    taken = {(path, name) for path in demo for name in names(path, types=True)}
    hidden = {
        (path, name)
        for path, name in taken
        if name.startswith("jointlaw.") and not {name, f"{name.rpartition('.')[0]}.*"} & public
    }
    assert not hidden, f"give them a public place, or do without: {sorted(hidden)}"
    assert ("dem_demo/cli.py", "jointlaw.PathError") in taken


def test_a_code_that_embeds_the_law_loads_no_tools_for_measurements():
    code = "import sys, jointlaw; print(*sys.modules)"
    modules = subprocess.check_output([sys.executable, "-c", code], text=True).split()
    assert "jointlaw" in modules
    assert [module for module in modules if module.startswith(LATE)] == []
