"""Laws, checks and measures at the extremes, shared by tests.

The tests record their figures as properties of their report (`pytest --junitxml`), from which
docs/measure/recorded.py makes tables; docs/validation.md has their figures. With JOINTLAW_FULL=1
in the environment they run at the full length of these tables.
"""

import os

FULL = os.environ.get("JOINTLAW_FULL") == "1"
