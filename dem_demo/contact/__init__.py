"""Contact: corners on edges, the identity of contacts, the joints between blocks.

rows           a contact point as the rest of the demo reads it, in the plane and in space
candidates     pairs of contacts with equal keys, and the nearest of them
geometry       closure, sliding and length of joint at corners on edges
manager        which corners are on which edges, and the identity of contacts in time
joints         a pool of joints for each law, and its first-loading curve
"""

from .geometry import Contacts, Outlines
from .joints import STATE_PARTS, Joints, tabulate_first_loading
from .manager import ContactManager
from .rows import ContactRows

__all__ = [
    "STATE_PARTS",
    "ContactManager",
    "ContactRows",
    "Contacts",
    "Joints",
    "Outlines",
    "tabulate_first_loading",
]
