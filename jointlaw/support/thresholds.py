"""Thresholds of the constitutive update, the same in Python and in C (native/layout.py).

A number below a threshold counts as zero, so that powers, squares and reciprocals stay finite.
"""

UNDERFLOW = 1e-140  # m or Pa/m: squares and powers of smaller numbers underflow
MIN_DIVISOR = 1e-290  # smallest stiffness that is divided by, smallest squared force
MIN_STIFFNESS_PRODUCT = 1e-150  # smallest product of two stiffnesses that is divided by
MIN_CHORD_STEP = (
    1e-5  # relative change of y: below it rounding spoils the chord of G, not its slope
)
FRICTION_TOLERANCE = 1e-9  # of the friction limit: a slider this close below it counts as sliding
ROUNDING_TOLERANCE = 1e-12  # of Phi or y: rounding error allowed in G near a node and in dy
UNMATED_DISTANCE = 100.0  # mating lengths at which unmated joints start: no interlock is left
INFINITE_FRICTION = 1e30  # coefficient of Coulomb's joint that counts as infinite
SEPARATED_STATE = 2.0  # state w of a Coulomb joint after separation: friction only, no cohesion
MAX_STRENGTH = 1e70  # Pa: fourth powers of larger stresses of Coulomb's joint overflow
FACTOR_CONVERGENCE = 4e-16  # relative change at which the search for slopes by stress ends
MAX_FACTOR_ITERATIONS = 100  # of this search, which takes two to six for elastic asperities
MAX_SLIDER_SQUARES = 1e300  # sum over the sliders of a state: larger squares overflow in a step
MAX_OFFSET_CURVATURE = 0.8587  # largest |d2o/dp2| mating lengths, at p = 1/2 of one: 1.5/1.25^2.5
FLOAT_LIMIT_TOLERANCE = (
    1.5e-7  # relative: rounding to a float, 2^-23, moves a force so far beyond it
)
FLOAT_FRICTION_TOLERANCE = 3e-7  # as FRICTION_TOLERANCE, for forces rounded to floats
MIN_FLOAT = 1.17549435e-38  # smallest normal float, 2^-126, rounded down
MAX_FLOAT_FORCE = 1e38  # Pa: larger forces of sliders are not stored as float
