"""Faults of outputs (`tests/mutants.py --outputs`) fit the present sources, and there are some of
each kind."""

import ast

from output_faults import ROOT, all_faults


def test_every_fault_can_be_inserted():
    by_kind = all_faults()
    assert {*by_kind} == {"columns", "keys", "units", "pictures", "state", "pages"}
    parsed = set()  # lines are inserted at a few places, by one template each
    for fault in (fault for faults in by_kind.values() for fault in faults):
        place = fault.kind, fault.file, fault.start
        if fault.kind in ("keys", "state") and place not in parsed:
            parsed.add(place)
            text = (ROOT / fault.file).read_bytes()
            ast.parse(text[: fault.start] + fault.new.encode() + text[fault.end :])
    assert min(map(len, by_kind.values())) >= 40
