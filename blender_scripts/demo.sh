#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Sets up, decimates a mesh within a tolerance and makes a picture: sh blender_scripts/demo.sh [MESH] [--tolerance 1%]
# Without MESH: Blender's monkey, 62,976 triangles with a scanner's noise. Results are in out/.
set -eu

usage() {
  echo "demo: $1; usage: sh blender_scripts/demo.sh [MESH] [--tolerance 1%]" >&2
  exit 2
}

mesh=""
tolerance=1%
while [ $# -gt 0 ]; do
  case $1 in
  --tolerance)
    [ $# -gt 1 ] || usage "--tolerance needs a value"
    tolerance=$2
    shift
    ;;
  --tolerance=*) tolerance=${1#--tolerance=} ;;
  -*) usage "unknown option $1" ;;
  *)
    [ -z "$mesh" ] || usage "one MESH, not also $1"
    mesh=$1
    ;;
  esac
  shift
done
if [ -n "$mesh" ]; then
  [ -f "$mesh" ] || usage "there is no file $mesh"
  mesh=$(realpath "$mesh")
fi

cd "$(dirname "$0")/.."
sh setup.sh
mkdir -p out
log=out/demo.log
trap 'rm -f "$log" out/demo.err' EXIT

# stage NAME SCRIPT ARGUMENT...: runs a script in Blender and prints one line. It prints the script's output only if that fails.
stage() {
  name=$1
  script=$2
  shift 2
  started=$(date +%s.%N)
  status=0
  blender --background --factory-startup --python-exit-code 1 --python "blender_scripts/$script" -- "$@" \
    >"$log" 2>out/demo.err || status=$?
  if [ "$status" -ne 0 ]; then
    # Exit code 2 is a bad argument or file, and one line on stderr names it. After any other code the whole output helps.
    [ "$status" -eq 2 ] || cat "$log" >&2
    cat out/demo.err >&2
    echo "demo: failed: $name" >&2
    exit "$status"
  fi
  echo "$started $(date +%s.%N)" | awk -v name="$name" '{ printf "demo: %s, %.1f s\n", name, $2 - $1 }'
}

if [ -z "$mesh" ]; then
  mesh=out/suzanne.ply
  stage "model $mesh" models.py suzanne "$mesh"
fi
file=$(basename "$mesh")
result=out/${file%.*}_decimated.${file##*.}
stage "decimation to $result" decimate.py "$mesh" "$result" --tolerance "$tolerance" --report out/report.json
sed -n '$!s/, [0-9.]* s$/&/p' "$log" | sed 's/^/demo:   /'
line=$(tail -n 1 "$log")
stage "picture to out/picture.png" comparison_picture.py "$mesh" "$result" out/picture.png --report out/report.json
echo "$line"
