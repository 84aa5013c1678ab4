#!/usr/bin/env bash
# The same input and settings give the same bytes, whatever the build and the thread count.
# Usage: tests/same_bytes.sh BILLOW...   (several builds of the command)
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

compare() {  # NAME INPUT... [OPTION...]
  local name=$1 billow threads
  shift
  for billow in "${builds[@]}"; do
    for threads in 1 2 8; do
      "$billow" compile "$@" --threads "$threads" -o "$work/this.blw" >/dev/null
      if [ ! -e "$work/$name.blw" ]; then
        mv "$work/this.blw" "$work/$name.blw"
      elif ! cmp "$work/$name.blw" "$work/this.blw"; then
        echo "$name: $billow with $threads threads gives other bytes" >&2
        exit 1
      fi
    done
  done
  echo "$name: one pack from ${#builds[@]} builds with 1, 2 and 8 threads"
}

builds=("$@")
compare fire "$root/samples/fire/fire_####.vdb"
compare fire-max-error "$root/samples/fire/fire_####.vdb" --frames 7-8 --max-error 0.001
compare fire-effort "$root/samples/fire/fire_####.vdb" --frames 7 --effort 5
