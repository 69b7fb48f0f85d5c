"""What the tests of this folder share."""

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # its helpers are imported by name


@pytest.fixture
def record(record_property):
    """record(key, *values): figures for the report of the run, from which docs make tables."""

    def note(key, *values):
        record_property(key, json.dumps(values, default=float))

    return note
