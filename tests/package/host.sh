#!/usr/bin/env bash
# The sample host, built against the installed package in both ways, plays the sample sequence without a window.
# Usage: host.sh PREFIX SOURCE BUILD
set -euo pipefail
prefix=$1 source=$2 build=$3

play() {  # play PROGRAM PACK: 40 frames, which the validation layer watches
  local out=$build/out.txt
  VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation "$1" "$2" --headless 40 --ppm "$build/picture.ppm" --z-up \
    >"$out" 2>&1 || { cat "$out"; exit 1; }
  cat "$out"
  if grep -qi 'validation\|VUID' "$out"; then exit 1; fi
  local played late
  read -r played late < <(sed -n 's/^played \([0-9]*\) late \([0-9]*\).*/\1 \2/p' "$out")
  [ "$late" -eq 0 ]  # two lines: the first of a && list ends no script
  [ "$played" -ge 30 ]
  # Fire: many different pixels, and bright ones.
  python3 - "$build/picture.ppm" <<'END'
import sys
data = open(sys.argv[1], "rb").read().split(b"\n", 1)[1]
pixels = [data[i:i + 3] for i in range(0, len(data), 3)]
bright = sum(1 for p in pixels if max(p) > 150)
assert len(set(pixels)) > 1000, f"{len(set(pixels))} colours"
assert bright > len(pixels) // 200, f"{bright} bright pixels"
END
}

cmake -S "$source/samples/host" -B "$build/cmake" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release >/dev/null
cmake --build "$build/cmake"
play "$build/cmake/billow_host" "$build/cmake/fire.blw"

export PKG_CONFIG_PATH=$prefix/$LIBDIR/pkgconfig LD_LIBRARY_PATH=$prefix/$LIBDIR
"$CXX" -std=c++20 -Wall -Wextra -Werror "$source/samples/host/host.cpp" -o "$build/host" $(pkg-config --cflags --libs billow) -ldl
play "$build/host" "$build/cmake/fire.blw"
