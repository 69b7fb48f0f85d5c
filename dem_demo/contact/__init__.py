"""Contact: corners on edges, the identity of contacts, the joints between blocks.

geometry       closure, sliding and length of joint at corners on edges
narrow_phase   which corners are over which edges
tracker        the identity of every contact through time
stiffness      the virgin curve of a law, tabulated for the host
joints         one pool of joints for each law
"""

from .geometry import Contacts
from .joints import Joints, PoolState
from .stiffness import StiffnessCurve
from .tracker import Tracker

__all__ = ["Contacts", "Joints", "PoolState", "StiffnessCurve", "Tracker"]
