#!/usr/bin/env bash
# Wall time and peak memory of `billow compile` at 45 dB against nanovdb_convert --fpN -b on the same frames, in turns
# in one run, medians. Usage: tests/bench/compile_bench.sh BILLOW FILE.vdb... (one sequence)
set -euo pipefail
billow=$1
shift
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
runs=${RUNS:-7}

timed() {  # LOG COMMAND...: appends "seconds kilobytes"
  local log=$1
  shift
  /usr/bin/time -f '%e %M' -a -o "$log" "$@" >/dev/null 2>&1
}
median() { sort -n "$1" | awk '{v[NR]=$1; m=($2>m)?$2:m} END {printf "%.3f %.0f", v[int((NR+1)/2)], m/1024}'; }

for _ in $(seq "$runs"); do
  timed "$work/billow" "$billow" compile "$@" --psnr 45 -o "$work/out.blw"
  timed "$work/nanovdb" nanovdb_convert -f --fpN -b "$@" "$work/out.nvdb"
done
read -r b bm <<<"$(median "$work/billow")"
read -r n nm <<<"$(median "$work/nanovdb")"
printf '%d frames: billow %ss %s MiB, nanovdb_convert --fpN %ss %s MiB, time ratio %.2f; files %d and %d bytes\n' \
  $# "$b" "$bm" "$n" "$nm" "$(awk "BEGIN{print $b/$n}")" "$(stat -c %s "$work/out.blw")" "$(stat -c %s "$work/out.nvdb")"
