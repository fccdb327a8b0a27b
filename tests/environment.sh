#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Makes build/NAME, the virtual environment of the tests in tests/NAME with what their requirements.txt lists, unless it is
# there already: sh tests/environment.sh NAME [OPTION OF VENV]...
set -eu
cd "$(dirname "$0")/.."
venv=build/$1
pins=tests/$1/requirements.txt
shift
cmp -s "$pins" "$venv/requirements.txt" && exit 0
rm -rf "$venv"
/usr/bin/python3 -m venv "$@" "$venv"
"$venv/bin/pip" install --quiet --disable-pip-version-check --requirement "$pins"
cp "$pins" "$venv/requirements.txt"
