"""Contact: corners on edges, the identity of contacts, the joints between blocks.

geometry       closure, sliding and length of joint at corners on edges
narrow_phase   which corners are over which edges
tracker        the identity of every contact through time
joints         one pool of joints for each law, and its virgin curve
"""

from .geometry import Contacts
from .joints import Joints, PoolState, virgin_curve
from .tracker import Tracker

__all__ = ["Contacts", "Joints", "PoolState", "Tracker", "virgin_curve"]
