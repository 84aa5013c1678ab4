#!/usr/bin/env bash
# The installed headers as C99 and C++20, warnings as errors; the program names every function, found by pkg-config and
# linked with the shared library and with the archive.
# Usage: headers.sh PREFIX SOURCES BUILD
set -euo pipefail
prefix=$1 sources=$2 build=$3

export PKG_CONFIG_PATH=$prefix/$LIBDIR/pkgconfig LD_LIBRARY_PATH=$prefix/$LIBDIR
mkdir -p "$build"
strict=(-pedantic -Wall -Wextra -Wconversion -Wshadow -Werror)
shared=($(pkg-config --cflags --libs billow))
static=($(pkg-config --static --cflags --libs billow | sed 's/-lbillow/-l:libbillow.a/'))
for link in shared static; do
  declare -n flags=$link
  cc -std=c99 "${strict[@]}" "$sources/every_function.c" -o "$build/c-$link" "${flags[@]}"
  "$CXX" -std=c++20 "${strict[@]}" "$sources/every_function.cpp" -o "$build/cpp-$link" "${flags[@]}"
  "$build/c-$link"
  "$build/cpp-$link"
done
# Each function is named once.
named=$(grep -o '(Function)billow[A-Za-z]*' "$sources/every_function.c" | sed 's/(Function)//' | sort)
exported=$(nm -D --defined-only "$prefix/$LIBDIR/libbillow.so" | awk '$2 == "T" { print $3 }' | sed 's/@.*//' | sort)
diff <(echo "$named") <(echo "$exported")
