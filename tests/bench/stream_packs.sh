#!/bin/bash
# The packs of the stream bench: stream_packs.sh BILLOW DATA OUT. DATA holds the project's larger test data. Writes
# OUT/ember.blw (as `compile` does it), ember_fast.blw (--compress fast), ember_levels.blw (and --levels 2), and
# hundred.blw: 100 frames, all sequences of DATA one after the other and back again.
set -euo pipefail
if [ $# -ne 3 ]; then
  echo "usage: stream_packs.sh BILLOW DATA OUT" >&2
  exit 1
fi
billow=$1 data=$(realpath "$2") out=$3
mkdir -p "$out"
"$billow" compile "$data/ember" -o "$out/ember.blw" > "$out/ember.txt"
"$billow" compile "$data/ember" --compress fast -o "$out/ember_fast.blw" > "$out/ember_fast.txt"
"$billow" compile "$data/ember" --compress fast --levels 2 -o "$out/ember_levels.blw" > "$out/ember_levels.txt"

frames=$(mktemp -d)
trap 'rm -rf "$frames"' EXIT
files=()
for sequence in ember_start ember fire blast dust smoke smoke_vel; do files+=("$data/$sequence"/*.vdb); done
for ((i = 0; i < 100; ++i)); do
  at=$((i % (2 * ${#files[@]})))
  ((at < ${#files[@]})) || at=$((2 * ${#files[@]} - 1 - at))
  ln -s "${files[$at]}" "$frames/all_$(printf %04d "$i").vdb"
done
"$billow" compile "$frames" -o "$out/hundred.blw" > "$out/hundred.txt"
