"""What a refusal must leave as it was, and how a command must tell it."""

from contextlib import contextmanager

import numpy as np
import pytest


@contextmanager
def refused(joints, told, error=ValueError):
    """What follows raises an error with this text, and the joints stay as they were."""
    before = joints.snapshot().values
    with pytest.raises(error, match=told) as caught:
        yield caught
    np.testing.assert_array_equal(joints.snapshot().values, before)
