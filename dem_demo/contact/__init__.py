"""Contact: corners on edges, the identity of contacts, the joints between blocks.

geometry       closure, sliding and length of joint at corners on edges
tracker        which corners are over which edges, and the identity of each through time
joints         one batch of joints for each law, and its virgin curve
"""

from .geometry import Contacts, Outlines
from .joints import PARTS, Joints, virgin_curve
from .tracker import STALE, Tracker

__all__ = ["PARTS", "STALE", "Contacts", "Joints", "Outlines", "Tracker", "virgin_curve"]
