#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the packages that a Debian 12 machine lacks and builds the release preset into build/release: the module, and the
# zip that Blender installs. A second run does only the steps that are still needed.
#   sh setup.sh           installs and builds for the add-on and the demo
#   sh setup.sh --tests   also installs and builds for the tests
# TOLVOL_PYTHONS="3.11;3.13" builds a module for each of these Pythons, which are given as versions or paths.
set -eu
cd "$(dirname "$0")"

packages="cmake ninja-build cmark-gfm pkg-config g++ python3-dev pybind11-dev python3-numpy python3-matplotlib libopenmesh-dev libglm-dev libcgal-dev libepoxy-dev libgtest-dev
  libegl1 libgl1 libgl1-mesa-dri blender"
targets=extension
tests=""
case "${1-}" in
"") ;;
--tests)
  packages="$packages python3-pytest python3-venv ccache clang-format xvfb xdotool imagemagick"
  targets="all extension"
  tests=1
  ;;
*)
  echo "setup: unknown option $1 (the only one is --tests)" >&2
  exit 2
  ;;
esac

log=build/setup.log
mkdir -p build

# stage NAME COMMAND...: runs a command and prints one line. It prints the command's output only if the command fails.
stage() {
  name=$1
  shift
  started=$(date +%s.%N)
  if "$@" >"$log" 2>&1; then
    echo "$started $(date +%s.%N)" | awk -v name="$name" '{ printf "setup: %s, %.1f s\n", name, $2 - $1 }'
  else
    cat "$log" >&2
    echo "setup: failed: $name" >&2
    exit 1
  fi
}

missing=""
if command -v dpkg-query >/dev/null; then
  for package in $packages; do
    dpkg-query -W -f '${db:Status-Status}\n' "$package" 2>/dev/null | grep -qx installed || missing="$missing $package"
  done
else
  echo "setup: this is not a Debian machine; these packages are needed, by their names in Debian:" $packages
fi

if [ -n "$missing" ]; then
  if [ "$(id -u)" -eq 0 ]; then
    as_root="env"
  elif command -v sudo >/dev/null; then
    as_root="sudo env"
  else
    echo "setup: as root, run: apt-get update && apt-get install --no-install-recommends$missing" >&2
    exit 1
  fi
  echo "setup: installing$missing"
  stage "package lists" $as_root DEBIAN_FRONTEND=noninteractive apt-get -q update
  stage "packages" $as_root DEBIAN_FRONTEND=noninteractive apt-get -q -y install --no-install-recommends $missing
fi

stage "configured" cmake --preset release ${TOLVOL_PYTHONS:+"-DTOLVOL_PYTHONS=$TOLVOL_PYTHONS"}
stage "built in build/release" cmake --build --preset release --target $targets
if [ -n "$tests" ]; then
  stage "packages of the command tolvol in build/command" sh tests/environment.sh command --system-site-packages
  stage "tools that check the style in build/style" sh tests/environment.sh style
fi
