#!/usr/bin/env bash
# From a bare clone to pictures: installs what is missing, builds, compiles the sample fire, validates and renders it.
# Usage: bash samples/quickstart.sh [OUTPUT-FOLDER]   (default: out)
set -euo pipefail
cd "$(dirname "$0")/.."
source samples/packages.sh
out=${1:-out}

install_packages "${BILLOW_BUILD_PACKAGES[@]}"

echo "== Building"
cmake -S . -B build/quickstart -G Ninja -DCMAKE_BUILD_TYPE=Release -DBILLOW_TESTS=OFF >/dev/null
cmake --build build/quickstart
billow=build/quickstart/bin/billow

mkdir -p "$out"
echo "== Compiling samples/fire to $out/fire.blw"
"$billow" compile 'samples/fire/fire_####.vdb' -o "$out/fire.blw"
echo "== Validating"
"$billow" validate "$out/fire.blw" && echo "$out/fire.blw is sound"
"$billow" info "$out/fire.blw"
echo "== Rendering"
"$billow" render "$out/fire.blw" --frame 7-12 --size 640x360 -o "$out/fire.png"
"$billow" render "$out/fire.blw" --frame 12 --size 640x360 -o "$out/fire.exr"

echo
echo "Done. The pack is $out/fire.blw; the pictures are:"
ls "$out"/fire*.png "$out"/fire*.exr
