"""Contact: corners on edges, the identity of contacts, the joints between blocks.

geometry       closure, sliding and length of joint at corners on edges
manager        which corners are on which edges, and the identity of contacts in time
joints         a pool of joints for each law, and its first-loading curve
"""

from .geometry import Contacts, Outlines
from .joints import STATE_PARTS, Joints, tabulate_first_loading
from .manager import MAX_SKIN_UNTIL_REBUILD, ContactManager

__all__ = [
    "MAX_SKIN_UNTIL_REBUILD",
    "STATE_PARTS",
    "ContactManager",
    "Contacts",
    "Joints",
    "Outlines",
    "tabulate_first_loading",
]
