#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Makes build/command, the virtual environment in which the tests run the command tolvol, unless it is there already.
set -eu
cd "$(dirname "$0")/../.."
venv=build/command
pins=tests/command/requirements.txt
cmp -s "$pins" "$venv/requirements.txt" && exit 0
rm -rf "$venv"
/usr/bin/python3 -m venv --system-site-packages "$venv"
"$venv/bin/pip" install --quiet --disable-pip-version-check --requirement "$pins"
cp "$pins" "$venv/requirements.txt"
