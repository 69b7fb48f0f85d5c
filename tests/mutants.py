"""Faults drawn at random, put in one at a time: which does no test see?

    python tests/mutants.py jointlaw/laws jointlaw/native/law.h --count 40 --seed 1

A first run tells which test runs which line; it is kept for the same sources. Then each fault is
run against the tests of its line; of its file, where the line runs at import; of all joints or
blocks, where it is in C. All this in copies, under the temporary folder, of what git holds, staged
changes included. No part of CI. Needs `pip install pytest-cov`.
"""

import argparse
import ast
import collections
import hashlib
import itertools
import json
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[1]
HOME = Path(tempfile.gettempdir()) / f"mutants-{hashlib.sha256(bytes(ROOT)).hexdigest()[:8]}"
BUILT = {"jointlaw": "jointlaw/native/built", "dem_demo": "dem_demo/native/built"}
COVERAGE = """\
[run]
source = jointlaw, dem_demo
parallel = true
patch = subprocess
[json]
show_contexts = true
"""
IN_C = (
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r" / ", " * "), (r" < ", " <= "),
    (r" > ", " >= "), (r" ([<>])= ", r" \1 "), (r" == ", " != "), (r" && ", " || "),
    (r" \|\| ", " && "), (r" \+= ", " -= "), (r" -= ", " += "), (r"(?<=[(,= ])-(?=\w)", ""),
    (r"\b0\.5\b", "0.6"), (r"\b1\.0\b", "1.1"), (r"\b0\.0\b", "0.1"), (r"\b1\b", "2"),
    (r"\bif \((.*)\)", r"if (!(\1))"), (r"\b(\w+)\((\w+), (\w+)", r"\1(\3, \2"),
    (r"^( +)[^{}]*;$", r"\1;"),
)  # fmt: skip
OTHER = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.And: ast.Or,
    ast.Or: ast.And, ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip


def changed(node, **fields):
    """A copy of a node with other fields."""
    return type(node)(**(vars(node) | fields))


def faults_of(node):
    """Nodes of Python, this one or its condition, each with what may stand in its place."""
    match node:
        case ast.BinOp(op=op) | ast.BoolOp(op=op) | ast.AugAssign(op=op) if type(op) in OTHER:
            yield node, changed(node, op=OTHER[type(op)]())
        case ast.Compare(ops=[op]):
            yield node, changed(node, ops=[OTHER[type(op)]()])
        case ast.UnaryOp(operand=operand):
            yield node, operand
        case ast.Constant(value=bool(value)):
            yield node, ast.Constant(not value)
        case ast.Constant(value=int(value)):
            yield node, ast.Constant(value + 1)
        case ast.Constant(value=float(value)):
            yield node, ast.Constant(1.1 * value or 0.1)
        case ast.Constant(value=str(value)) if re.fullmatch(r"[\w./-]+", value):
            yield node, ast.Constant(f"{value}x")
        case ast.If(test=test) | ast.IfExp(test=test) | ast.While(test=test):
            yield test, ast.UnaryOp(ast.Not(), test)
            yield test, ast.Constant(False)
        case ast.Call(args=[first, second, *rest]):
            yield node, changed(node, args=[second, first, *rest])
        case ast.Call(keywords=[*rest, _]):
            yield node, changed(node, keywords=rest)
        case ast.Raise() | ast.Assign() | ast.Expr():
            yield node, ast.Pass()


def in_python(text):
    """Each fault: its line, that of its statement as coverage counts, its first and last byte, and
    what stands there. Types, docstrings and messages have none.
    """
    starts = [0, *itertools.accumulate(map(len, text.splitlines(keepends=True)))]
    queue = [(ast.parse(text), 0)]
    while queue:
        node, of = queue.pop()
        docstring = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if docstring or isinstance(node, ast.JoinedStr):
            continue
        of = node.lineno if isinstance(node, ast.stmt) else of
        for name, below in ast.iter_fields(node):
            if name not in ("annotation", "returns"):
                below = below if isinstance(below, list) else [below]
                queue += [(one, of) for one in below if isinstance(one, ast.AST)]
        for old, new in faults_of(node):
            said = ast.unparse(new) if isinstance(new, ast.stmt) else f"({ast.unparse(new)})"
            start = starts[old.lineno - 1] + old.col_offset
            yield old.lineno, of, start, starts[old.end_lineno - 1] + old.end_col_offset, said


def in_c(text):
    """As `in_python`; statements are not counted: 0."""
    start = 0
    for i, line in enumerate(text.splitlines(keepends=True), 1):
        code = line.partition(b"/*")[0].rstrip()
        for rule, new in IN_C if re.match(rb"\s+\w", code) else ():
            for at in re.finditer(rule, code.decode()):
                yield i, 0, start + at.start(), start + at.end(), at.expand(new)
        start += len(line)


class Copy:
    """A copy of the repository, in which a fault is put in and tests are run."""

    def __init__(self, name):
        self.at = HOME / name
        shutil.rmtree(self.at, ignore_errors=True)
        command = ["git", "checkout-index", "--all", f"--prefix={self.at}/"]
        subprocess.run(command, cwd=ROOT, check=True)
        for built in BUILT.values():
            shutil.copytree(ROOT / built, self.at / built)

    def python(self, *arguments, limit=None):
        """Run Python there, with 4 GiB of memory; exit status and what it wrote."""
        done = subprocess.run(
            [sys.executable, "-m", *arguments], cwd=self.at, timeout=limit, text=True,
            env=os.environ | {"PYTHONPATH": str(self.at), "PYTHONDONTWRITEBYTECODE": "1"},
            capture_output=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (1 << 32, 1 << 32)),
        )  # fmt: skip
        return done.returncode, done.stdout + done.stderr

    def pytest(self, *arguments, **limit):
        plain = "-q", "-p", "no:cacheprovider", "-p", "no:randomly"
        return self.python("pytest", *plain, *arguments, **limit)

    def library(self, package):
        """The bytes of the library without the hash of its sources and the linker's."""
        (made,) = (self.at / BUILT[package]).glob("lib*")
        return re.sub(rb"[0-9a-f]{16}|GNU\0.{20}", b"", made.read_bytes(), flags=re.DOTALL)

    def judge(self, name, fault, tests, limit):
        """What comes of a file with a fault, and the first test that sees it."""
        file, native, package = self.at / name, "native" in name, Path(name).parts[0]
        before, library = file.read_bytes(), native and self.library(package)
        try:
            file.write_bytes(fault)
            if native and self.python(f"{package}.native")[0]:
                return "cannot be built", ""
            if file.suffix != ".py" and self.library(package) == library:
                return "the same library", ""
            (self.at / "chosen").write_text("\n".join(tests))
            status, said = self.pytest("-x", "-n0", "-m", "", "@chosen", limit=limit)
            by = re.findall(r"^(?:FAILED|ERROR|E +) ?(.*?)(?: - |$)", said, re.M) or ["all"]
            return ("seen", f"by {by[-1]}") if status else ("survived", f"{len(tests)} tests")
        except subprocess.TimeoutExpired:
            return "too long", ""
        finally:
            file.write_bytes(before)
            if native:
                built = BUILT[package]
                shutil.copytree(ROOT / built, self.at / built, dirs_exist_ok=True)


def tests_of_lines(marks):
    """For each file the tests that run each of its lines; none for what only a command runs."""
    copied = Copy("map")
    paths = [path for path in sorted(copied.at.rglob("*.py")) if path.name != Path(__file__).name]
    made = hashlib.sha256(b"".join([marks.encode(), *(path.read_bytes() for path in paths)]))
    data = HOME / f"lines-{made.hexdigest()[:12]}.json"
    if not data.exists():
        (copied.at / "coverage.ini").write_text(COVERAGE)
        options = "--cov", "--cov-config=coverage.ini", "--cov-context=test"
        status, said = copied.pytest("-m", marks, *options, "--cov-report=json:lines.json")
        if status:
            raise SystemExit(f"tests fail without a fault:\n{said[-1000:]}")
        (copied.at / "lines.json").rename(data)
    return {
        file: {
            int(line): {one.rpartition("|")[0] for one in contexts if "::" in one}
            for line, contexts in found["contexts"].items()
        }
        for file, found in json.loads(data.read_text())["files"].items()
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("where", nargs="+", help="files and folders of the repository")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=300.0, help="s for the tests of one fault")
    parser.add_argument("--slow", action="store_true", help="the slow tests too")
    options = parser.parse_args()
    lines = tests_of_lines("" if options.slow else "not slow")
    every = set().union(*(tests for file in lines.values() for tests in file.values()))
    copies, found = [Copy(f"copy-{i}") for i in range(2)], collections.defaultdict(set)
    root, counts = copies[0].at, collections.Counter()
    for where in (root / one for one in options.where):
        for path in [where] if where.is_file() else sorted(where.rglob("*.*")):
            if path.suffix in (".py", ".c", ".h") and "built" not in path.parts:
                made = (in_python if path.suffix == ".py" else in_c)(path.read_bytes())
                for line, *fault in made:
                    found[str(path.relative_to(root)), line].add(tuple(fault))
    draw = random.Random(options.seed)
    drawn = [(*place, *draw.choice(sorted(found[place])))
             for place in draw.sample(sorted(found), min(options.count, len(found)))]  # fmt: skip

    def run(copied, drawn):
        for name, line, statement, start, end, new in drawn:
            text, runs = (copied.at / name).read_bytes(), name
            if not statement:
                runs = (
                    "dem_demo/compiled.py" if "dem_demo" in name else "jointlaw/kernels/engine.py"
                )
            of_file = lines.get(runs, {})
            ran = not statement or statement in of_file
            tests = ran and (of_file.get(statement) or set().union(*of_file.values()) or every)
            order = sorted(tests, key=lambda test: ("/unit/" not in test, test)) if tests else []
            fault = text[:start] + new.encode() + text[end:]
            fate = copied.judge(name, fault, order, options.limit) if tests else ("not run", "")
            counts[fate[0]] += 1
            was = text.splitlines()[line - 1].decode().strip()
            change = " ".join(f"{text[start:end].decode()} -> {new}".split())
            print(*fate, f"\n  {name}:{line}: {was}\n  {change}", flush=True)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(run, copies, (drawn[::2], drawn[1::2])))
    print(f"{len(found)} lines; {', '.join(f'{n} {fate}' for fate, n in counts.items())}")


if __name__ == "__main__":
    main()
