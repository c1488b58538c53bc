#!/bin/sh
# Installs Mesa's lavapipe (a Vulkan driver that needs no GPU) where it is missing and apt can be
# used; otherwise says what to install.
set -eu

has_lavapipe() {
    for dir in /usr/share/vulkan/icd.d /etc/vulkan/icd.d /usr/local/share/vulkan/icd.d; do
        ls "$dir"/lvp_icd*.json >/dev/null 2>&1 && return 0
    done
    return 1
}
has_loader() { ldconfig -p 2>/dev/null | grep -q 'libvulkan\.so\.1'; }

PATH="$PATH:/sbin:/usr/sbin"
if has_lavapipe && has_loader; then
    exit 0
fi
packages="mesa-vulkan-drivers libvulkan1"
if ! command -v apt-get >/dev/null 2>&1; then
    echo "lavapipe is missing: install your distribution's Mesa Vulkan drivers (Debian: $packages)" >&2
    exit 2
fi
if [ "$(id -u)" = 0 ]; then
    sudo=""
elif command -v sudo >/dev/null 2>&1; then
    sudo="sudo"
else
    echo "lavapipe is missing and this user may not install it: apt-get install $packages" >&2
    exit 2
fi
echo "installing $packages" >&2
export DEBIAN_FRONTEND=noninteractive
# shellcheck disable=SC2086 # a list of packages, split on purpose
$sudo apt-get install -y -qq $packages >/dev/null 2>&1 || {
    $sudo apt-get update -qq
    $sudo apt-get install -y -qq $packages >/dev/null
}
