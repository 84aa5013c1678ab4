# Sourced by quickstart.sh and tests/run.sh: installs what is missing on Debian 12, as root or through sudo.
# Usage: install_packages NAME...

BILLOW_BUILD_PACKAGES=(
  g++ cmake ninja-build pkg-config
  libopenvdb-dev libtbb-dev libblosc-dev libboost-iostreams-dev
  libzstd-dev libxxhash-dev libdraco-dev libfmt-dev libcli11-dev nlohmann-json3-dev libexpected-dev libhwy-dev
  libvulkan-dev mesa-vulkan-drivers glslang-tools libglm-dev libopenexr-dev libpng-dev libglfw3-dev libimgui-dev
)

install_packages() {
  local missing=()
  local name
  for name in "$@"; do
    dpkg-query -W -f='${Status}' "$name" 2>/dev/null | grep -q 'install ok installed' || missing+=("$name")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  echo "Installing: ${missing[*]}"
  local as_root=()
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}"
}
