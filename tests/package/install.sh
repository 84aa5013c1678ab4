#!/usr/bin/env bash
# Installs the build and moves it to where it was not meant to be.
# Usage: install.sh CMAKE BUILD PREFIX
set -euo pipefail
cmake=$1 build=$2 prefix=$3

rm -rf "$prefix" "$build/package/staged"
"$cmake" --install "$build" --prefix "$build/package/staged" >/dev/null
mv "$build/package/staged" "$prefix"
# Nothing of the C++ core is installed, and no file says where it was built.
if find "$prefix/include" -path '*runtime*' -o -path '*format*' | grep .; then
  echo "headers of the core are installed" >&2
  exit 1
fi
if grep -rIl "$build" "$prefix"; then
  echo "these name the build folder" >&2
  exit 1
fi
