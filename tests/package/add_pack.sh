#!/usr/bin/env bash
# billow_add_pack(): a pack is compiled again exactly when what it is made of has changed.
# Usage: add_pack.sh PREFIX SAMPLES BUILD
set -euo pipefail
prefix=$1 samples=$2 build=$3

fail() { echo "add_pack ($generator): $*" >&2; exit 1; }

# Expects that the build compiles these packs and no other.
compiles() {
  local out expected
  out=$(cmake --build "$folder/build") || { echo "$out"; fail "the build fails"; }
  out=$(grep -o 'Pack [a-z]*\.blw' <<<"$out" | sort | tr '\n' ' ' || true)
  expected=$(for pack in "$@"; do echo "Pack $pack.blw"; done | sort | tr '\n' ' ')
  [ "$out" = "$expected" ] || fail "$step: compiled '$out', expected '$expected'"
}

for generator in Ninja "Unix Makefiles"; do
  folder="$build/${generator// /}"
  rm -rf "$folder"
  mkdir -p "$folder/my fire" "$folder/effects"
  cp "$samples"/fire/fire_000[78].vdb "$folder/my fire"
  touch "$folder/my fire/notes.txt" "$folder/elsewhere.txt"
  cp "$samples"/effects/ring_of_fire.effect.json "$samples"/effects/ring.obj "$folder/effects"
  echo '{"effects": ["effects/ring_of_fire.effect.json"]}' >"$folder/scene.json"
  cat >"$folder/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.21)
project(packs LANGUAGES NONE)
find_package(billow REQUIRED)
billow_add_pack(fire SOURCES "my fire/fire_####.vdb" OUTPUT fire.blw ARGS --effort 0 --psnr ${PSNR})
billow_add_pack(scene SOURCES scene.json OUTPUT scene.blw)
END
  configure() { cmake -S "$folder" -B "$folder/build" -G "$generator" -DCMAKE_PREFIX_PATH="$prefix" -DPSNR="$1" >/dev/null; }
  configure 30
  step="the first build" && compiles fire scene
  step="nothing changed" && compiles
  touch "$folder/my fire/notes.txt" "$folder/elsewhere.txt"
  step="an unrelated file changed" && compiles
  touch "$folder/my fire/fire_0008.vdb"
  step="a frame changed" && compiles fire
  touch "$folder/effects/ring.obj"
  step="an effect's mesh changed" && compiles scene
  touch "$folder/scene.json"
  step="a manifest changed" && compiles scene
  cp -p "$samples/fire/fire_0009.vdb" "$folder/my fire"
  step="an older frame came" && compiles fire
  frames=$("$prefix/bin/billow" info "$folder/build/fire.blw" --json |
    python3 -c 'import json, sys; print(len(json.load(sys.stdin)["volumes"][0]["frames"]))')
  [ "$frames" -eq 3 ] || fail "the pack has $frames frames, expected 3"
  # CMake's makefiles never forget an input: without a frame that went they compile in each build.
  if [ "$generator" = Ninja ]; then
    rm "$folder/my fire/fire_0009.vdb"
    step="a frame went" && compiles fire
  fi
  configure 31
  step="an argument changed" && compiles fire
  step="nothing changed after all" && compiles
done
