#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Sets up and runs every test, or only the runners that are named: sh tests/run.sh [native|asan|python|fuzz|blender|ui|style]...
#   sh tests/run.sh --bpy VERSION    runs only the tests of the add-on, in PyPI's bpy of that version, 4.2 or later
# Each runner prints one closing line. Its output is in build/tests/, and is shown if it fails.
set -eu
cd "$(dirname "$0")/.."

if [ "${1-}" = --bpy ]; then
  shift
  exec sh tests/bpy/run.sh "$@"
fi
runners="native asan python fuzz blender ui style"
for name in "$@"; do
  case " $runners " in
  *" $name "*) ;;
  *)
    echo "tests: unknown runner $name (there are: $runners)" >&2
    exit 2
    ;;
  esac
done
[ $# -gt 0 ] || set -- $runners

sh setup.sh --tests
mkdir -p build/tests

native() { in_shards build/release/tests/native/tolvol_tests; }
asan() {
  cmake --preset asan && cmake --build --preset asan && in_shards build/asan/tests/native/tolvol_tests
}
# Most tests use one thread, so each core runs a share of the tests.
in_shards() {
  shards=$(nproc) index=0 running="" result=0
  while [ $index -lt "$shards" ]; do
    GTEST_TOTAL_SHARDS=$shards GTEST_SHARD_INDEX=$index "$1" --gtest_brief=1 &
    running="$running $!" index=$((index + 1))
  done
  for one in $running; do wait "$one" || result=1; done
  return $result
}
python() { /usr/bin/python3 -m pytest -q -p no:cacheprovider -n "$(nproc)" tests/python; }
fuzz() { /usr/bin/python3 tests/fuzz.py --minutes 1 --seed 5; }
# Each core runs a Blender with a share of the test files.
blender() {
  at_once=$(nproc) index=0 running="" result=0
  while [ $index -lt "$at_once" ]; do
    sh tests/blender/run.sh $(ls tests/blender/test_*.py | awk -v n="$at_once" -v i=$index 'NR % n == i') &
    running="$running $!" index=$((index + 1))
  done
  for one in $running; do wait "$one" || result=1; done
  return $result
}
ui() { sh tests/ui/run.sh; }
style() { sh tests/style/run.sh; }

failed=""
for name in "$@"; do
  log=build/tests/$name.log
  started=$(date +%s)
  # Each runner has a shell of its own, so that its failure does not end this shell and all runners run.
  if (set +e; $name) >"$log" 2>&1; then
    outcome=passed
  else
    outcome=FAILED
    failed="$failed $name"
    cat "$log"
  fi
  echo "$name: $outcome in $(($(date +%s) - started)) s: $(grep -v '^[[:space:]]*$' "$log" | tail -n 1)"
done

if [ -n "$failed" ]; then
  echo "tests: failed:$failed"
  exit 1
fi
echo "tests: all passed"
