#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Tests the add-on in a real Blender window on a virtual screen, by mouse and keyboard: sh tests/ui/run.sh [TEST NAME]...
# `--share 1/2` and `--share 2/2` run a half each and can run side by side.
# Screenshots and Blender's output go to build/ui/, and those of a second share to build/ui_2/.
set -eu
cd "$(dirname "$0")/../.."
out=build/ui
case "$*" in
  --share\ 1/*) ;;
  --share*) share=${2%/*}; out=build/ui_$share ;;
esac
export TOLVOL_UI_OUT="$out"
mkdir -p "$out"
rm -f "$out"/*.png "$out/display"

# Xvfb chooses a free display and tells its number.
Xvfb -displayfd 3 -screen 0 1280x1024x24 +extension GLX 3>"$out/display" 2>"$out/xvfb.log" &
server=$!
trap 'kill $server 2>/dev/null || true' EXIT INT TERM
tries=0
while [ ! -s "$out/display" ]; do
  tries=$((tries + 1))
  [ $tries -lt 100 ] || { echo "1 failed: Xvfb does not start (see $out/xvfb.log)"; exit 1; }
  sleep 0.1
done

code=0
DISPLAY=":$(cat "$out/display")" LIBGL_ALWAYS_SOFTWARE=1 timeout 3000 \
  blender --factory-startup --window-geometry 0 278 720 746 --python-exit-code 5 --python tests/ui/run.py -- "$@" \
  >"$out/blender.log" 2>&1 || code=$?
# An exception in the draw function of a panel appears only in Blender's output.
if grep -q Traceback "$out/blender.log"; then
  [ "$code" -ne 0 ] || code=1
fi
[ "$code" -eq 0 ] || grep -vE "^(Info:.*)?\$" "$out/blender.log"
[ "$code" -ne 124 ] || echo "1 failed: timed out"
grep -E '^[0-9]+ (passed|failed)' "$out/blender.log" || true
exit "$code"
