"""Contact: corners on edges, the identity of law points, the joints between blocks.

smoothing      soft choices of the geometry
edge_points    law points along a long overlap
geometry       closure, sliding and length of joint at corners on edges
narrow_phase   which corners are over which edges
law_points     the identity of every law point through time
stiffness      the virgin curve of a law, tabulated for the host
joints         one pool of joints for each law
"""

from .geometry import Assembly, Contacts, Points
from .joints import Joints, PoolState
from .law_points import Identity, LawPoints, Tracker
from .smoothing import raised
from .stiffness import StiffnessCurve

__all__ = [
    "Assembly",
    "Contacts",
    "Identity",
    "Joints",
    "LawPoints",
    "Points",
    "PoolState",
    "StiffnessCurve",
    "Tracker",
    "raised",
]
