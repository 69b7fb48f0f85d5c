"""Faults drawn at random, put in one at a time: which does no test see?

    python tests/mutants.py jointlaw/laws jointlaw/native/law.h --count 40 --seed 1

A first run tells which test runs which line; it is kept for the same sources. Then each fault is
run against the tests of its line; of its file, where the line runs at import; of all joints or
blocks, where it is in C. All this in copies under the temporary folder. No part of CI. Needs
`pip install pytest-cov`.
"""

import argparse
import ast
import collections
import difflib
import hashlib
import os
import random
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from queue import Queue

ROOT = Path(__file__).parents[1]
HOME = Path(tempfile.gettempdir()) / f"mutants-{hashlib.sha256(bytes(ROOT)).hexdigest()[:8]}"
BUILT = "jointlaw/native/built"
COVERAGE = "[run]\nsource = jointlaw, dem_demo\ncontext = ${PYTEST_CURRENT_TEST-}\n"
COVERAGE += "parallel = true\npatch = subprocess\ndata_file = "
PAIRS = "Add Sub, Mult Div, Lt LtE, Gt GtE, Eq NotEq, Is IsNot, In NotIn, And Or, BitAnd BitOr"
OTHER = dict([getattr(ast, one) for one in pair.split()] for pair in PAIRS.split(","))
OTHER |= {b: a for a, b in OTHER.items()} | {ast.Pow: ast.Mult, ast.FloorDiv: ast.Mult}
IN_C = (
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r" / ", " * "), (r" < ", " <= "),
    (r" > ", " >= "), (r" ([<>])= ", r" \1 "), (r" == ", " != "), (r" && ", " || "),
    (r" \|\| ", " && "), (r" \+= ", " -= "), (r" -= ", " += "), (r"(?<=[(,= ])-(?=\w)", ""),
    (r"\b0\.5\b", "0.6"), (r"\b1\.0\b", "1.1"), (r"\b0\.0\b", "0.1"), (r"\b1\b", "2"),
    (r"\bif \((.*)\)", r"if (!(\1))"), (r"\b(\w+)\((\w+), (\w+)", r"\1(\3, \2"),
    (r"^( +)[^{}]*;$", r"\1;"),
)  # fmt: skip


def own(node):
    """A node and its expressions, without annotations, texts with parts and inner statements."""
    yield node
    for name, value in ast.iter_fields(node):
        for child in value if isinstance(value, list) else [value]:
            skipped = name in ("annotation", "returns") or isinstance(
                child, ast.stmt | ast.JoinedStr
            )
            if isinstance(child, ast.AST) and not skipped:
                yield from own(child)


def faults(node):
    """Nodes at and below this one, and what may stand in place of each."""

    def changed(**fields):
        whole = type(node)(**(dict(ast.iter_fields(node)) | fields))
        text = ast.unparse(ast.fix_missing_locations(whole))
        return node, text if isinstance(node, ast.stmt) else f"({text})"

    match node:
        case ast.If(test=test) | ast.IfExp(test=test) | ast.While(test=test):
            yield from ((test, f"(not ({ast.unparse(test)}))"), (test, "False"))
        case ast.BinOp(op=op) | ast.BoolOp(op=op) | ast.AugAssign(op=op) if type(op) in OTHER:
            yield changed(op=OTHER[type(op)]())
        case ast.Compare(ops=[op]) if type(op) in OTHER:
            yield changed(ops=[OTHER[type(op)]()])
        case ast.UnaryOp(operand=operand):
            yield node, f"({ast.unparse(operand)})"
        case ast.Constant(value=bool(value)):
            yield node, str(not value)
        case ast.Constant(value=int(value)):
            yield node, str(value + 1)
        case ast.Constant(value=float(value)):
            yield node, repr(1.1 * value or 1.0)
        case ast.Constant(value=str(value)) if re.fullmatch(r"[\w./-]+", value):
            yield node, repr(value + "x")
        case ast.Call(args=[first, second, *more]):
            yield changed(args=[second, first, *more])
        case ast.Call(keywords=[*before, _]):
            yield changed(keywords=before)
    if isinstance(node, ast.Expr | ast.Assign | ast.AugAssign | ast.Raise):
        yield node, "pass"


def in_python(text):
    """For each statement that can have a fault its line, and (begin, end, new bytes) of each."""
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for statement in ast.walk(ast.parse(text)):
        words = isinstance(getattr(statement, "value", None), ast.Constant)
        if not isinstance(statement, ast.stmt) or (isinstance(statement, ast.Expr) and words):
            continue
        yield (
            statement.lineno,
            [
                (
                    starts[at.lineno - 1] + at.col_offset,
                    starts[at.end_lineno - 1] + at.end_col_offset,
                    new,
                )
                for node in own(statement)
                for at, new in faults(node)
            ],
        )


def in_c(text):
    """The same for each line of a file in C that is inside a function, but for its comment."""
    at = 0
    for line in text.decode().splitlines(keepends=True):
        code = line.partition("/*")[0].encode()
        rules = IN_C if re.match(rb"\s+\w", code) else ()
        said = code.decode()
        found = [rule for rule in rules if re.search(rule[0], said)]
        yield 0, [(at, at + len(code), re.sub(*rule, said, count=1)) for rule in found]
        at += len(line.encode())


class Copy:
    """A copy of the repository, in which a fault is put in and tests are run."""

    def __init__(self, name):
        self.at = HOME / name
        shutil.rmtree(self.at, ignore_errors=True)
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
        for path in map(Path, listed.stdout.splitlines()):
            (self.at / path.parent).mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / path, self.at / path)
        shutil.copytree(ROOT / BUILT, self.at / BUILT)

    def python(self, *arguments, limit=None):
        """Run Python there, with 4 GiB of memory; exit status and what it wrote."""
        variables = os.environ | {"PYTHONPATH": str(self.at), "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, "-m", *arguments]
        done = subprocess.run(
            command, cwd=self.at, env=variables, timeout=limit, text=True, capture_output=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (1 << 32, 1 << 32)),
        )  # fmt: skip
        return done.returncode, done.stdout + done.stderr

    def pytest(self, *arguments, **limit):
        return self.python("pytest", "-q", "-p", "no:cacheprovider", *arguments, **limit)

    def library(self):
        """The bytes of the library without the hash of its sources."""
        (made,) = (self.at / BUILT).glob("libjointlaw.*")
        return re.sub(rb"[0-9a-f]{16}", b"", made.read_bytes())

    def judge(self, name, fault, tests, limit):
        """What comes of a fault, and the first test that sees it."""
        file, native = self.at / name, "native" in name
        before, library = file.read_bytes(), self.library()
        file.write_bytes(fault)
        try:
            if native and self.python("jointlaw.native")[0]:
                return "cannot be built", ""
            if file.suffix != ".py" and self.library() == library:
                return "the same library", ""
            (self.at / "chosen").write_text("\n".join(tests))
            status, said = self.pytest("-x", "-n0", "-m", "", "@chosen", limit=limit)
            by = re.findall(r"^(?:FAILED|ERROR) (.*?)(?: - |$)", said, re.M) or [said[-300:]]
            return ("seen", f"by {by[0]}") if status else ("survived", f"{len(tests)} tests")
        except subprocess.TimeoutExpired:
            return "too long", ""
        finally:
            file.write_bytes(before)
            if native:
                shutil.copytree(ROOT / BUILT, self.at / BUILT, dirs_exist_ok=True)


def tests_of_lines(marks):
    """For each file the tests that run each of its lines, those of a command included."""
    copied = Copy("map")
    paths = [path for path in sorted(copied.at.rglob("*.py")) if path.name != Path(__file__).name]
    made = hashlib.sha256(b"".join([marks.encode(), *(path.read_bytes() for path in paths)]))
    data = HOME / f"lines-{made.hexdigest()[:12]}"
    if not data.exists():
        (copied.at / "coverage.ini").write_text(f"{COVERAGE}{data}.part\n")
        options = "--cov", "--cov-config=coverage.ini", "--cov-context=test", "--cov-report="
        print(copied.pytest("-m", marks, *options)[1][-1000:])
        copied.python("coverage", "combine", "--rcfile=coverage.ini")
        data.with_suffix(".part").rename(data)
    from coverage import CoverageData

    found = CoverageData(str(data))
    found.read()
    end = re.compile(r"(\|(setup|run|teardown)| \((setup|call|teardown)\).*)$")
    return {
        str(Path(file).relative_to(copied.at)): {
            line: {end.sub("", one) for one in contexts if "::" in one}
            for line, contexts in found.contexts_by_lineno(file).items()
        }
        for file in found.measured_files()
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
    places = []
    for where in (ROOT / one for one in options.where):
        for path in [where] if where.is_file() else sorted(where.rglob("*.*")):
            read = {".py": in_python, ".c": in_c, ".h": in_c}.get(path.suffix)
            if read and BUILT not in str(path):
                name, text = str(path.relative_to(ROOT)), path.read_bytes()
                places += [(name, line, made) for line, made in read(text) if made]
    draw = random.Random(options.seed)
    drawn = draw.sample(places, min(options.count, len(places)))
    drawn = [(name, line, draw.choice(made)) for name, line, made in drawn]
    copies, counts = Queue(), collections.Counter()
    for i in range(2):
        copies.put(Copy(f"copy-{i}"))

    def run(place):
        name, line, (begin, end, new) = place
        text, runs = (ROOT / name).read_bytes(), name
        fault = text[:begin] + new.encode() + text[end:]
        if not name.endswith(".py"):
            runs = "dem_demo/compiled.py" if "blocks" in name else "jointlaw/kernels/engine.py"
        of_file = lines.get(runs, {})
        of_line = of_file.get(line, set()) if name.endswith(".py") else set()
        ran = line in of_file or not line
        tests = ran and (of_line or set().union(*of_file.values()) or every)
        order = sorted(tests, key=lambda test: ("/unit/" not in test, test)) if tests else []
        copied = copies.get()
        try:
            fate = copied.judge(name, fault, order, options.limit) if tests else ("not run", "")
        finally:
            copies.put(copied)
        texts = (one.decode().splitlines() for one in (text, fault))
        return name, *fate, [*difflib.unified_diff(*texts, lineterm="", n=0)][2:]

    with ThreadPoolExecutor(2) as pool:
        for done in as_completed([pool.submit(run, place) for place in drawn]):
            name, fate, by, diff = done.result()
            counts[fate] += 1
            print(f"{fate} {by}", name, *diff, sep="\n  ", flush=True)
    print(f"{len(places)} places; {', '.join(f'{n} {fate}' for fate, n in counts.items())}")


if __name__ == "__main__":
    main()
