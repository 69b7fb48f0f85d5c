"""Title and caption of each figure: what is computed, and what the paper does not print."""

from __future__ import annotations

_TEXT = """
03: asperity height distributions, Westerly granite
Gamma densities of Eq. 12 with the printed parameters (smooth: alpha = 3.82, beta = 1.15 um; rough:
alpha = 6.14, beta = 3.52 um) and, right, the share of asperities in touch, Eq. 11 over N. Dots: the
overlap r0 at zero closure. The measured heights of the paper's figure are not printed as numbers.

04-06: axes and signs
In place of the paper's sketches. Axis 1 is the interface normal, along the closing motion; n =
(cos theta, sin theta cos phi, sin theta sin phi) is the facet normal, s and t span the facet (Eq.
25). delta_1 > 0 closes, F_1 > 0 presses; F is the resistance in the sense of delta. A facet that
leans towards the shear is loaded by it; one that leans away unloads and may separate.

05: orientation densities of smooth and rough interfaces
Eq. 14 with b = c = 0. The paper sketches this figure without values; a = 3 and a = 6 are those that
it later uses for its rough and smooth interface.

07: dependence of the orientation density on a, b and c
Eq. 14 per solid angle, 0 <= theta <= pi/2a. All parameters are printed. For b = 0 the density is
constant at a = 1 only; at a = 2 it is constant in cos(a theta), not per solid angle.

08: elastic stiffness ratio of the interface
Closed forms of Table 1 (here for every a and b), c = 0. (a) K_s/K_n = 0.5. (b) The bands are the
ranges quoted in the text: 0.78 to 1.1 measured, 0.67 to 1 of Hertz-Mindlin contacts. The paper does
not print which a and b it draws in (b); ours are in the legend.

09: directional elastic shear stiffness
Resultant C_s of Eq. 28 over C11 for a = 1, b = 0, K_s/K_n = 0.5. All parameters are printed.
Direction 2 is at 0 degrees.

10: asperities that slide in closure
Left: count of asperities per degree of inclination for a = 2, b = c = 0, and those beyond theta_s =
arctan(mu K_n/K_s), Eq. 30, at mu = 0.6 and K_s = K_n (the paper's sketch prints no values). Right:
their share against mu. Lines: total form; dots: incremental law, whose orientations are discrete
(12 inclinations).

11: normal closure, Westerly granite
All parameters of section 4.1 except the friction, which the paper does not print here (0.3, from
section 4.3). The smooth interface is softer at first, since fewer of its asperities touch at zero
closure, and stiffer beyond the crossing. The two forms part little: only in the shear force of
inclined contacts (Eq. 35 against exact oblique loading). Dotted: each asperity feels only the
closure since it touched. Measured points and the range of the axes are not printed.

12: initial shear stiffness against normal stress
dF_2/d delta_2 at zero shear and kept closure, after closing to the normal stress. (a) Parameters of
section 4.1, friction 0.3 as in section 4.3. (b) Parameters of section 4.2; the paper prints no
contact density for the replica, so its stiffness is drawn over one value of its own, and the stress
axis shifts with the density that is assumed. The incremental law is stiffer, since asperities that
slid in closure stick when the shear begins. Measured points and axis ranges are not printed.

13: directional initial shear stiffness, concrete replica
Parameters of section 4.2 (a = 3, b = -1, c = -0.3, lambda = 0.33), stiffness along the motion over
its mean over all azimuths: the contact density is not printed. The three stresses fall on one
curve. Direction 2 (0 degrees) is the stiffer one although c < 0, because lambda < 1 makes
asperities stiffer in shear than in closure. Measured points are not printed.

14: effect of the orientation parameter a on shear resistance
F_2/F_1 at a kept closure of 1 um for linear asperities, lambda = 1, mu = 0.6, b = c = 0. Neither K
nor the contact density enters. In the right panel thin dots repeat the total form. The paper does
not print the end of its axis.

15: effect of asperity nonlinearity on shear resistance
F_2/F_1 at a kept closure of 1 um for linear (eta = 0) and nonlinear (eta = 1/2) asperities, lambda
= 1, mu = 0.6. In the right panel thin dots repeat the total form. At small shear the total form is
softer for eta = 1/2: it sees asperities that the closure has loaded in shear further along Eq. 35,
while the incremental law gives new shear its full initial stiffness.

16: sliding and separated asperities during shear
Linear asperities at a kept closure of 1 um, lambda = 1, mu = 0.6. Dotted ticks: separation begins
at delta_2 = delta_1 cot(pi/2a). Sliding begins earlier for a = 3 but is complete earlier for a = 6.
The small steps of the incremental law are its discrete orientations.

17: shear resistance of Westerly granite at a normal stress of 10 MPa
Parameters of section 4.3; the contact density is that of section 4.1. In the right panel thin dots
repeat the total form; circles mark where all asperities in touch slide. In the total form the rough
interface is stiffer at first and the smooth one stronger later; in the incremental law the smooth
one is above from the start. Measured points and the end of the axis are not printed.

18: directional friction angle, concrete replica
arctan(shear resistance/normal stress) when all asperities in touch first slide, mu = 0.47 and the
parameters of section 4.2. In the total form it does not depend on the normal stress at all. Grey:
arctan(mu) + pi/2a, reached when the slip is far above the closure, hence at any slip when the
normal stress is zero. Measured points are not printed.

19: friction angle against normal stress, concrete replica
The same interface by two definitions of yield: all asperities in touch slide (nearly independent of
normal stress), and a slip of 1 mm (falls with normal stress). Grey line: arctan(mu) + pi/2a, at
zero normal stress for any slip. The contact density is not printed: with another one the dashed
curves shift along the stress axis. Measured points are not printed.
"""


def _parsed() -> dict[str, tuple[str, str]]:
    found = {}
    for block in _TEXT.strip().split("\n\n"):
        head, *lines = block.splitlines()
        number, _, title = head.partition(": ")
        found[number] = (title, " ".join(lines))
    return found


CAPTIONS = _parsed()
