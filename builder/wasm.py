"""Rebuild the law in WebAssembly, for `jointlaw browser`: `python builder/wasm.py [FILE]`.

Run it after a change of the C files of the law or of joint.c. It needs the extra `docs`, whose
package `ziglang` is the compiler: the same version produces the same bytes on every machine.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import backend

HERE = backend.ROOT / "jointlaw/hosts/browser"
ZIG = (sys.executable, "-m", "ziglang", "cc", "-target", "wasm32-wasi")
FLAGS = ("-mexec-model=reactor", "-nostartfiles", "-Wl,--strip-all", "-Os")

if any(word.startswith("-") for word in sys.argv[1:]):
    sys.exit(__doc__)
with tempfile.TemporaryDirectory() as headers:
    backend.build.write_headers(Path(headers))
    flags = [*FLAGS, *(flag for flag in backend.build.FLAGS if flag != "-O3"), f"-I{headers}"]
    wasm = sys.argv[1] if len(sys.argv) > 1 else HERE / "joint.wasm"
    sys.exit(subprocess.run([*ZIG, *flags, HERE / "joint.c", "-o", wasm]).returncode)
