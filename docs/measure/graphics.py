"""The kernel of docs/native.md on a graphics processor, beside the law in Python.

    python docs/measure/graphics.py FOLDER [--law westerly-rough] [--joints 1000000]

exports the law into FOLDER and prints the largest difference of the traction in random steps in
space, as a share of the largest traction, and the time per joint and step. Needs CuPy.
"""

import cupy
import numpy as np
from cupyx.profiler import benchmark
from tables import ROOT, asked, folder

import jointlaw as jl

STEPS, COMPARED = 50, 2000  # joints that are compared; the others repeat their steps


def main() -> None:
    """Run the kernel, and print."""
    given = asked(__doc__, folder=folder, law="westerly-rough", joints=1_000_000)
    law, n, found = jl.presets.load_any(given.law), given.joints, []
    joints, rng = law.joints(COMPARED), np.random.default_rng(0)
    steps = law.closure_range * rng.normal(0.0, 0.05, (STEPS, COMPARED, 3))
    steps[0, :, 0] = law.closure_range * rng.uniform(0.3, 0.8, COMPARED)
    jl.export_c(law, given.folder, "rock")
    page = (ROOT / "docs" / "native.md").read_text().partition('RawModule(code=r"""\n')[2]
    module = cupy.RawModule(
        code=page.partition('\n"""')[0],
        options=(f"-I{given.folder}", f"-DLAW={law.fingerprint}"),
    )
    states, d, F = (cupy.zeros(shape) for shape in ((law.state_size, n), (n, 3), (n, 3)))
    call = (-(-n // 128),), (128,), (states, d, F, np.int32(n))
    for step in steps:
        d[:] = cupy.asarray(np.resize(step, (n, 3)))
        module.get_function("advance")(*call)
        found.append([F[:COMPARED].get(), joints.update(step, tangent=False)[0]])
    here, there = np.swapaxes(found, 0, 1)
    off = np.abs(here - there).max() / np.abs(there).max()
    took = benchmark(module.get_function("advance"), call, n_repeat=20).gpu_times.min()
    print(
        f"{given.law}, {n} joints of {8 * law.state_size} bytes: traction within {off:.1e} of the "
        f"largest in {STEPS} steps, {1e9 * took / n:.2g} ns per joint and step on "
        f"{cupy.cuda.runtime.getDeviceProperties(0)['name'].decode()}"
    )


if __name__ == "__main__":
    main()
