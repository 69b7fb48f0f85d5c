"""Faults of outputs (`tests/mutants.py --outputs`) fit the present sources, and there are some of
each kind."""

import ast

from output_faults import ROOT, all_faults


def test_every_fault_can_be_inserted():
    by_kind = all_faults()
    assert {*by_kind} == {"columns", "keys", "units", "pictures", "state", "pages"}
    texts = {}
    for fault in (fault for faults in by_kind.values() for fault in faults):
        text = texts.setdefault(fault.file, (ROOT / fault.file).read_bytes())
        faulty = text[: fault.start] + fault.new.encode() + text[fault.end :]
        assert faulty != text
        if fault.file.endswith(".py") and fault.kind in ("keys", "state"):
            ast.parse(faulty)
    assert min(map(len, by_kind.values())) >= 40
