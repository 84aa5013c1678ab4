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
echo "== Compiling samples/effects to $out/effects.blw"
"$billow" compile samples/effects/*.effect.json -o "$out/effects.blw"
echo "== Validating"
"$billow" validate "$out/fire.blw" && echo "$out/fire.blw is sound"
"$billow" validate "$out/effects.blw" && echo "$out/effects.blw is sound"
"$billow" info "$out/fire.blw"
echo "== Rendering"
"$billow" render "$out/fire.blw" --frame 7-12 --size 640x360 -o "$out/fire.png"
"$billow" render "$out/fire.blw" --frame 12 --size 640x360 -o "$out/fire.exr"
# Beside its packs, so that it draws them wherever they are.
sed "s|../../out/||" samples/scenes/campfire.scene.json > "$out/campfire.scene.json"
"$billow" render "$out/campfire.scene.json" --frame 5 -o "$out/campfire.png"

echo
echo "Done. The packs are $out/fire.blw and $out/effects.blw; the pictures are:"
ls "$out"/*.png "$out"/*.exr
