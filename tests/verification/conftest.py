"""Fixtures of the verification tests."""

import json

import pytest


@pytest.fixture
def record(record_property):
    """record(key, *values): figures for the report of the run, from which docs make tables."""

    def add_property(key, *values):
        record_property(key, json.dumps(values, default=float))

    return add_property
