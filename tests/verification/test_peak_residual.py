"""Peak and residual shear stress of sandstone joints: wear, fitted at three normal stresses.

Profile JA, dry: Mendeley Data, doi 10.17632/g5pf6k9n2w, as parsed by ybfo/RockJointNet.
"""

import numpy as np
import pytest

import jointlaw as jl

pytestmark = pytest.mark.slow
# normal stress (MPa): peak (MPa), its displacement (mm), stress at 10 mm (MPa)
MEASURED = {
    1.0: (1.280, 1.937, 0.862),
    2.0: (2.310, 2.365, 1.775),
    3.0: (3.418, 1.994, 2.575),
    4.0: (4.468, 2.422, 3.483),
    5.0: (5.719, 2.650, 4.331),
}


def law():
    """Least squares on 1, 3 and 5 MPa.

    Six numbers for nine figures: mu_residual, wear_slip and critical_slip trade against one another
    within 1 % of the curves.
    """
    return jl.JointLaw(
        orientation=jl.Orientation(3.198),
        asperity=jl.Asperity(
            K=4.437e6, lam=1.17, eta=0.5, mu=0.5587, mu_residual=0.2168, wear_slip=8.477e-3
        ),
        asperity_density=1e6, closure_range=1e-3, resolution=jl.Resolution(5, 3, 2), plane=0.0,
        critical_slip=5.175e-3,
    )  # fmt: skip


@pytest.mark.parametrize("normal", MEASURED)
def test_peak_and_residual(normal):
    peak, at, residual = MEASURED[normal]
    record = jl.direct_shear(law().joint(), [10e-3], normal * 1e6, steps=120)
    stress = record.shear_stress
    top = int(np.argmax(stress))
    # 2 and 4 MPa were not fitted: peaks +4.4 and +2.7 %, residuals -2.7 and -1.8 %
    assert stress[top] == pytest.approx(peak * 1e6, rel=0.05)
    assert stress[-1] == pytest.approx(residual * 1e6, rel=0.05)
    assert record.shear[top] == pytest.approx(at * 1e-3, rel=1 / 3)
    assert record.peak_friction_angle - record.residual_friction_angle > 5.0
    finer = jl.direct_shear(law().joint(), [10e-3], normal * 1e6, steps=240).shear_stress
    assert np.max(np.abs(finer[::2] - stress)) < 5e-3 * stress[top]
