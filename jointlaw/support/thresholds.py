"""Thresholds of the step, the same in every kernel; native/layout.py writes them into C."""

UNDERFLOW = 1e-140  # m, and Pa/m: counts as zero, for powers and squares below it underflow
TINY = 1e-290  # a stiffness whose reciprocal might overflow, or a square that underflows: zero
FAINT = 1e-150  # a product of two stiffnesses, likewise
NEAR = 1e-5  # of y: below such a change of y the chord of G is lost in rounding, the mean is not
LIMIT = 1e-9  # of the friction limit: a slider this close is at it, less the rounding of q
ROUNDED = 1e-12  # of Phi and of y: as much may be lost in a G next to a node, and in dy
FAR = 100.0  # mating lengths from mate, where unmated joints start: no slope is left to feel
STICKS = 1e30  # a friction of Coulomb's joint from here on counts as infinite
PARTED = 2.0  # w of a Coulomb's joint whose faces have parted or meet anew: friction alone
STRONGEST = 1e70  # Pa: fourth powers of stresses of Coulomb's joint beyond it overflow
BEND = 0.8587  # largest |d2o/dp2| times the mating length: 1.5/1.25^2.5, half a length from mate
