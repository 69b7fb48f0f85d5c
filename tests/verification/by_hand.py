"""Comparison of the tables and fields of files with expected values, name by name."""

import csv

import numpy as np


def compare(actual, expected, where):
    """Compare columns with pairs (values, tolerance), name by name; no name may be missing."""
    assert actual.keys() == expected.keys(), f"{where}: give every column its value by hand"
    for name, (values, tolerance) in expected.items():
        np.testing.assert_allclose(
            actual[name], values, rtol=0.0, atol=tolerance, err_msg=f"{where}: {name}"
        )


def columns(path):
    """Columns of a CSV file, as texts by their titles."""
    header, *rows = csv.reader(path.read_text().splitlines())
    assert len({*header}) == len(header)
    return dict(zip(header, zip(*rows, strict=True), strict=True))


def assign_fractions(joints):
    """Give the fractions of joints, equal in scenes at rest, three values; returns them."""
    fractions = {"sliding": 0.25, "slipping": 0.5, "separated": 0.75}
    for name, value in fractions.items():
        getattr(joints, name)[:] = value
    return fractions
