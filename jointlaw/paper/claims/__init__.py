"""The claims of Misra 1999 that can be decided, each with our number.

One function for each claim, in the order of the paper; it runs once, and the table of the docs, the
command `jointlaw figures --claims` and the tests all read its finding.
"""

from . import surface  # noqa: F401, I001  (in this order)
from . import elastic  # noqa: F401  (in this order)
from . import normal  # noqa: F401  (in this order)
from . import asperity  # noqa: F401  (in this order)
from . import closure  # noqa: F401  (in this order)
from . import shear  # noqa: F401  (in this order)
from . import strength  # noqa: F401  (in this order)
from .registry import Claim, Finding, get, header, keys, measure, row, table

__all__ = ["Claim", "Finding", "get", "header", "keys", "measure", "row", "table"]
