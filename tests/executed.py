"""Which tests can detect a fault: a map of the blocks that each test executes, and the files read.

Each test file runs alone, in a copy of the repository in which `tests/recorder.py` records, so that
no result cached by another file hides what it executes. The record of a test file is reused until a
function that it has executed, a module that it has imported or a file that it has read changes.
(A change of the C sources alone does not make it stale.)

A fault in a function can be detected by the test files that execute its block; a fault in a value
of a module by those that execute a block or read a test that names the value, directly or in
another value of a module; a fault elsewhere in a module by those that import it; a fault in any
file by those that read the file.
"""

import ast
import hashlib
import json
import math
import shutil
from functools import cache
from pathlib import Path

from recorder import MODULE, PACKAGES, blocks_of, digests_of

RECORDER = Path(__file__).with_name("recorder.py")


def text_digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()[:12]


def names_in(nodes):
    """Names, attributes and texts in nodes, which may name a value of a module."""
    found = set()
    for node in (inner for one in nodes for inner in ast.walk(one)):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.alias(name=name):
                found.add(name)
            case ast.Constant(value=str(name)) if name.isidentifier():
                found.add(name)
    return found


class Sources:
    """The sources of the packages of a copy of the repository."""

    def __init__(self, root):
        self.root = root
        self.files = [
            str(path.relative_to(root))
            for package in PACKAGES
            for path in sorted((root / package).rglob("*.py"))
        ]
        self.trees = {file: ast.parse((root / file).read_bytes()) for file in self.files}
        self.digests = {file: digests_of((root / file).read_bytes()) for file in self.files}
        self.names_of_blocks = {
            (file, name, number): names_in(statements)
            for file, tree in self.trees.items()
            for name, number, statements in blocks_of(tree)
            if name != MODULE
        }

    def block_at(self, file, line):
        """The innermost block that contains a line."""
        innermost = (file, MODULE, 0)
        smallest = float("inf")
        for name, number, statements in blocks_of(self.trees[file]):
            first = statements[0].lineno if statements else 0
            last = statements[-1].end_lineno if statements else 0
            if name != MODULE and first <= line <= last and last - first < smallest:
                innermost = (file, name, number)
                smallest = last - first
        return innermost

    def names_of_value(self, file, line):
        """Names of the value of a module at a line and of the values made from it.

        None where a statement of a module that is no assignment uses them.
        """
        names = assigned_names(self.statement_at(file, line))
        while names is not None:
            more = set()
            for statement in self.statements_of_modules:
                used = names_in(parts_run_at_import(statement)) & names
                if used and not isinstance(statement, ast.Import | ast.ImportFrom):
                    assigned = assigned_names(statement)
                    if assigned is None:
                        return None
                    more |= assigned
            if more <= names:
                return names
            names |= more
        return None

    def statement_at(self, file, line):
        """The statement of a module at a line."""
        for statement in self.trees[file].body:
            if statement.lineno <= line <= statement.end_lineno:
                return statement
        return None

    @property
    def statements_of_modules(self):
        return [statement for tree in self.trees.values() for statement in tree.body]


def assigned_names(statement):
    """Names that an assignment of a module assigns, None for other statements."""
    if not isinstance(statement, ast.Assign | ast.AnnAssign):
        return None
    targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
    nodes = [node for target in targets for node in ast.walk(target)]
    names = {node.id for node in nodes if isinstance(node, ast.Name)}
    is_plain = all(isinstance(node, ast.Name | ast.Tuple | ast.expr_context) for node in nodes)
    return names if is_plain else None


def parts_run_at_import(statement):
    """Nodes of a statement of a module but the bodies of functions."""
    match statement:
        case ast.FunctionDef() | ast.AsyncFunctionDef():
            return [*statement.decorator_list, statement.args]
        case ast.ClassDef():
            inner = [part for one in statement.body for part in parts_run_at_import(one)]
            return [*statement.decorator_list, *statement.bases, *statement.keywords, *inner]
    return [statement]


class ExecutedMap:
    """Records of test files, one JSON file each in a folder.

    A record has executed `blocks`, `read` files, `tests` by name (indices of blocks and processor
    time), their sum `s`, and `digests` of everything executed and read.
    """

    def __init__(self, root, folder):
        self.root = root
        self.folder = folder
        self.sources = Sources(root)
        folder.mkdir(parents=True, exist_ok=True)
        self.records = {}
        for test_file in self.test_files():
            path = self.path_of(test_file)
            if path.exists():
                self.records[test_file] = json.loads(path.read_text())

    def test_files(self):
        """All test files."""
        return sorted(
            str(path.relative_to(self.root)) for path in self.root.glob("tests/*/test_*.py")
        )

    def path_of(self, test_file):
        return self.folder / f"{Path(test_file).stem}.json"

    def is_stale(self, test_file):
        """Whether a test file is not recorded, or anything that it has executed or read differs."""
        record = self.records.get(test_file)
        return record is None or self.digests_of_record(record) != record["digests"]

    def digests_of_record(self, record):
        """Digests of the functions, modules and files of a record in the present sources."""
        functions = sorted({(file, name) for file, name, _ in record["blocks"]})
        digests = [self.sources.digests.get(file, {}).get(name) for file, name in functions]
        paths = [self.root / file for file in record["read"]]
        return digests + [text_digest(path) if path.is_file() else None for path in paths]

    def record(self, test_file, copy, marks):
        """Run a test file in a copy of the repository and keep its record; output if it fails."""
        folder = copy.root / "executed"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        shutil.copy(RECORDER, copy.root / "sitecustomize.py")
        status, output = copy.run_pytest("-n0", "-m", marks, "-p", "sitecustomize", test_file)
        (copy.root / "sitecustomize.py").unlink()
        if status not in (0, 5):  # 5: no test is selected
            return output
        blocks = set()
        read = {test_file}
        tests = {}
        for path in folder.glob("*.json"):
            part = json.loads(path.read_text())
            blocks |= {tuple(block) for block in part["blocks"]}
            read |= {file for file in part["read"] if (self.root / file).is_file()}
            tests |= part["tests"]
        place = {block: i for i, block in enumerate(sorted(blocks))}
        record = {
            "blocks": sorted(blocks),
            "read": sorted(read),
            "tests": {
                name: [[place[tuple(block)] for block in test["blocks"]], round(test["s"], 3)]
                for name, test in tests.items()
            },
            "s": round(sum(test["s"] for test in tests.values()), 3),
        }
        record["digests"] = self.digests_of_record(record)
        path = self.path_of(test_file)
        path.with_suffix(".part").write_text(json.dumps(record))
        path.with_suffix(".part").rename(path)
        self.records[test_file] = json.loads(path.read_text())
        return ""

    def able(self, file, line):
        """Test files that can detect a fault in a line of a file: tests that execute it, by time.

        A list of pairs of name and processor time (s) for each test file; all its tests if the
        file only reads the text, or if the fault acts when the module is imported; the file itself
        if it is not recorded.
        """
        block = self.sources.block_at(file, line) if file in self.sources.trees else None
        names = None
        if block and block[1] == MODULE:
            names = self.sources.names_of_value(file, line)
        able_tests = {}
        for test_file, record in self.records.items():
            if names is None:
                acting = {i for i, one in enumerate(record["blocks"]) if tuple(one) == block}
            else:
                acting = {
                    i
                    for i, one in enumerate(record["blocks"])
                    if not names.isdisjoint(self.sources.names_of_blocks.get(tuple(one), ()))
                }
            reads = file in record["read"] or (names and self.reads_names(record, names))
            every = [(name, seconds) for name, (_, seconds) in record["tests"].items()]
            if reads or (acting and names is None and block[1] == MODULE):
                able_tests[test_file] = every
            elif acting:
                tests = record["tests"].items()
                able_tests[test_file] = [
                    (name, seconds)
                    for name, (blocks, seconds) in tests
                    if not acting.isdisjoint(blocks)
                ]
        able_tests |= {
            file: [(file, math.inf)] for file in self.test_files() if file not in self.records
        }
        return {file: sorted(tests, key=lambda one: one[1]) for file, tests in able_tests.items()}

    def reads_names(self, record, names):
        """Whether a test file or a helper that it imports names one of these values."""
        helpers = [file for file in record["read"] if file.startswith("tests/")]
        return any(not names.isdisjoint(words_of(self.root / file)) for file in helpers)


@cache
def words_of(path):
    """Names in a file of Python, none of another file."""
    return names_in([ast.parse(path.read_bytes())]) if path.suffix == ".py" else set()
