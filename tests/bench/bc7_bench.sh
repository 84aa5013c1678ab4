#!/usr/bin/env bash
# BC7 alone against bc7e on the same bricks: PSNR per grid, voxels a second on one core. bc7e is the Linux command of the
# npm package @gpu-tex-enc/bc. Usage: tests/bench/bc7_bench.sh BILLOW_BC7_BENCH BC7ENC FOLDER... (a sequence each)
set -euo pipefail
bench=$1
bc7enc=$2
shift 2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$bench" write "$work" "$@"
for level in 1 6; do
  mkdir "$work/bc7e level $level"
  for image in "$work"/*.png; do
    /usr/bin/time -f '%U' -o "$work/seconds" \
      "$bc7enc" -g -q "-u$level" "$image" "$work/bc7e level $level/$(basename "${image%.png}").dds" >/dev/null
    case $image in */cloud256.png) echo "bc7e level $level: $(cat "$work/seconds") s for cloud256, file included" ;; esac
  done
done
"$bench" table "$work" "$@"
