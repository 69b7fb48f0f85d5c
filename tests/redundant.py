"""Which expensive quick tests detect faults that no cheaper test detects.

    python tests/redundant.py jointlaw dem_demo --count 60 --seed 1

The expensive tests are the test functions with the most processor time in the records of
`tests/mutants.py`, all cases of a function together: `--dearest` of them, or all with one of the
texts after `--of` in their names; with `--cases` each case is a test of its own. The faults are
random ones in Python and C, and faults in what a user reads (`tests/output_faults.py`), each in
blocks that an expensive test executes. A fault meets first the cheap tests that can detect it.
Faults that none of them detects meet each expensive test. The table says for each expensive test
its processor time, how many faults it executes, how many no cheap test but it detected, and how
many no other test detected; below it are the cases that did.

With `--reuse-records` only files with a record count, as expensive tests and as cheap ones.
A test without such faults may still be the only one of a physical claim: then it is marked slow.
"""

import argparse
import collections
import itertools
import math
import random

from mutants import (
    LIKELY_TIME,
    Copy,
    compatible,
    failing_tests,
    faults_by_line,
    recorded_tests,
    tests_of_statement,
)
from output_faults import Fault, all_faults

QUICK = ["-m", "not slow"]
TURNS = "Python", "C", "Python", "outputs"  # kinds of the faults drawn, in turn
LIMIT_TOGETHER = 1800.0  # s, of all cheap tests with several faults at once


def function_of(test):
    """A test function: the name of a test without its case."""
    return test.partition("[")[0]


def expensive_tests(records, options):
    """Processor time (s) of each expensive test; and the expensive test of each of its cases."""
    times = collections.Counter()
    test_of_case = {}
    for record in records.values():
        for case, (_, seconds) in record["tests"].items():
            test = case if options.cases else function_of(case)
            if not options.of or any(text in test for text in options.of):
                times[test] += seconds
                test_of_case[case] = test
    dearest = times.most_common(None if options.of else options.dearest)
    times = {test: seconds for test, seconds in dearest if seconds >= options.least}
    return times, {case: test for case, test in test_of_case.items() if test in times}


def faults_of_sources(root, where, rng):
    """Random faults of Python and C, one in each line, in a random order: (fault, line)."""
    by_line = faults_by_line(root, where)
    for name, line in rng.sample(sorted(by_line), len(by_line)):
        statement, start, end, new = rng.choice(sorted(by_line[name, line]))
        kind = "Python" if name.endswith(".py") else "C"
        old = (root / name).read_bytes()[start:end].decode()
        yield Fault(kind, name, start, end, new, f"{line}: {old} -> {new}"), statement


def faults_of_outputs(root, rng):
    """Faults of outputs in a random order, of each kind in turn: (fault, line)."""
    by_kind = all_faults()
    orders = [rng.sample(by_kind[kind], len(by_kind[kind])) for kind in sorted(by_kind)]
    for fault in itertools.chain(*itertools.zip_longest(*orders)):
        if fault is not None:
            yield fault, (root / fault.file).read_bytes()[: fault.start].count(b"\n") + 1


def able_tests(recorded, fault, line):
    """Processor time (s) of each test that can detect a fault, those of cheap files first."""
    if fault.kind == "C":
        names = tests_of_statement(recorded, fault.file, 0)
        every = {
            name: seconds
            for record in recorded.records.values()
            for name, (_, seconds) in record["tests"].items()
        }
        able = {name: every[name] for name in names}
    else:
        able = {name: s for tests in recorded.able(fault.file, line).values() for name, s in tests}
    known = {test: seconds for test, seconds in able.items() if math.isfinite(seconds)}
    of_files = collections.Counter()
    for test, seconds in known.items():
        of_files[test.partition("::")[0]] += seconds
    order = sorted(known, key=lambda test: (of_files[test.partition("::")[0]], known[test]))
    return {test: known[test] for test in order}


def drawn_faults(recorded, copy, options, expensive):
    """Faults that expensive tests execute, with the tests that can detect each."""
    rng = random.Random(options.seed)
    sources = [*faults_of_sources(copy.root, options.where, rng)]
    queues = {
        kind: iter([one for one in sources if one[0].kind == kind]) for kind in ("Python", "C")
    }
    queues["outputs"] = faults_of_outputs(copy.root, rng)
    drawn = {}
    turns = itertools.cycle(TURNS)
    while queues and len(drawn) < options.count:
        kind = next(turns)
        for fault, line in queues.get(kind, ()):
            able = able_tests(recorded, fault, line)
            if not expensive.keys().isdisjoint(able):
                drawn[fault] = able
                break
        else:
            queues.pop(kind, None)
    return drawn


def told(fault):
    """A fault in one line."""
    return f"{fault.kind} {fault.file}: {' '.join(fault.what.split())[:160]}"


def seen_by_cheap_tests(copy, drawn, expensive, limit):
    """The cheap test that detects each fault, as far as one does.

    First fast tests, of `LIKELY_TIME` in all; then the faults left are inserted at once, all cheap
    tests that can detect one of them are run, and the failing ones are run with each fault alone.
    """
    seen = {}
    cheap = {
        fault: {test: s for test, s in able.items() if test not in expensive}
        for fault, able in drawn.items()
    }
    for fault in [*drawn]:
        times = zip(cheap[fault], itertools.accumulate(cheap[fault].values()), strict=True)
        fast = [test for test, total in times if total < LIKELY_TIME]
        failed = fast and failing_tests(copy, [fault], ["-x", *QUICK], fast, limit)
        if failed == ["cannot be built"]:
            del drawn[fault]
            continue
        if failed:
            seen[fault] = failed[0]
        print(told(fault), f"\n    {seen.get(fault, 'by no fast test')}", flush=True)
    detecting = sorted({test for test in seen.values() if "::" in test})
    fail_always = {*failing_tests(copy, [], QUICK, detecting)} if detecting else set()
    print(f"without a fault fail: {sorted(fail_always) or 'none'}", flush=True)
    seen = {fault: test for fault, test in seen.items() if test not in fail_always}
    tried = set()
    while group := compatible([one for one in drawn if one not in seen and one not in tried]):
        tried |= {*group}
        tests = sorted({test for fault in group for test in cheap[fault]})
        print(f"{len(group)} faults at once, {len(tests)} cheap tests", flush=True)
        failed = failing_tests(copy, group, QUICK, tests, LIMIT_TOGETHER)
        for fault in group:
            is_whole = any("::" not in test for test in failed)  # too long, or pytest itself fails
            able = [test for test in tests if test in cheap[fault]]
            able = able if is_whole else [test for test in failed if test in cheap[fault]]
            by = able and failing_tests(copy, [fault], ["-x", *QUICK], able, limit)
            if by:
                seen[fault] = by[0]
            print(told(fault), f"\n    {seen.get(fault, 'by no cheap test')}", flush=True)
    return seen


def seen_by_expensive_tests(copy, faults, drawn, expensive, limit):
    """Failing cases of each expensive test, by fault and test."""
    cases = {}
    for fault in faults:
        able = {expensive[case] for case in drawn[fault] if case in expensive}
        cases[fault] = {
            test: failed
            for test in sorted(able)
            if (failed := failing_tests(copy, [fault], QUICK, [test], limit))
        }
        print(told(fault), f"\n    only by {cases[fault] or 'nothing'}", flush=True)
    return cases


def print_table(times, expensive, drawn, cases):
    """Print the table of the expensive tests, and the cases that detected faults alone."""
    print("\nexpensive test | processor time (s) | executes | no cheap test detects | no other")
    print("--- | --- | --- | --- | ---")
    needed = collections.defaultdict(set)
    for test, seconds in times.items():
        executed = [
            fault
            for fault, able in drawn.items()
            if any(expensive.get(case) == test for case in able)
        ]
        detected = [fault for fault in cases if test in cases[fault]]
        alone = [fault for fault in detected if len(cases[fault]) == 1]
        for fault in detected:
            needed[test] |= {case.partition("[")[2] for case in cases[fault][test]}
        print(f"{test} | {seconds:.1f} | {len(executed)} | {len(detected)} | {len(alone)}")
    for test, names in needed.items():
        print(f"{test}: {', '.join(sorted(names))}"[:1000])


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("where", nargs="+", help="files and folders of the repository, for faults")
    parser.add_argument("--dearest", type=int, default=40, help="how many tests are expensive")
    parser.add_argument("--of", nargs="*", default=[], help="texts in the names of expensive tests")
    parser.add_argument("--cases", action="store_true", help="each case is a test of its own")
    parser.add_argument("--least", type=float, default=0.5, help="s of an expensive test")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=float, default=300.0, help="s for the tests of one fault")
    parser.add_argument("--processes", type=int, default=2, help="that record")
    parser.add_argument("--reuse-records", action="store_true", help="stale ones too, none is made")
    options = parser.parse_args()
    recorded = recorded_tests("not slow", options.processes, not options.reuse_records)
    times, expensive = expensive_tests(recorded.records, options)
    copy = Copy("redundant")
    drawn = drawn_faults(recorded, copy, options, expensive)
    seen = seen_by_cheap_tests(copy, drawn, expensive, options.limit)
    unseen = [fault for fault in drawn if fault not in seen]
    cases = seen_by_expensive_tests(copy, unseen, drawn, expensive, options.limit)
    print_table(times, expensive, drawn, cases)
    nowhere = [fault for fault in unseen if not cases[fault]]
    print(
        f"{len(drawn)} faults: cheap tests detect {len(seen)}, expensive ones alone "
        f"{len(unseen) - len(nowhere)}; no quick test {len(nowhere)}:"
    )
    print("\n".join(map(told, nowhere)))


if __name__ == "__main__":
    main()
