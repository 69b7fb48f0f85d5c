"""Peak and residual shear stress of sandstone joints: fitted at three normal stresses.

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

    Four numbers for nine figures: K, a, mu and the mating length.
    """
    return jl.JointLaw(
        orientation=jl.Orientation(4.774),
        asperity=jl.Asperity(
            K=1.915e6, lam=1.17, eta=0.5, mu=0.8026
        ),
        asperity_density=1e6, closure_range=1e-3, resolution=jl.Resolution(5, 3, 2), plane=0.0,
        mating_length=5.748e-3,
    )  # fmt: skip


@pytest.mark.parametrize("normal", MEASURED)
def test_peak_and_residual(normal):
    peak, at, residual = MEASURED[normal]
    record = jl.direct_shear(law().joint(), [10e-3], normal * 1e6, steps=120)
    stress = record.shear_stress
    top = int(np.argmax(stress))
    # 2 and 4 MPa were not fitted: peaks +3.8 and +2.3 %, residuals -2.6 and -1.2 %
    assert stress[top] == pytest.approx(peak * 1e6, rel=0.05)
    assert stress[-1] == pytest.approx(residual * 1e6, rel=0.05)
    assert record.shear[top] == pytest.approx(at * 1e-3, rel=0.4)  # 0.64 to 0.90 of it
    assert record.peak_friction_angle - record.residual_friction_angle > 5.0
    finer = jl.direct_shear(law().joint(), [10e-3], normal * 1e6, steps=240).shear_stress
    assert np.max(np.abs(finer[::2] - stress)) < 5e-3 * stress[top]
