"""Imports of both packages: without cycles, dem_demo of public names only, slow modules lazily."""

import ast
import pkgutil
import re
import subprocess
import sys
from collections import defaultdict
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import jointlaw as jl
from jointlaw.hosts import HOSTS

ROOT = Path(__file__).parents[2]
PACKAGES = ("jointlaw", "dem_demo")
LAZY_MODULES = (
    "matplotlib", "pymunk", "tqdm", "pandas", "scipy.stats", "scipy.optimize", "scipy.spatial",
    "jointlaw.calibration", "jointlaw.surface", "jointlaw.tables.tabulate",
)  # fmt: skip


@cache
def trees():
    """Syntax tree of every file of both packages, by its path from the root of the repository."""
    files = [path for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    return {p.relative_to(ROOT).as_posix(): ast.parse(p.read_text(encoding="utf-8")) for p in files}


def file_of(module):
    """The file of a dotted module name, None for other packages."""
    stem = module.replace(".", "/")
    return next((f for f in (f"{stem}.py", f"{stem}/__init__.py") if f in trees()), None)


def names(path, types=False):
    """Dotted names that a file imports at its top and in functions.

    types: whether imports under TYPE_CHECKING count.
    """
    nodes = list(ast.walk(trees()[path]))
    conditions = [node for node in nodes if isinstance(node, ast.If) and not types]
    typing = [node for node in conditions if getattr(node.test, "id", "") == "TYPE_CHECKING"]
    skipped = {id(part) for node in typing for part in ast.walk(node)}
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and id(node) not in skipped:
            above = path.split("/")[: -node.level] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from (f"{base}.{alias.name}" for alias in node.names)


def imported(path, types=False):
    """Files that a file imports.

    Importing a module also runs the `__init__.py` of its package. That counts only where a name is
    imported from the package, because the root package imports everything.
    """
    files = {file_of(name) or file_of(name.rpartition(".")[0]) for name in names(path, types)}
    return files - {None, path}


def test_imports_have_no_cycle():
    """Neither files nor folders; the error names the cycle: move the common part into a file below.

    Types count for folders: a folder that names a type of another folder lies above it.
    """
    folders = defaultdict(set)
    for path in trees():
        imports = {file.rpartition("/")[0] for file in imported(path, types=True)}
        folders[path.rpartition("/")[0]] |= imports - set(PACKAGES)
    inner = {folder: folders[folder] - {folder} for folder in folders.keys() - set(PACKAGES)}
    for graph in ({path: imported(path) for path in trees()}, inner):
        TopologicalSorter(graph).prepare()
    assert "jointlaw/accuracy/tradeoff.py" in imported("jointlaw/laws/joint_law.py")  # in functions


def test_jointlaw_never_imports_the_demo():
    ours = [path for path in trees() if path.startswith("jointlaw/")]
    assert not [name for path in ours for name in names(path) if name.startswith("dem_demo")]


def api_pages():
    """Text of all pages of the reference of functions."""
    pages = sorted((ROOT / "docs").glob("api*.md"))
    return "\n".join(page.read_text(encoding="utf-8") for page in pages)


def public_names():
    """Full names on docs/api*.md; "MODULE.*" where a page documents all members of a module."""
    public = set()
    current_module = ""
    module = ""
    for line in api_pages().splitlines():
        if match := re.match(r"\.\. currentmodule:: (\S+)", line):
            current_module = f"{match[1]}."
        elif match := re.match(r"\.\. auto(\w+):: (\S+)", line):
            module = match[2] if match[1] == "module" else ""
            public.add(match[2] if "." in match[2] else current_module + match[2])
        elif line == ".. hosts::":
            public |= {f"{current_module}{host.function}" for host in HOSTS.values()}
        elif module and (match := re.match(r"   :members:(.*)", line)):
            public |= {f"{module}.{name.strip() or '*'}" for name in match[1].split(",")}
    return public


def test_every_public_name_loads_and_is_on_the_api_page():
    documented = {name for name in public_names() if re.fullmatch(r"jointlaw\.\w+", name)}
    assert documented == {f"jointlaw.{name}" for name in jl.__all__}
    for name in jl.__all__:
        assert getattr(jl, name).__name__.rpartition(".")[2] == name


def test_the_example_host_imports_public_names_only():
    """All names that dem_demo imports from jointlaw are on docs/api*.md, for hosts of others."""
    public = public_names()
    demo = [path for path in trees() if path.startswith("dem_demo/")]
    imports = {(path, name) for path in demo for name in names(path, types=True)}
    public.add("jointlaw.__version__")  # of every package, so the page does not list it
    private = {
        (path, name)
        for path, name in imports
        if name.startswith("jointlaw.") and not {name, f"{name.rpartition('.')[0]}.*"} & public
    }
    assert not private, (
        f"document them on docs/api-support.md, or do not use them: {sorted(private)}"
    )
    assert ("dem_demo/cli.py", "jointlaw.PathError") in imports


def test_importing_jointlaw_loads_no_slow_modules():
    code = "import sys, jointlaw; print(*sys.modules)"
    modules = subprocess.check_output([sys.executable, "-c", code], text=True).split()
    assert "jointlaw" in modules
    assert [module for module in modules if module.startswith(LAZY_MODULES)] == []


def test_packages_import_without_docstrings():
    """`python -OO` strips docstrings and assertions."""
    code = "import jointlaw, dem_demo; jointlaw.presets.load('linear-a3').joint().update([1, 0, 0])"
    subprocess.run([sys.executable, "-OO", "-c", code], check=True)


def test_the_api_pages_name_each_module_once_and_existing_members_only():
    """The site is built with warnings as errors; this sees the same without building it."""
    blocks = re.findall(r"\.\. automodule:: (\S+)\n(?:   :members: (.*)\n)?", api_pages())
    modules = [module for module, _ in blocks]
    assert len(set(modules)) == len(modules)
    for module, members in blocks:
        loaded = pkgutil.resolve_name(module)
        for member in filter(None, re.split(r",\s*", members)):
            assert hasattr(loaded, member), f"docs/api*.md: {module} has no {member}"
