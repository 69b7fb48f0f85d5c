"""Mutation tests: random faults, inserted one at a time, and whether a test detects each.

    python tests/mutants.py jointlaw/laws jointlaw/native/law.h --count 40 --seed 1

A first run records which test runs which line; the record is reused for the same sources. Then each
fault is run against the tests of its line; of its file if the line runs at import; of all joints or
blocks if it is in C. Everything runs in copies of the index of git, staged changes included, under
the temporary folder. Not part of CI. Needs `pip install pytest-cov`.

    python tests/mutants.py --outputs --count 80 --seed 42

inserts faults into what a user reads (`tests/output_faults.py`), as many of each kind. Each is run
against the tests that are likely to detect it; then all that no test has detected are inserted at
once and all tests are run, and the tests that fail are run against each fault alone. So every fault
meets every test, unless two faults cancel each other.
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

from output_faults import all_faults

ROOT = Path(__file__).parents[1]
WORK_FOLDER = Path(tempfile.gettempdir()) / f"mutants-{hashlib.sha256(bytes(ROOT)).hexdigest()[:8]}"
BUILD_FOLDERS = {"jointlaw": "jointlaw/native/built", "dem_demo": "dem_demo/native/built"}
COVERAGE = """\
[run]
source = jointlaw, dem_demo
parallel = true
patch = subprocess
[json]
show_contexts = true
"""
C_REPLACEMENTS = (
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r" / ", " * "), (r" < ", " <= "),
    (r" > ", " >= "), (r" ([<>])= ", r" \1 "), (r" == ", " != "), (r" && ", " || "),
    (r" \|\| ", " && "), (r" \+= ", " -= "), (r" -= ", " += "), (r"(?<=[(,= ])-(?=\w)", ""),
    (r"\b0\.5\b", "0.6"), (r"\b1\.0\b", "1.1"), (r"\b0\.0\b", "0.1"), (r"\b1\b", "2"),
    (r"\bif \((.*)\)", r"if (!(\1))"), (r"\b(\w+)\((\w+), (\w+)", r"\1(\3, \2"),
    (r"^( +)[^{}]*;$", r"\1;"),
)  # fmt: skip
OPPOSITE_OPERATORS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.And: ast.Or,
    ast.Or: ast.And, ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip


LIKELY_TESTS = {  # of faults of outputs: by kind and first folder
    ("columns", "jointlaw"): "unit/test_laboratory.py",
    ("columns", "dem_demo"): (
        "verification/test_scene_by_hand.py verification/test_space_by_hand.py "
        "examples/test_space_scenes.py"
    ),
    ("keys", "jointlaw"): "unit/test_parameters.py unit/test_seams.py unit/test_keys_of_laws.py",
    ("keys", "dem_demo"): "verification/test_keys_felt.py",
    ("units", "jointlaw"): "unit/test_units.py unit/test_laboratory.py unit/test_pictures.py",
    ("units", "dem_demo"): "unit/test_units.py verification/test_scene_by_hand.py",
    ("pictures", "jointlaw"): "unit/test_pictures.py",
    ("pictures", "dem_demo"): "unit/test_pictures.py",
    ("state", "jointlaw"): "unit/test_joints.py",
    ("state", "dem_demo"): "verification/test_saved_state_whole.py",
}
TESTS_OF_PAGES = "examples/test_docs.py examples/test_numbers.py examples/test_make_all.py"


def with_fields(node, **fields):
    """A copy of a node with other fields."""
    return type(node)(**(vars(node) | fields))


def faults_of(node):
    """Faults of a node of Python: the node or its condition, and its replacement."""
    match node:
        case ast.BinOp(op=op) | ast.BoolOp(op=op) | ast.AugAssign(op=op) if (
            type(op) in OPPOSITE_OPERATORS
        ):
            yield node, with_fields(node, op=OPPOSITE_OPERATORS[type(op)]())
        case ast.Compare(ops=[op]):
            yield node, with_fields(node, ops=[OPPOSITE_OPERATORS[type(op)]()])
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
            yield node, with_fields(node, args=[second, first, *rest])
        case ast.Call(keywords=[*rest, _]):
            yield node, with_fields(node, keywords=rest)
        case ast.Raise() | ast.Assign() | ast.Expr():
            yield node, ast.Pass()


def faults_in_python(text):
    """Faults of a source file: line, line of the statement, first and last byte, new text.

    Types, docstrings and messages have no faults.
    """
    starts = [0, *itertools.accumulate(map(len, text.splitlines(keepends=True)))]
    queue = [(ast.parse(text), 0)]
    while queue:
        node, statement = queue.pop()
        docstring = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        if docstring or isinstance(node, ast.JoinedStr):
            continue
        statement = node.lineno if isinstance(node, ast.stmt) else statement
        for name, value in ast.iter_fields(node):
            if name not in ("annotation", "returns"):
                children = value if isinstance(value, list) else [value]
                queue += [(child, statement) for child in children if isinstance(child, ast.AST)]
        for old, new in faults_of(node):
            source = ast.unparse(new)
            replacement = source if isinstance(new, ast.stmt) else f"({source})"
            start = starts[old.lineno - 1] + old.col_offset
            end = starts[old.end_lineno - 1] + old.end_col_offset
            yield old.lineno, statement, start, end, replacement


def faults_in_c(text):
    """As `faults_in_python`; coverage does not count the statements: 0."""
    start = 0
    for i, line in enumerate(text.splitlines(keepends=True), 1):
        code = line.partition(b"/*")[0].rstrip()
        for rule, new in C_REPLACEMENTS if re.match(rb"\s+\w", code) else ():
            for match in re.finditer(rule, code.decode()):
                yield i, 0, start + match.start(), start + match.end(), match.expand(new)
        start += len(line)


class Copy:
    """A copy of the repository, in which a fault is inserted and tests are run."""

    def __init__(self, name):
        self.root = WORK_FOLDER / name
        shutil.rmtree(self.root, ignore_errors=True)
        command = ["git", "checkout-index", "--all", f"--prefix={self.root}/"]
        subprocess.run(command, cwd=ROOT, check=True)
        for folder in BUILD_FOLDERS.values():
            shutil.copytree(ROOT / folder, self.root / folder)

    def run_python(self, *arguments, limit=None):
        """Run a module of Python in the copy, with 4 GiB of memory; exit status and output."""
        process = subprocess.run(
            [sys.executable, "-m", *arguments], cwd=self.root, timeout=limit, text=True,
            env=os.environ | {"PYTHONPATH": str(self.root), "PYTHONDONTWRITEBYTECODE": "1"},
            capture_output=True,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (1 << 32, 1 << 32)),
        )  # fmt: skip
        return process.returncode, process.stdout + process.stderr

    def run_pytest(self, *arguments, **limit):
        """Run pytest in the copy; exit status and output."""
        options = "-q", "-p", "no:cacheprovider", "-p", "no:randomly"
        return self.run_python("pytest", *options, *arguments, **limit)

    def library(self, package):
        """The bytes of the library without the hashes of its sources and of the linker."""
        (file,) = (self.root / BUILD_FOLDERS[package]).glob("lib*")
        return re.sub(rb"[0-9a-f]{16}|GNU\0.{20}", b"", file.read_bytes(), flags=re.DOTALL)

    def try_fault(self, name, faulty_text, tests, limit):
        """The fate of a file with a fault, and the first test that detects it."""
        file = self.root / name
        is_native = "native" in name
        package = Path(name).parts[0]
        original_text = file.read_bytes()
        original_library = self.library(package) if is_native else None
        try:
            file.write_bytes(faulty_text)
            if is_native and self.run_python(f"{package}.native")[0]:
                return "cannot be built", ""
            if file.suffix != ".py" and self.library(package) == original_library:
                return "the same library", ""
            (self.root / "chosen").write_text("\n".join(tests))
            status, output = self.run_pytest("-x", "-n0", "-m", "", "@chosen", limit=limit)
            pattern = r"^(?:FAILED|ERROR|E +) ?(.*?)(?: - |$)"
            detected_by = re.findall(pattern, output, re.MULTILINE) or ["all"]
            if status:
                return "detected", f"by {detected_by[-1]}"
            return "survived", f"{len(tests)} tests"
        except subprocess.TimeoutExpired:
            return "too long", ""
        finally:
            file.write_bytes(original_text)
            if is_native:
                folder = BUILD_FOLDERS[package]
                shutil.copytree(ROOT / folder, self.root / folder, dirs_exist_ok=True)


def tests_of_lines(marks):
    """Tests of each line of each file; none for a line that only a command runs."""
    copy = Copy("map")
    paths = [path for path in sorted(copy.root.rglob("*.py")) if path.name != Path(__file__).name]
    digest = hashlib.sha256(b"".join([marks.encode(), *(path.read_bytes() for path in paths)]))
    data = WORK_FOLDER / f"lines-{digest.hexdigest()[:12]}.json"
    if not data.exists():
        (copy.root / "coverage.ini").write_text(COVERAGE)
        options = "--cov", "--cov-config=coverage.ini", "--cov-context=test"
        status, output = copy.run_pytest("-m", marks, *options, "--cov-report=json:lines.json")
        if status:
            raise SystemExit(f"tests fail without a fault:\n{output[-1000:]}")
        (copy.root / "lines.json").rename(data)
    return {
        file: {
            int(line): {context.rpartition("|")[0] for context in contexts if "::" in context}
            for line, contexts in report["contexts"].items()
        }
        for file, report in json.loads(data.read_text())["files"].items()
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("where", nargs="*", help="files and folders of the repository")
    parser.add_argument("--outputs", action="store_true", help="faults in what a user reads")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=300.0, help="s for the tests of one fault")
    parser.add_argument("--slow", action="store_true", help="the slow tests too")
    options = parser.parse_args()
    if options.outputs:
        try_faults_of_outputs(options)
        return
    lines = tests_of_lines("" if options.slow else "not slow")
    copies = [Copy(f"copy-{i}") for i in range(2)]
    faults = faults_by_line(copies[0].root, options.where)
    rng = random.Random(options.seed)
    selected = rng.sample(sorted(faults), min(options.count, len(faults)))
    drawn = [(*place, *rng.choice(sorted(faults[place]))) for place in selected]
    counts = collections.Counter()

    def try_all(copy, drawn):
        for name, line, statement, start, end, new in drawn:
            text = (copy.root / name).read_bytes()
            faulty_text = text[:start] + new.encode() + text[end:]
            tests = sorted(tests_of_statement(lines, name, statement), key=unit_tests_first)
            if tests:
                fate = copy.try_fault(name, faulty_text, tests, options.limit)
            else:
                fate = "not run", ""
            counts[fate[0]] += 1
            source = text.splitlines()[line - 1].decode().strip()
            change = " ".join(f"{text[start:end].decode()} -> {new}".split())
            print(*fate, f"\n  {name}:{line}: {source}\n  {change}", flush=True)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(try_all, copies, (drawn[::2], drawn[1::2])))
    print(f"{len(faults)} lines; {', '.join(f'{n} {fate}' for fate, n in counts.items())}")


def try_faults_of_outputs(options):
    """Insert faults of each kind of `tests/output_faults.py`, and print the fate of each."""
    by_kind = all_faults()
    shares = itertools.cycle(sorted(by_kind))
    counts = collections.Counter(next(shares) for _ in range(options.count))
    faults = []
    for kind in sorted(
        by_kind
    ):  # each kind by itself, so that a smaller count takes the first ones
        drawn = random.Random(f"{options.seed} {kind}").sample(by_kind[kind], len(by_kind[kind]))
        faults += drawn[: counts[kind]]
    copy = Copy("outputs")
    marks = "" if options.slow else "not slow"
    detected_by = {}
    for fault in faults:
        likely = LIKELY_TESTS.get((fault.kind, Path(fault.file).parts[0]), TESTS_OF_PAGES).split()
        paths = [f"tests/{name}" for name in likely if (copy.root / "tests" / name).exists()]
        failed = failing_tests(copy, [fault], ["-x", "-m", "not slow", *paths], options.limit)
        if failed:
            detected_by[fault] = failed[0]
        print(fault.kind, f"{fault.file}: {' '.join(fault.what.split())[:200]}\n   ",
              detected_by.get(fault, "not by the likely tests"), flush=True)  # fmt: skip
    while group := compatible([one for one in faults if one not in detected_by]):
        print(f"{len(group)} faults at once", flush=True)
        failed = failing_tests(copy, group, ["-m", marks], None)
        if failed:
            without_fault = failing_tests(copy, [], ["-m", marks, *failed], None)
            failed = [test for test in failed if test not in without_fault]
        for fault in group:
            alone = ["-x", "-m", marks, *failed]
            by = failed and failing_tests(copy, [fault], alone, options.limit)
            detected_by[fault] = by[0] if by else ""
            print(f"{fault.kind} {fault.file}: {' '.join(fault.what.split())[:200]}\n   ",
                  detected_by[fault] or "SURVIVED", flush=True)  # fmt: skip
    for kind in sorted(by_kind):
        own = [fault for fault in faults if fault.kind == kind]
        seen = sum(bool(detected_by[fault]) for fault in own)
        print(f"{kind:10} {seen} of {len(own)} detected; {len(by_kind[kind])} possible")
    print(f"all        {sum(map(bool, detected_by.values()))} of {len(faults)}")


def compatible(faults):
    """Faults that can be inserted together: no two change the same text, but lines may be added
    at the same place."""
    chosen = []
    for fault in faults:
        span = (fault.start, fault.end)
        if all(
            fault.file != other.file
            or fault.start > other.end
            or other.start > fault.end
            or span == (other.start, other.end) == (fault.start, fault.start)
            for other in chosen
        ):
            chosen.append(fault)
    return chosen


def failing_tests(copy, faults, arguments, limit):
    """Tests that fail with these faults, in the order of their report."""
    originals = {fault.file: (copy.root / fault.file).read_bytes() for fault in faults}
    try:
        for fault in sorted(faults, key=lambda one: one.start, reverse=True):
            path = copy.root / fault.file
            text = path.read_bytes()
            path.write_bytes(text[: fault.start] + fault.new.encode() + text[fault.end :])
        status, output = copy.run_pytest("-n0", *arguments, limit=limit)
    except subprocess.TimeoutExpired:
        return ["too long"]
    finally:
        for name, text in originals.items():
            (copy.root / name).write_bytes(text)
    failed = re.findall(r"^(?:FAILED|ERROR) (tests/.*?)(?: - |$)", output, re.MULTILINE)
    return failed or (["pytest"] if status else [])


def faults_by_line(root, places):
    """Faults of the files and folders, by file and line."""
    faults = collections.defaultdict(set)
    for place in (root / name for name in places):
        for path in [place] if place.is_file() else sorted(place.rglob("*.*")):
            if path.suffix in (".py", ".c", ".h") and "built" not in path.parts:
                find_faults = faults_in_python if path.suffix == ".py" else faults_in_c
                for line, *fault in find_faults(path.read_bytes()):
                    faults[str(path.relative_to(root)), line].add(tuple(fault))
    return faults


def tests_of_statement(lines, name, statement):
    """Tests that run a statement; in C (0) tests of the Python module that loads the library."""
    if statement:
        by_line = lines.get(name, {})
        if statement not in by_line:
            return set()
    else:
        module = "dem_demo/compiled.py" if "dem_demo" in name else "jointlaw/kernels/engine.py"
        by_line = lines.get(module, {})
    every = set().union(*(tests for file in lines.values() for tests in file.values()))
    return by_line.get(statement) or set().union(*by_line.values()) or every


def unit_tests_first(test):
    """Sort key of a test."""
    return "/unit/" not in test, test


if __name__ == "__main__":
    main()
