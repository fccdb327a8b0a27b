#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Checks format and lint, builds the Python package by pip, and checks the types of the examples in the documentation. The
# tools are from Debian and from requirements.txt here, as is clang-tidy, which tests/runners/clang_tidy.py runs.
set -eu
cd "$(dirname "$0")/../.."

venv=build/style
sh tests/environment.sh style

failed=""

# check NAME: runs the function of that name. All checks run, even if one of them fails.
check() {
  if (set +e; "$1"); then
    echo "$1: ok"
  else
    echo "$1: FAILED"
    failed="$failed $1"
  fi
}

licence() {
  # The licence is in one of the first two lines, because the first line of a script is its #!.
  without=$(find . \( -path ./build -o -path ./out -o -path ./.git \) -prune -o -type f \( -name '*.h' -o -name '*.hh' -o \
    -name '*.cpp' -o -name '*.py' -o -name '*.sh' -o -name 'CMakeLists.txt' -o -name '*.toml' -o -path './.ci/*' \) -print0 |
    xargs -0 awk 'FNR <= 2 && /SPDX-License-Identifier: GPL-3.0-or-later/ { found[FILENAME] = 1 }
      END { for (i = 1; i < ARGC; ++i) if (!(ARGV[i] in found)) print ARGV[i] }')
  [ -z "$without" ] || { echo "no licence line in: $without" && return 1; }
}

rooms() {
  # The files of each room in native/ may include only headers of the rooms listed here. The linker does not find all
  # violations: a program that links two rooms also links a forbidden call from one to the other.
  crossing=$(while read -r room others; do
    grep -rnE '#include "[a-z]+/' "native/$room" |
      grep -vE "#include \"($(echo "$room $others" | tr ' ' '|'))/"
  done <<EOF
base
geometry base
gl base
field base geometry gl
check base geometry gl field
topology base geometry
decimation base geometry field check topology
motion base geometry field check topology
repair base geometry field check topology
measure base geometry
picture base geometry gl field
openmesh base geometry field check
python base geometry gl field check topology decimation motion repair measure picture
EOF
  )
  # The refinement looks at all of the decimation, of which only decimation.cpp enters it.
  crossing="$crossing$(grep -rnE '#include "decimation/refinement/' native |
    grep -vE '^native/decimation/(refinement/|decimation\.cpp)')"
  # What the add-on shares with the command knows neither Blender nor the rest of the add-on, and the package not the add-on.
  crossing="$crossing$(grep -rnE '^ *(import|from) +(bpy|bmesh|mathutils|addon)|^ *from \.\.\.' addon/shared native/python/tolvol |
    grep -vE 'from \.\.\.shared')"
  [ -z "$crossing" ] || { echo "these may not be included here:" && echo "$crossing" && return 1; }
}

clang_format() {
  find native benchmark examples tests \( -name '*.h' -o -name '*.hh' -o -name '*.cpp' \) -print0 |
    xargs -0 clang-format --dry-run -Werror
}

ruff() {
  "$venv/bin/ruff" check . && "$venv/bin/ruff" format --check .
}

pip_install() {
  # By the name of the compiler ccache knows what the release preset has compiled.
  CXX=c++ "$venv/bin/pip" install --quiet --disable-pip-version-check --no-build-isolation --check-build-dependencies \
    --no-deps --force-reinstall . &&
    PYTHONPATH=tests/python "$venv/bin/python" -c '
import sys, meshes, tolvol
assert tolvol.__file__.startswith(sys.prefix), tolvol.__file__
vertices, triangles = meshes.torus()
result = tolvol.decimate(vertices, triangles, tolvol.ToleranceVolume(vertices, triangles, 0.03))
assert len(result.triangles) < 1000
from pathlib import Path
from tolvol.command import plain_formats
from tolvol.command.mesh import Mesh
plain_formats.write(Path("build/style/torus.ply"), Mesh("torus", vertices, triangles))
' &&
    # A .ply file needs no other package than NumPy.
    "$venv/bin/tolvol" decimate build/style/torus.ply build/style/small.ply --tolerance 1% >/dev/null &&
    "$venv/bin/tolvol" check build/style/small.ply build/style/torus.ply --tolerance 1%
}

types() {
  # The installed package brings its types along, so that a missing file of it is found here too.
  rm -rf build/examples
  "$venv/bin/python" tests/style/examples.py build/examples &&
    "$venv/bin/mypy" --strict --cache-dir build/mypy --module tolvol &&
    "$venv/bin/mypy" --strict --cache-dir build/mypy build/examples/*.py
}

check licence
check rooms
check clang_format
check ruff
check pip_install
check types

[ -z "$failed" ] || { echo "style: failed:$failed" && exit 1; }
echo "style: licence lines, rooms, clang-format, ruff, pip install and types are in order"
