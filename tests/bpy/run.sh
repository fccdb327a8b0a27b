#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs tests/blender in another version of Blender, PyPI's bpy: sh tests/bpy/run.sh VERSION [PYTEST ARGUMENTS]
# The virtual environment is build/bpy/VERSION. Its Python is searched on PATH and in pyenv, unless $PYTHON names one.
set -eu
cd "$(dirname "$0")/../.."

version=${1-}
case "$version" in
4.[2-5] | 5.0) python=3.11 ;;
5.[1-9]) python=3.13 ;;
*)
  echo "bpy: no version \"$version\" (there are: 4.2 to 4.5, 5.0 and later)" >&2
  exit 2
  ;;
esac
shift

found=""
for candidate in ${PYTHON-} "/usr/bin/python$python" "python$python" \
  "${PYENV_ROOT:-$HOME/.pyenv}/versions/$python".*/bin/python3; do
  if "$candidate" -c "import sys, venv; sys.exit('%d.%d' % sys.version_info[:2] != '$python')" 2>/dev/null; then
    found=$candidate
    break
  fi
done
if [ -z "$found" ]; then
  echo "bpy: Blender $version is made for Python $python, which this machine does not have (PYTHON=PATH names one)" >&2
  exit 1
fi

venv=$PWD/build/bpy/$version
if [ ! -e "$venv/bin/blender" ]; then
  rm -rf "$venv"
  "$found" -m venv "$venv"
  "$venv/bin/pip" install --quiet --disable-pip-version-check "bpy==$version.*" pytest==8.3.4 matplotlib==3.10.0
  cat >"$venv/bin/blender" <<EOF
#!/bin/sh
TOLVOL_BPY_BLENDER=\$0 exec "$venv/bin/python" "$PWD/tests/bpy/blender.py" "\$@"
EOF
  chmod +x "$venv/bin/blender"
fi

TOLVOL_PYTHONS="$found" sh setup.sh --tests
# The module of the benchmarks is built only for Debian's Python.
[ $# -gt 0 ] || set -- tests/blender
PATH=$venv/bin:$PATH exec timeout 1800 sh tests/blender/run.sh --ignore=tests/blender/test_comparison.py "$@"
