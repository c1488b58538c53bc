#!/bin/sh
# Installs what Cargo cannot, where it is missing and apt can be used; otherwise says what to
# install. Always lavapipe (a Vulkan driver that needs no GPU); with `test` also a C++ compiler,
# which the reference implementation of FLIP in the tests needs, and Python for the independent
# trace readers, whose tests are skipped where it cannot be had.
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
    packages=" mesa-vulkan-drivers libvulkan1"
fi
if [ "${1:-}" = test ] && ! command -v "${CXX:-c++}" >/dev/null 2>&1; then
    packages="$packages g++"
fi
wanted="$packages"
if [ "${1:-}" = test ] && ! command -v python3 >/dev/null 2>&1; then
    packages="$packages python3"
fi
[ -n "$packages" ] || exit 0

# Fails unless all that is missing can be done without.
give_up() {
    echo "$1: apt-get install$packages" >&2
    [ -z "$wanted" ] || exit 2
    exit 0
}
if ! command -v apt-get >/dev/null 2>&1; then
    give_up "missing (by their Debian names)"
fi
if [ "$(id -u)" = 0 ]; then
    sudo=""
elif command -v sudo >/dev/null 2>&1; then
    sudo="sudo"
else
    give_up "missing, and this user may not install them"
fi
echo "installing$packages" >&2
export DEBIAN_FRONTEND=noninteractive
# shellcheck disable=SC2086 # a list of packages, split on purpose
$sudo apt-get install -y -qq $packages >/dev/null 2>&1 || {
    $sudo apt-get update -qq
    $sudo apt-get install -y -qq $packages >/dev/null
}
