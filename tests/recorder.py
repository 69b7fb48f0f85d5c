"""Records the blocks of the packages that a process executes, and the files that it reads.

`tests/executed.py` copies this file as `sitecustomize.py` to the root of a copy of the repository,
so that Python imports it first in each process that the tests start there. Each block of statements
of a function in `jointlaw` and `dem_demo` gets a statement that sets one byte, which is shared with
forked processes. At its end a process writes the executed blocks and the files read to
`executed/*.json` beside this file, pytest also the blocks and the processor time of each test.
Imports do not count as reading.
"""

import ast
import atexit
import hashlib
import json
import mmap
import os
import sys
import time
from importlib.machinery import SourceFileLoader
from pathlib import Path

PACKAGES = "jointlaw", "dem_demo"
MODULE = "<module>"
MAX_BLOCKS = 1 << 18
FUNCTIONS = ast.FunctionDef | ast.AsyncFunctionDef


def blocks_of(tree):
    """Qualified name of the outermost function, number in it, and statements of each block.

    Statements outside functions are the block 0 of `MODULE`. A method is a function of its class.
    """
    yield MODULE, 0, tree.body
    queue = [(tree, "")]
    while queue:
        scope, prefix = queue.pop(0)
        for node in scope.body:
            if isinstance(node, ast.ClassDef):
                queue.append((node, f"{prefix}{node.name}."))
            elif isinstance(node, FUNCTIONS):
                yield from blocks_of_function(node, f"{prefix}{node.name}")
            else:  # functions defined under a condition
                for inner in ast.walk(node):
                    if isinstance(inner, FUNCTIONS):
                        yield from blocks_of_function(inner, f"{prefix}{inner.name}")


def blocks_of_function(function, name):
    """Blocks of a function and of the functions in it."""
    number = 0
    for node in ast.walk(function):
        for field in ("body", "orelse", "finalbody"):
            statements = getattr(node, field, None)
            if isinstance(statements, list) and statements:
                yield name, number, statements
                number += 1


def digests_of(text):
    """Digest of each function of a source file, and of the module without them."""
    tree = ast.parse(text)
    parts = {}
    for name, number, statements in blocks_of(tree):
        if name != MODULE and number == 0:
            dumped = "".join(ast.dump(one) for one in statements)
            parts[name] = parts.get(name, "") + dumped
    for name, _, statements in [*blocks_of(tree)]:
        if name != MODULE:
            statements[:] = []
    parts[MODULE] = ast.dump(tree)
    return {name: hashlib.sha256(part.encode()).hexdigest()[:12] for name, part in parts.items()}


def must_come_first(statement):
    """Whether a statement is a docstring or imports from the future."""
    match statement:
        case ast.Expr(value=ast.Constant(value=str())) | ast.ImportFrom(module="__future__"):
            return True
    return False


class Recorder:
    """Marks of executed blocks, and files read, of this process and the processes it forks."""

    def __init__(self, root):
        self.root = root
        self.marks = mmap.mmap(-1, MAX_BLOCKS)
        self.blocks = []
        self.read_files = set()
        self.executed = set()
        self.folder = root / "executed"
        self.written = set()
        self.started = 0.0
        self.tests = {}

    def start(self):
        """Mark blocks of the modules that are imported from now on."""
        compile_source = SourceFileLoader.source_to_code
        packages = tuple(f"{self.root / package}{os.sep}" for package in PACKAGES)

        def compile_with_marks(loader, data, path, **options):
            if str(path).startswith(packages) and isinstance(data, bytes):
                data = self.with_marks(data, str(path))
            return compile_source(loader, data, path, **options)

        SourceFileLoader.source_to_code = compile_with_marks
        sys.addaudithook(self.note_file)
        atexit.register(self.write)

    def with_marks(self, text, path):
        """The tree of a source file with a mark at the start of each block."""
        file = str(Path(path).relative_to(self.root))
        tree = ast.parse(text)
        for name, number, statements in [*blocks_of(tree)] if tree.body else []:
            place = sum(map(must_come_first, statements[:2]))
            marks = [f"__executed__[{len(self.blocks)}] = 1"]
            if name == MODULE:
                marks.insert(0, "__executed__ = __import__('sitecustomize').MARKS")
            for mark in reversed(marks):
                (statement,) = ast.parse(mark).body
                for node in ast.walk(statement):
                    ast.copy_location(node, statements[0])
                statements.insert(place, statement)
            self.blocks.append((file, name, number))
        return ast.fix_missing_locations(tree)

    def note_file(self, event, arguments):
        """Note a file of the repository that is opened, but not if it is imported."""
        if event != "open" or not isinstance(arguments[0], str | os.PathLike):
            return
        path = os.path.abspath(arguments[0])
        if path.startswith(str(self.root) + os.sep):
            file = os.path.relpath(path, self.root)
            is_import = "importlib._bootstrap" in sys._getframe(1).f_code.co_filename
            if not (is_import and file.startswith(PACKAGES)):
                self.read_files.add(file)

    def take_marks(self):
        """Blocks executed since the last call."""
        executed = [block for i, block in enumerate(self.blocks) if self.marks[i]]
        self.marks[: len(self.blocks)] = bytes(len(self.blocks))
        self.executed.update(executed)
        return executed

    def start_test(self):
        """Forget what was executed before a test."""
        self.take_marks()
        self.written = {*self.folder.glob("*.json")}
        self.started = processor_time()

    def finish_test(self, name):
        """Note the blocks that a test and its processes have executed, and its time."""
        blocks = {*self.take_marks()}
        for path in {*self.folder.glob("*.json")} - self.written:
            blocks |= {tuple(block) for block in json.loads(path.read_text())["blocks"]}
        self.tests[name] = {"blocks": sorted(blocks), "s": processor_time() - self.started}

    def write(self):
        """Write the marks, the files read and the tests."""
        self.take_marks()
        record = {
            "blocks": sorted(self.executed),
            "read": sorted(self.read_files),
            "tests": self.tests,
        }
        self.folder.mkdir(exist_ok=True)
        name = f"{os.getpid()}-{os.urandom(4).hex()}"
        part = self.folder / f"{name}.part"
        part.write_text(json.dumps(record))
        part.rename(self.folder / f"{name}.json")


def processor_time():
    """Processor time of this process and of the processes that it has started, s."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


def pytest_runtest_logstart(nodeid):
    """Hook of pytest before a test."""
    RECORDER.start_test()


def pytest_runtest_logfinish(nodeid):
    """Hook of pytest after a test."""
    RECORDER.finish_test(nodeid)


if __name__ == "sitecustomize":
    RECORDER = Recorder(Path(__file__).resolve().parent)
    MARKS = RECORDER.marks
    RECORDER.start()
