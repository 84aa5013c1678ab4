#!/usr/bin/env bash
# Builds and passes every test: release, then ASan+UBSan, then the same pack bytes from another compiler and build type.
# Usage: bash tests/run.sh [--quick]   (--quick: the release build and its tests only)
set -euo pipefail
cd "$(dirname "$0")/.."
source samples/packages.sh

install_packages "${BILLOW_BUILD_PACKAGES[@]}" libgtest-dev libbenchmark-dev vulkan-validationlayers ccache \
  clang clang-format libclang-rt-14-dev python3-jsonschema chromium xvfb xdotool

export CMAKE_CXX_COMPILER_LAUNCHER=ccache
export UBSAN_OPTIONS=print_stacktrace=1
# Leaks inside the OpenVDB, TBB and Vulkan driver libraries are not ours to report.
export LSAN_OPTIONS=suppressions=$PWD/tests/leaks.supp:print_suppressions=0

step() { printf '\n== %s (%s)\n' "$1" "$(date +%T)"; }
test_preset() { ctest --preset "$1" -j "$(nproc)" "${@:2}"; }

step "Formatting"
git ls-files '*.cpp' '*.h' '*.hpp' | xargs clang-format --dry-run -Werror

step "Release build"
cmake --preset release >/dev/null
cmake --build --preset release
step "Release tests"
test_preset release
[ "${1:-}" = "--quick" ] && exit 0

step "Each part alone"
for part in format compiler runtime; do
  cmake -S . -B "build/alone-$part" -G Ninja -DCMAKE_BUILD_TYPE=Release -DBILLOW_TESTS=OFF -DBILLOW_COMMAND=OFF \
    -DBILLOW_COMPILER="$([ $part = compiler ] && echo ON || echo OFF)" \
    -DBILLOW_RUNTIME="$([ $part = runtime ] && echo ON || echo OFF)" >/dev/null
  cmake --build "build/alone-$part"
done

step "ASan and UBSan build"
cmake --preset asan >/dev/null
cmake --build --preset asan
step "ASan and UBSan tests"
test_preset asan

step "The same bytes from clang, debug"
cmake -S . -B build/clang -G Ninja -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_COMPILER=clang++ -DBILLOW_TESTS=OFF \
  -DBILLOW_RUNTIME=OFF >/dev/null
cmake --build build/clang
bash tests/same_bytes.sh build/release/bin/billow build/clang/bin/billow build/asan/bin/billow

step "Done: every test passed"
