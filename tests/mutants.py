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
import hashlib
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
from queue import Queue

ROOT = Path(__file__).parents[1]
HOME = Path(tempfile.gettempdir()) / f"mutants-{hashlib.sha256(bytes(ROOT)).hexdigest()[:8]}"
BUILT = "jointlaw/native/built"
COVERAGE = "[run]\nsource = jointlaw, dem_demo\ncontext = ${PYTEST_CURRENT_TEST-}\n"
COVERAGE += "parallel = true\npatch = subprocess\ndata_file = "
IN_C = (
    (r" \+ ", " - "), (r" - ", " + "), (r" \* ", " / "), (r" / ", " * "), (r" < ", " <= "),
    (r" > ", " >= "), (r" ([<>])= ", r" \1 "), (r" == ", " != "), (r" && ", " || "),
    (r" \|\| ", " && "), (r" \+= ", " -= "), (r" -= ", " += "), (r"(?<=[(,= ])-(?=\w)", ""),
    (r"\b0\.5\b", "0.6"), (r"\b1\.0\b", "1.1"), (r"\b0\.0\b", "0.1"), (r"\b1\b", "2"),
    (r"\bif \((.*)\)", r"if (!(\1))"), (r"\b(\w+)\((\w+), (\w+)", r"\1(\3, \2"),
    (r"^( +)[^{}]*;$", r"\1;"),
)  # fmt: skip
IN_PYTHON = (
    *IN_C[:8], *IN_C[10:17], (r" and ", " or "), (r" or ", " and "), (r"\bnot ", ""),
    (r" is ", " is not "), (r" is not ", " is "), (r" in ", " not in "), (r" not in ", " in "),
    (r"\bTrue\b", "False"), (r"\bFalse\b", "True"), (r" & ", " | "), (r" \| ", " & "),
    (r"\*\*", "*"), (r" // ", " * "),
    (r"\b([02-9]|\d\d+)\b(?![.e])", r"(\1 + 1)"), (r"\b(\d+\.\d+(e-?\d+)?)\b", r"(1.1 * \1)"),
    (r"\bif (.+?)(:$| else )", r"if not (\1)\2"), (r"\bif (.+?)(:$| else )", r"if False\2"),
    (r"\bwhile (.+):$", r"while not (\1):"), (r"(\"[\w./-]+)\"", r"\1x\""),
    (r"\b(\w+)\(([\w.]+), ([\w.]+)", r"\1(\3, \2"), (r", \w+=[\w.]+\)", ")"),
    (r"^( +)(raise .*|[\w.\[\]:, ]+ [-+*/|]?= .*|[\w.]+\(.*\))$", r"\1pass"),
)  # fmt: skip


def places(path):
    """Of each line that can have a fault: its own number, that of its statement as coverage counts
    (0 in C), and what may stand in its place. Lines of words have none.
    """
    text, c, of = path.read_text(), path.suffix != ".py", {}
    for one in ast.walk(ast.parse("" if c else text)):
        if isinstance(one, ast.stmt):
            words = isinstance(one, ast.Expr) and isinstance(one.value, ast.Constant)
            last = one.body[0].lineno - 1 if getattr(one, "body", None) else one.end_lineno
            of |= dict.fromkeys(range(one.lineno, last + 1), 0 if words else one.lineno)
    for i, line in enumerate(text.splitlines(keepends=True), 1):
        code = re.split(r"/\*|  #", line.rstrip("\n"))[0]
        inside = re.match(r"\s+\w", code) if c else of.get(i)
        made = {code[: at.start()] + at.expand(new) + code[at.end() :] + line[len(code) :]
                for rule, new in (IN_C if c else IN_PYTHON)
                for at in re.finditer(rule, code)} - {line}  # fmt: skip
        if inside and made:
            yield i, of.get(i, 0), sorted(made)


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
        without = "-p", "no:cacheprovider", "-p", "no:randomly"
        return self.python("pytest", "-q", *without, *arguments, **limit)

    def library(self):
        """The bytes of the library without the hash of its sources."""
        (made,) = (self.at / BUILT).glob("libjointlaw.*")
        return re.sub(rb"[0-9a-f]{16}", b"", made.read_bytes())

    def judge(self, name, fault, tests, limit):
        """What comes of a fault, and the first test that sees it."""
        file, native = self.at / name, "native" in name
        before, library = file.read_text(), self.library()
        try:
            compile(fault, name, "exec") if file.suffix == ".py" else None
            file.write_text(fault)
            if native and self.python("jointlaw.native")[0]:
                return "cannot be built", ""
            if file.suffix != ".py" and self.library() == library:
                return "the same library", ""
            (self.at / "chosen").write_text("\n".join(tests))
            status, said = self.pytest("-x", "-n0", "-m", "", "@chosen", limit=limit)
            by = re.findall(r"^(?:FAILED|ERROR) (.*?)(?: - |$)", said, re.M) or [said[-300:]]
            return ("seen", f"by {by[0]}") if status else ("survived", f"{len(tests)} tests")
        except (SyntaxError, subprocess.TimeoutExpired) as error:
            return type(error).__name__, ""
        finally:
            file.write_text(before)
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
    found = []
    for where in (ROOT / one for one in options.where):
        for path in [where] if where.is_file() else sorted(where.rglob("*.*")):
            if path.suffix in (".py", ".c", ".h") and BUILT not in str(path):
                found += [(str(path.relative_to(ROOT)), *place) for place in places(path)]
    draw, copies, counts = random.Random(options.seed), Queue(), collections.Counter()
    drawn = draw.sample(found, min(options.count, len(found)))
    for i in range(2):
        copies.put(Copy(f"copy-{i}"))

    def run(name, i, statement, made):
        text, runs = (ROOT / name).read_text().splitlines(keepends=True), name
        old, new = text[i - 1], draw.choice(made)
        if not statement:
            runs = "dem_demo/compiled.py" if "blocks" in name else "jointlaw/kernels/engine.py"
        of_file = lines.get(runs, {})
        ran = not statement or statement in of_file
        tests = ran and (of_file.get(statement) or set().union(*of_file.values()) or every)
        order = sorted(tests, key=lambda test: ("/unit/" not in test, test)) if tests else []
        fault, copied = "".join([*text[: i - 1], new, *text[i:]]), copies.get()
        fate = copied.judge(name, fault, order, options.limit) if tests else ("not run", "")
        copies.put(copied)
        counts[fate[0]] += 1
        print(
            " ".join(fate),
            f"{name}:{i}",
            f"- {old.strip()}",
            f"+ {new.strip()}",
            sep="\n  ",
            flush=True,
        )

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(lambda place: run(*place), drawn))
    print(f"{len(found)} places; {', '.join(f'{n} {fate}' for fate, n in counts.items())}")


if __name__ == "__main__":
    main()
