"""The law in WebAssembly, for `jointlaw browser`: `python builder/wasm.py [FILE]` makes it anew.

After a change of the law's C files or of joint.c, with the extra `docs` installed, whose package
`ziglang` compiles it: the same version gives the same bytes on every machine.
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
    made = sys.argv[1] if len(sys.argv) > 1 else HERE / "joint.wasm"
    sys.exit(subprocess.run([*ZIG, *flags, HERE / "joint.c", "-o", made]).returncode)
