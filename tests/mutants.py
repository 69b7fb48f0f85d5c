"""Mutation tests: random faults, inserted one at a time, and whether a test detects each.

    python tests/mutants.py jointlaw/laws jointlaw/native/law.h --count 40 --seed 1

A first run records which test executes which statements (`tests/executed.py`); the record of a test
file is reused until anything that it executes or reads changes. Then each fault is run against the
tests that execute it; a fault in C against all tests that run compiled joints or blocks. Everything
runs in copies of the index of git, staged changes included, under the temporary folder. Build both
compiled libraries first. Not part of CI.

    python tests/mutants.py --outputs --count 80 --seed 42

inserts faults into what a user reads (`tests/output_faults.py`), as many of each kind. Each is run
against tests that execute it, likely and fast ones first, up to `LIKELY_TIME`. Then the faults left
are inserted at once, all test files that can detect one of them are run, and the failing tests are
run against each fault alone. So every fault meets every test that can detect it, unless two faults
cancel each other. With `--slow` the faults left then meet the slow tests of all files likewise
(slow tests are not recorded). `--since COMMIT` draws only from lines that differ from a commit.
"""

import argparse
import ast
import collections
import hashlib
import itertools
import math
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

from executed import ExecutedMap
from output_faults import all_faults
from recorder import MODULE

ROOT = Path(__file__).parents[1]
WORK_FOLDER = Path(tempfile.gettempdir()) / f"mutants-{hashlib.sha256(bytes(ROOT)).hexdigest()[:8]}"
BUILD_FOLDERS = {"jointlaw": "jointlaw/native/built", "dem_demo": "dem_demo/native/built"}
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
    ("columns", "jointlaw"): (
        "unit/test_printed_numbers.py verification/test_commands_by_hand.py unit/test_laboratory.py"
    ),
    ("columns", "dem_demo"): (
        "verification/test_scene_by_hand.py verification/test_space_by_hand.py "
        "verification/test_space_run_by_hand.py unit/test_printed_numbers.py"
    ),
    ("keys", "jointlaw"): "unit/test_options_felt.py unit/test_parameters.py unit/test_seams.py",
    ("keys", "dem_demo"): (
        "verification/test_keys_felt.py verification/test_space_keys_felt.py "
        "unit/test_options_felt.py"
    ),
    ("units", "jointlaw"): (
        "unit/test_units.py unit/test_printed_numbers.py unit/test_laboratory.py "
        "unit/test_pictures.py"
    ),
    ("units", "dem_demo"): (
        "unit/test_units.py unit/test_printed_numbers.py verification/test_scene_by_hand.py"
    ),
    ("pictures", "jointlaw"): "unit/test_pictures.py",
    ("pictures", "dem_demo"): "unit/test_pictures.py unit/test_space_pictures.py",
    ("state", "jointlaw"): "unit/test_joints.py",
    ("state", "dem_demo"): "verification/test_saved_state_whole.py",
}
TESTS_OF_PAGES = "examples/test_numbers.py examples/test_docs.py examples/test_make_all.py"
LIKELY_TIME = 10.0  # s of processor time, of the tests that a fault of outputs meets first


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


def recorded_tests(marks, processes, is_renewed=True):
    """The map of the tests with these marks; test files whose record is stale run first.

    Without `is_renewed` the records stay as they are; a test file without one is able to detect
    each fault.
    """
    folder = WORK_FOLDER / f"executed-{marks.replace(' ', '-') or 'all'}"
    copies = [Copy(f"record-{i}") for i in range(processes)]
    tests = ExecutedMap(copies[0].root, folder)
    queue = [file for file in tests.test_files() if is_renewed and tests.is_stale(file)]
    failed = []

    def record(copy):
        while queue:
            file = queue.pop()
            output = tests.record(file, copy, marks)
            if output:
                failed.append(f"{file}:\n{output[-1000:]}")
            print("recorded", file, f"{tests.records.get(file, {}).get('s', 0)} s", flush=True)

    with ThreadPoolExecutor(processes) as pool:
        list(pool.map(record, copies))
    if failed:
        raise SystemExit("tests fail without a fault:\n" + "\n".join(failed))
    return tests


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("where", nargs="*", help="files and folders of the repository")
    parser.add_argument("--outputs", action="store_true", help="faults in what a user reads")
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=300.0, help="s for the tests of one fault")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--reuse-records", action="store_true", help="stale ones too, none is made")
    parser.add_argument("--slow", action="store_true", help="the slow tests too")
    parser.add_argument("--since", help="faults of outputs in lines that differ from this commit")
    options = parser.parse_args()
    if options.outputs:
        try_faults_of_outputs(options)
        return
    recorded = recorded_tests(
        "" if options.slow else "not slow", options.processes, not options.reuse_records
    )
    copies = [Copy(f"copy-{i}") for i in range(options.processes)]
    faults = faults_by_line(copies[0].root, options.where)
    rng = random.Random(options.seed)
    selected = rng.sample(sorted(faults), min(options.count, len(faults)))
    drawn = [(*place, *rng.choice(sorted(faults[place]))) for place in selected]
    counts = collections.Counter()

    def try_all(copy, drawn):
        for name, line, statement, start, end, new in drawn:
            text = (copy.root / name).read_bytes()
            faulty_text = text[:start] + new.encode() + text[end:]
            tests = sorted(tests_of_statement(recorded, name, statement), key=unit_tests_first)
            if tests:
                fate = copy.try_fault(name, faulty_text, tests, options.limit)
            else:
                fate = "not run", ""
            counts[fate[0]] += 1
            source = text.splitlines()[line - 1].decode().strip()
            change = " ".join(f"{text[start:end].decode()} -> {new}".split())
            print(*fate, f"\n  {name}:{line}: {source}\n  {change}", flush=True)

    with ThreadPoolExecutor(options.processes) as pool:
        list(pool.map(try_all, copies, (drawn[i :: len(copies)] for i in range(len(copies)))))
    print(f"{len(faults)} lines; {', '.join(f'{n} {fate}' for fate, n in counts.items())}")


def try_faults_of_outputs(options):
    """Insert faults of each kind of `tests/output_faults.py`, and print the fate of each."""
    by_kind = all_faults()
    if options.since:
        lines = changed_lines(options.since)
        by_kind = {
            kind: [fault for fault in faults if changes_line(fault, lines)]
            for kind, faults in by_kind.items()
        }
    faults = draw(by_kind, options.count, options.seed)
    tests = recorded_tests("not slow", options.processes, not options.reuse_records)
    copies = [Copy(f"outputs-{i}") for i in range(options.processes)]
    detected_by = {}

    def try_likely(copy, faults):
        for fault in faults:
            able = tests.able(fault.file, line_of(copy, fault))
            chosen = likely_first(fault, able)
            failed = chosen and failing_tests(
                copy, [fault], ["-x", "-m", "not slow"], chosen, options.limit
            )
            if failed:
                detected_by[fault] = failed[0]
            print(fault.kind, f"{fault.file}: {' '.join(fault.what.split())[:200]}\n   ",
                  detected_by.get(fault, f"not by the likely of {len(able)} test files"),
                  flush=True)  # fmt: skip

    with ThreadPoolExecutor(options.processes) as pool:
        list(pool.map(try_likely, copies, (faults[i :: len(copies)] for i in range(len(copies)))))
    report(by_kind, faults, detected_by)
    by_file = {fault: tests.able(fault.file, line_of(copies[0], fault)) for fault in faults}
    try_together(copies, faults, detected_by, "not slow", by_file, options.limit)
    report(by_kind, faults, detected_by)
    if options.slow:
        undetected = [fault for fault in faults if not detected_by[fault]]
        every = dict.fromkeys(undetected, tests.test_files())
        for fault in undetected:
            del detected_by[fault]
        try_together(copies, undetected, detected_by, "slow", every, options.limit)
        report(by_kind, faults, detected_by)


def changed_lines(commit):
    """Numbers of the lines, by file, that differ from a commit."""
    command = ["git", "diff", "-U0", commit]
    diff = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    lines = collections.defaultdict(set)
    file = ""
    for name, first, count in re.findall(
        r"^(?:\+\+\+ b/(.*)|@@ -\S+ \+(\d+)(?:,(\d+))? @@.*)$", diff, re.MULTILINE
    ):
        file = name or file
        if first:
            lines[file] |= set(range(int(first), int(first) + int(count or 1)))
    return lines


def changes_line(fault, lines):
    """Whether a fault begins in one of the lines; lines that it inserts may be anywhere in a file
    with some."""
    if fault.start == fault.end:
        return bool(lines[fault.file])
    text = (ROOT / fault.file).read_bytes()
    return text[: fault.start].count(b"\n") + 1 in lines[fault.file]


def draw(by_kind, count, seed):
    """Faults drawn at random, as many of each kind, the kinds in turn."""
    shares = itertools.cycle(sorted(by_kind))
    counts = collections.Counter(next(shares) for _ in range(count))
    chosen = []
    for kind in sorted(by_kind):
        drawn = random.Random(f"{seed} {kind}").sample(by_kind[kind], len(by_kind[kind]))
        chosen.append(drawn[: counts[kind]])  # a smaller count takes the first ones
    in_turn = itertools.chain(*itertools.zip_longest(*chosen))
    return [fault for fault in in_turn if fault is not None]


def try_together(copies, faults, detected_by, marks, able, limit):
    """Insert all faults that no test has detected at once, then each alone for tests that failed.

    `able[fault]` contains the test files that can detect a fault.
    """
    while group := compatible([one for one in faults if one not in detected_by]):
        files = sorted({file for fault in group for file in able[fault]})
        print(f"{len(group)} faults at once, {len(files)} test files", flush=True)
        failed = failing_tests_in_parallel(copies, group, marks, files)
        copy = copies[0]
        if failed:
            without_fault = failing_tests(copy, [], ["-m", marks], failed)
            failed = [test for test in failed if test not in without_fault]
        for fault in group:
            able_tests = [test for test in failed if test.partition("::")[0] in able[fault]]
            by = able_tests and failing_tests(copy, [fault], ["-x", "-m", marks], able_tests, limit)
            detected_by[fault] = by[0] if by else ""
            print(f"{fault.kind} {fault.file}: {' '.join(fault.what.split())[:200]}\n   ",
                  detected_by[fault] or f"SURVIVED {marks}", flush=True)  # fmt: skip


def failing_tests_in_parallel(copies, faults, marks, files):
    """Tests of these files that fail with these faults; each copy runs a share of the files."""
    shares = [files[i :: len(copies)] for i in range(len(copies))]

    def run(copy, share):
        return failing_tests(copy, faults, ["-m", marks], share) if share else []

    with ThreadPoolExecutor(len(copies)) as pool:
        return [*itertools.chain(*pool.map(run, copies, shares))]


def report(by_kind, faults, detected_by):
    """Print how many faults of each kind are detected so far."""
    for kind in sorted(by_kind):
        faults_of_kind = [fault for fault in faults if fault.kind == kind]
        seen = sum(bool(detected_by.get(fault)) for fault in faults_of_kind)
        print(f"{kind:10} {seen} of {len(faults_of_kind)} detected; {len(by_kind[kind])} possible")
    print(f"all        {sum(map(bool, detected_by.values()))} of {len(faults)}", flush=True)


def line_of(copy, fault):
    """The line in which a fault begins."""
    return (copy.root / fault.file).read_bytes()[: fault.start].count(b"\n") + 1


def likely_first(fault, able):
    """Tests that execute a fault, of `LIKELY_TIME` in all.

    First the tests that have the name of a key or an option, then likely files, then fast ones.
    """
    kind = fault.kind, Path(fault.file).parts[0]
    likely = [f"tests/{name}" for name in LIKELY_TESTS.get(kind, TESTS_OF_PAGES).split()]

    def rank(file):
        seconds = sum(duration for _, duration in able[file])
        return likely.index(file) if file in likely else len(likely), seconds

    chosen = []
    time_left = LIKELY_TIME
    for file in sorted(able, key=rank):
        for name, seconds in able[file]:
            is_unknown = math.isinf(seconds)
            time_left -= 0.0 if is_unknown else seconds
            if file in likely if is_unknown else time_left > 0.0 or not chosen:
                chosen.append(name)
    # a list is tested by iterating over it: the test of a key or an option has its name
    names = [word for word in fault.what.split() if word not in ("key", "is", "ignored")]
    return sorted(chosen, key=lambda test: not all(name in test for name in names))


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


def failing_tests(copy, faults, arguments, tests, limit=None):
    """Tests, of these, that fail with these faults, in the order of their report."""
    (copy.root / "chosen").write_text("\n".join(tests))
    originals = {fault.file: (copy.root / fault.file).read_bytes() for fault in faults}
    packages = {Path(file).parts[0] for file in originals if "native" in file}
    native = packages & BUILD_FOLDERS.keys()
    try:
        for fault in sorted(faults, key=lambda one: one.start, reverse=True):
            path = copy.root / fault.file
            text = path.read_bytes()
            path.write_bytes(text[: fault.start] + fault.new.encode() + text[fault.end :])
        for package in native:
            if copy.run_python(f"{package}.native")[0]:
                return ["cannot be built"]
        status, output = copy.run_pytest("-n0", *arguments, "@chosen", limit=limit)
    except subprocess.TimeoutExpired:
        return ["too long"]
    finally:
        for name, text in originals.items():
            (copy.root / name).write_bytes(text)
        for package in native:
            folder = BUILD_FOLDERS[package]
            shutil.copytree(ROOT / folder, copy.root / folder, dirs_exist_ok=True)
    # a stale record may name tests that are no more: pytest then runs none of the others
    missing = re.findall(r"^ERROR: not found: .*?/(tests/.*)$", output, re.MULTILINE)
    present = [test for test in tests if not {test, test.partition("[")[0]} & {*missing}]
    if len(present) < len(tests):
        return failing_tests(copy, faults, arguments, present, limit) if present else []
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


def tests_of_statement(recorded, name, statement):
    """Tests that run a statement; in C (0) tests that run compiled joints or blocks."""
    if statement:
        able = recorded.able(name, statement)
        return {test for tests in able.values() for test, _ in tests}
    module = "dem_demo/compiled.py" if "dem_demo" in name else "jointlaw/kernels/engine.py"
    return {
        test
        for record in recorded.records.values()
        if any(file == module and function != MODULE for file, function, _ in record["blocks"])
        for test in record["tests"]
    }


def unit_tests_first(test):
    """Sort key of a test."""
    return "/unit/" not in test, test


if __name__ == "__main__":
    main()
