#!/bin/sh
# Installs what Cargo cannot, where it is missing and apt can be used; otherwise says what to
# install. Always lavapipe (a Vulkan driver that needs no GPU) and a C++ compiler, which the decoder of
# meshopt needs; with `test` also OSMesa, where there is a package of it (the tests that need it are skipped
# without), Python for the independent trace readers, spirv-val, hello_xr with an X server for OpenXR, and Slurm for sweeps on a
# cluster; tests are skipped where the last two cannot be had.
# With `apps` also Chromium, npm and Python, which scripts/apps.sh captures pages with.
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
if ! command -v "${CXX:-c++}" >/dev/null 2>&1; then
    packages="$packages g++"
fi
if [ "${1:-}" = apps ]; then
    for program in chromium npm python3; do
        command -v $program >/dev/null 2>&1 || packages="$packages $program"
    done
fi
wanted="$packages"
if [ "${1:-}" = test ] && ! command -v python3 >/dev/null 2>&1; then
    packages="$packages python3"
fi
# OpenGL on Vulkan, for the tests of `tracegen app --gl`.
if [ "${1:-}" = test ] && ! ls /usr/lib/*/dri/zink_dri.so >/dev/null 2>&1; then
    packages="$packages libegl1 libgl1-mesa-dri"
fi
# Validates the shaders that the layer rewrites.
if [ "${1:-}" = test ] && ! command -v spirv-val >/dev/null 2>&1; then
    packages="$packages spirv-tools"
fi
# Mesa 25.1 dropped it.
if [ "${1:-}" = test ] && ! ldconfig -p 2>/dev/null | grep -q 'libOSMesa\.so\.8' &&
    apt-cache show libosmesa6 >/dev/null 2>&1; then
    packages="$packages libosmesa6"
fi
slurm=""
if [ "${1:-}" = test ] && ! command -v slurmctld >/dev/null 2>&1; then
    slurm=" slurm-wlm munge"
fi
openxr=""
if [ "${1:-}" = test ] && ! command -v hello_xr >/dev/null 2>&1; then
    openxr=" libopenxr-utils xserver-xorg-core xserver-xorg-video-dummy"
fi
packages="$packages$openxr$slurm"
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

# Packages, with options of apt-get; its lists are fetched where they are old.
install() {
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "$@" >/dev/null 2>&1 || {
        $sudo apt-get update -qq &&
            $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "$@" >/dev/null
    }
}

# Slurm, without its daemons: the tests start their own, on the loopback interface, and end them.
install_slurm() {
    policy=/usr/sbin/policy-rc.d
    ours=""
    if [ ! -e "$policy" ]; then
        ours=$policy
        printf '#!/bin/sh\nexit 101\n' | $sudo tee "$policy" >/dev/null
        $sudo chmod 755 "$policy"
    fi
    code=0
    install --no-install-recommends slurm-wlm munge || code=$?
    [ -z "$ours" ] || $sudo rm -f "$ours"
    return "$code"
}

if [ "$packages" != "$openxr$slurm" ]; then
    # shellcheck disable=SC2086 # a list of packages, split on purpose
    install ${packages%"$openxr$slurm"}
fi
# shellcheck disable=SC2086 # as above
if [ -n "$openxr" ] && ! install --no-install-recommends $openxr; then
    echo "cannot install$openxr: the tests of hello_xr will be skipped" >&2
fi
if [ -n "$slurm" ] && ! install_slurm; then
    echo "cannot install$slurm: the tests of sweeps on a cluster will be skipped" >&2
fi
