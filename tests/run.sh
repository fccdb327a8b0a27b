#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Sets up and runs every test, or only the runners that are named: sh tests/run.sh [RUNNER]...
# The runners are: native asan tsan python fuzz blender ui style
#   sh tests/run.sh --all            also runs what takes too long for every run
#   sh tests/run.sh --bpy VERSION    runs only the tests of the add-on, in PyPI's bpy of that version, 4.2 or later
# Each runner prints one closing line. The output of each task is in build/tests/, and is shown if the task fails.
set -eu
cd "$(dirname "$0")/.."

if [ "${1-}" = --bpy ]; then
  shift
  exec sh tests/bpy/run.sh "$@"
fi
[ -x /usr/bin/python3 ] || sh setup.sh --tests
exec /usr/bin/python3 -B tests/runners/run.py "$@"
