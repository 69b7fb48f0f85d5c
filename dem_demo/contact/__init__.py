"""Contact: corners on edges, the identity of contacts, the joints between blocks.

geometry       closure, sliding and length of joint at corners on edges
manager        which corners are over which edges, and the identity of each through time
joints         one batch of joints for each law, and its virgin curve
"""

from .geometry import Contacts, Outlines
from .joints import PARTS, Joints, tabulate_first_loading
from .manager import STALE, ContactManager

__all__ = [
    "PARTS",
    "STALE",
    "ContactManager",
    "Contacts",
    "Joints",
    "Outlines",
    "tabulate_first_loading",
]
