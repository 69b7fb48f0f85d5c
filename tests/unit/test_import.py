"""`import jointlaw` needs numpy and scipy alone, and leaves the slow parts until they are asked."""

import subprocess
import sys

LATE = (
    "matplotlib", "pymunk", "tqdm", "pandas", "scipy.stats", "scipy.optimize", "scipy.spatial",
    "jointlaw.calibration", "jointlaw.surface", "jointlaw.tables.tabulate",
)  # fmt: skip


def test_a_code_that_embeds_the_law_loads_no_tools_for_measurements():
    code = "import sys, jointlaw; print(*sys.modules)"
    modules = subprocess.check_output([sys.executable, "-c", code], text=True).split()
    assert "jointlaw" in modules
    assert [module for module in modules if module.startswith(LATE)] == []
