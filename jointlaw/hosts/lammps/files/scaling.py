"""Strong and weak scaling of in.slope: python scaling.py [PROCESSORS ...], by default 1 2."""

import re
import subprocess
import sys
from pathlib import Path

processors = [int(word) for word in sys.argv[1:]] or [1, 2]
print("| processors | joints | s per 100 steps | of the ideal |\n|---|---|---|---|")
for kind in ("strong", "weak"):
    first = None
    for n in processors:
        width = 4 * (n if kind == "weak" else max(processors))
        command = ["mpirun", "-np", str(n), "lmp", "-in", "in.slope", "-screen", "none"]
        command += ["-log", "log.scaling", "-var", "s", "0.2", "-var", "steps", "100"]
        subprocess.run([*command, "-var", "width", str(width)], check=True)
        log = Path("log.scaling").read_text()
        seconds = float(re.findall(r"^Loop time of (\S+)", log, re.M)[-1])
        words = re.findall(r"^ +100 .*", log, re.M)[-1].split()
        first = first or seconds
        ideal = first / seconds / (n if kind == "strong" else 1)
        joints = int(float(words[3]) + float(words[4]))
        print(f"| {kind}, {n} | {joints} | {seconds:.2f} | {ideal:.0%} |", flush=True)
