#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The tests of the add-on and of the commands, by pytest inside Blender: sh tests/blender/run.sh [PYTEST ARGUMENTS]
set -eu
cd "$(dirname "$0")/../.."
exec blender --background --factory-startup --python-exit-code 5 --python tests/blender/run.py -- "$@"
