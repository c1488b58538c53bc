#!/bin/sh
# Installs what Cargo cannot, where it is missing and apt can be used; otherwise says what to
# install. Always lavapipe (a Vulkan driver that needs no GPU); with `test` also a C++ compiler,
# which the reference implementation of FLIP in the tests needs.
set -eu

has_lavapipe() {
    for dir in /usr/share/vulkan/icd.d /etc/vulkan/icd.d /usr/local/share/vulkan/icd.d; do
        ls "$dir"/lvp_icd*.json >/dev/null 2>&1 && return 0
    done
    return 1
}
has_loader() { ldconfig -p 2>/dev/null | grep -q 'libvulkan\.so\.1'; }

PATH="$PATH:/sbin:/usr/sbin"
packages=""
if ! has_lavapipe || ! has_loader; then
    packages="mesa-vulkan-drivers libvulkan1"
fi
if [ "${1:-}" = test ] && ! command -v "${CXX:-c++}" >/dev/null 2>&1; then
    packages="$packages g++"
fi
[ -n "$packages" ] || exit 0

if ! command -v apt-get >/dev/null 2>&1; then
    echo "missing (by their Debian names): $packages" >&2
    exit 2
fi
if [ "$(id -u)" = 0 ]; then
    sudo=""
elif command -v sudo >/dev/null 2>&1; then
    sudo="sudo"
else
    echo "missing, and this user may not install them: apt-get install $packages" >&2
    exit 2
fi
echo "installing $packages" >&2
export DEBIAN_FRONTEND=noninteractive
# shellcheck disable=SC2086 # a list of packages, split on purpose
$sudo apt-get install -y -qq $packages >/dev/null 2>&1 || {
    $sudo apt-get update -qq
    $sudo apt-get install -y -qq $packages >/dev/null
}
