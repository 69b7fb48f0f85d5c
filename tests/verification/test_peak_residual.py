"""Peak and residual shear stress of sandstone joints: a law fitted at three normal stresses.

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
    """Least squares on 1, 3 and 5 MPa (docs/measure/peak_residual.py): four for nine figures."""
    return jl.JointLaw(
        orientation=jl.Orientation(4.309),
        asperity=jl.Asperity(K=1.680e6, lam=1.17, eta=0.5, mu=0.7470),
        asperity_density=1e6, closure_range=1e-3, resolution=jl.Resolution(5, 3, 2), plane=0.0,
        mating_length=7.456e-3,
    )  # fmt: skip


def figures(normal):
    """Peak (Pa), its displacement (m) and the last stress (Pa), over those measured."""
    record = jl.direct_shear(law().joint(), [10e-3], normal * 1e6, steps=120)
    top = int(np.argmax(record.shear_stress))
    found = np.array([record.shear_stress[top], record.shear[top], record.shear_stress[-1]])
    return found / (np.array(MEASURED[normal]) * [1e6, 1e-3, 1e6]), record


def test_the_fitted_figures():
    """Logarithms, that of the displacement at a quarter of the weight: a peak is flat."""
    misfit = [np.log(figures(normal)[0]) * [1, 0.25, 1] for normal in (1.0, 3.0, 5.0)]
    assert np.sqrt(np.mean(np.square(misfit))) < 0.02


@pytest.mark.parametrize("normal", MEASURED)
def test_peak_and_residual(normal):
    (peak, at, residual), record = figures(normal)
    # 2 and 4 MPa were not fitted: peaks +4.6 and +2.3 %, residuals -2.4 and -1.4 %
    assert peak == pytest.approx(1, rel=0.05)
    assert residual == pytest.approx(1, rel=0.03)
    assert at == pytest.approx(1, rel=1 / 3)
    assert record.peak_friction_angle - record.residual_friction_angle > 5.0
    finer = jl.direct_shear(law().joint(), [10e-3], normal * 1e6, steps=240).shear_stress
    change = np.max(np.abs(finer[::2] - record.shear_stress))
    assert change < 5e-3 * record.shear_stress.max()
