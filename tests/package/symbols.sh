#!/usr/bin/env bash
# The shared library shows the functions of billow.h, all of them, and nothing else.
# Usage: symbols.sh PREFIX HEADER
set -euo pipefail
prefix=$1 header=$2

seen=$(nm -D --defined-only "$prefix/$LIBDIR/libbillow.so" | awk '$2 != "A" { print $3 }' | sed 's/@.*//' | sort -u)
declared=$(grep -v '^ *\*\|^/\*\|^#' "$header" | grep -A1 '^BILLOW_API' | grep -o '\bbillow[A-Z][A-Za-z]*(' | tr -d '(' | sort -u)
if [ "$seen" != "$declared" ]; then
  echo "exported and declared symbols differ (< exported, > declared):" >&2
  diff <(echo "$seen") <(echo "$declared") >&2
  exit 1
fi
readelf -d "$prefix/$LIBDIR/libbillow.so" | grep -q 'SONAME.*libbillow\.so\.[0-9]*\]'
if readelf -d "$prefix/$LIBDIR/libbillow.so" | grep -q 'libvulkan'; then
  echo "the library links Vulkan" >&2
  exit 1
fi
