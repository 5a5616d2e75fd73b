#!/bin/sh
# Checks for what this project needs and installs what is missing through the system's package manager.
# Says nothing when all is there.
#
#   scripts/setup.sh [--lint] [--tests] [--python]
#
#   --lint    rustfmt and clippy too, and no Vulkan
#   --python  Python 3 with its modules venv and ensurepip too
#   --tests   the Vulkan validation layers too and, where windows are X11's, its libraries and a display without a screen
#
# SETUP_DRY_RUN=1 prints the commands instead of running them. SETUP_ROOT=DIR looks for files under DIR instead of /,
# and SETUP_MANAGER=NAME takes that package manager: both for trying this script out.
set -eu

root=${SETUP_ROOT:-}
want_lint=no want_vulkan=yes want_tests=no want_python=no
for argument in "$@"; do
    case $argument in
        --lint) want_lint=yes want_vulkan=no ;;
        --tests) want_tests=yes ;;
        --python) want_python=yes ;;
        *) echo "usage: scripts/setup.sh [--lint] [--tests] [--python]" >&2; exit 2 ;;
    esac
done

say() { echo "setup: $*" >&2; }

refuse() { say "$@"; exit 1; }

have() { command -v "$1" >/dev/null 2>&1; }

# --- What is there -------------------------------------------------------------------------------------------------

# A compiler without the C library's start-up files is found but cannot link: only trying tells.
has_linker() {
    have cc || return 1
    scratch=$(mktemp -d)
    echo 'int main(void) { return 0; }' >"$scratch/a.c"
    status=0
    cc -o "$scratch/a" "$scratch/a.c" >/dev/null 2>&1 || status=1
    rm -rf "$scratch"
    return $status
}

# Whether the shared library $1 is where the system's linker looks.
has_library() {
    if [ -z "$root" ]; then
        for ldconfig in ldconfig /sbin/ldconfig /usr/sbin/ldconfig; do
            if have "$ldconfig" && "$ldconfig" -p 2>/dev/null | grep -qF "$1"; then return 0; fi
        done
    fi
    any_file "$root/usr/lib/$1" "$root"/usr/lib/*/"$1" "$root/usr/lib64/$1" "$root/usr/local/lib/$1" && return 0
    in_list "${LD_LIBRARY_PATH:-}" "$1"
}

has_loader() {
    has_library libvulkan.so.1 ||
        any_file "$root"/usr/local/lib/libvulkan.dylib "$root"/opt/homebrew/lib/libvulkan.dylib
}

# Whether one of the arguments (patterns that the shell has expanded, or not) exists.
any_file() {
    for file in "$@"; do
        if [ -e "$file" ]; then return 0; fi
    done
    return 1
}

# Whether a folder of the colon-separated list $1 holds $2; an entry of the list may also be such a file itself.
in_list() {
    rest=$1:
    while [ -n "$rest" ]; do
        entry=${rest%%:*} rest=${rest#*:}
        [ -n "$entry" ] || continue
        # Unquoted, for $2 may be a pattern.
        # shellcheck disable=SC2086
        if [ -f "$entry" ] || any_file "$entry"/$2; then return 0; fi
    done
    return 1
}

# Where Vulkan looks for the manifests of drivers and layers, colon-separated.
manifest_folders() {
    for folder in "$root/etc" "$root/usr/local/etc" "$root/usr/share" "$root/usr/local/share" \
        "$root/opt/homebrew/etc" "$root/opt/homebrew/share" \
        "${HOME:-}/.config" "${HOME:-}/.local/share"; do
        printf '%s/vulkan/%s:' "$folder" "$1"
    done
    [ -z "${XDG_DATA_DIRS:-}" ] || printf '%s:' "$XDG_DATA_DIRS" | sed "s,:,/vulkan/$1:,g"
}

# A GPU that a driver could drive: its device node, also in containers and under WSL.
has_gpu() {
    [ "$(uname -s)" = Darwin ] || any_file "$root"/dev/dri/renderD* "$root"/dev/nvidia[0-9]* "$root"/dev/nvidiactl "$root"/dev/dxg
}

# Mesa's lavapipe runs everywhere. Any other driver counts only where there is a GPU: packages often bring drivers for
# hardware that the machine does not have.
has_driver() {
    chosen=${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}
    if [ -n "$chosen" ]; then
        in_list "$chosen" '*.json' && return 0
        refuse "VK_DRIVER_FILES or VK_ICD_FILENAMES names no driver that exists ($chosen); unset it"
    fi
    in_list "$(manifest_folders icd.d)" '*lvp_icd*.json' && return 0
    has_gpu && in_list "$(manifest_folders icd.d)" '*.json'
}

has_layers() {
    in_list "${VK_LAYER_PATH:-}:${VK_ADD_LAYER_PATH:-}" VkLayer_khronos_validation.json && return 0
    in_list "$(manifest_folders explicit_layer.d)" VkLayer_khronos_validation.json
}

# What a window loads when it opens on X11.
has_xlib() {
    [ "$(uname -s)" = Darwin ] && return 0
    for library in libX11-xcb.so.1 libXcursor.so.1 libXi.so.6 libxkbcommon-x11.so.0; do
        has_library $library || return 1
    done
}

# Tests of the window have a display of their own.
has_display() {
    [ "$(uname -s)" = Darwin ] || have Xvfb
}

# Debian's Python comes without what makes virtual environments.
has_python() { have python3 && python3 -c 'import venv, ensurepip' 2>/dev/null; }

# --- How to get the rest -------------------------------------------------------------------------------------------

manager() {
    if [ -n "${SETUP_MANAGER:-}" ]; then echo "$SETUP_MANAGER"; return; fi
    for candidate in apt-get dnf pacman zypper apk brew; do
        if have $candidate; then echo $candidate; return; fi
    done
    echo none
}

# The packages of manager $1 that provide $2.
packages() {
    case $1:$2 in
        apt-get:linker) echo gcc libc6-dev ;;
        apk:linker) echo gcc musl-dev ;;
        dnf:linker | zypper:linker) echo gcc glibc-devel ;;
        *:linker) echo gcc ;;
        apt-get:loader | zypper:loader) echo libvulkan1 ;;
        pacman:loader) echo vulkan-icd-loader ;;
        *:loader) echo vulkan-loader ;;
        apt-get:driver | dnf:driver) echo mesa-vulkan-drivers ;;
        pacman:driver) echo vulkan-swrast ;;
        zypper:driver) echo libvulkan_lvp ;;
        apk:driver) echo mesa-vulkan-swrast ;;
        brew:driver) echo molten-vk ;;
        apt-get:layers | zypper:layers | brew:layers) echo vulkan-validationlayers ;;
        *:layers) echo vulkan-validation-layers ;;
        apt-get:xlib) echo libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0 ;;
        zypper:xlib) echo libX11-xcb1 libXcursor1 libXi6 libxkbcommon-x11-0 ;;
        dnf:xlib) echo libX11-xcb libXcursor libXi libxkbcommon-x11 ;;
        pacman:xlib | apk:xlib) echo libx11 libxcursor libxi libxkbcommon-x11 ;;
        apt-get:display | apk:display) echo xvfb ;;
        dnf:display | zypper:display) echo xorg-x11-server-Xvfb ;;
        pacman:display) echo xorg-server-xvfb ;;
        brew:xlib | brew:display) ;;
        apt-get:python) echo python3 python3-venv ;;
        dnf:python | zypper:python) echo python3 python3-pip ;;
        pacman:python | brew:python) echo python ;;
        apk:python) echo python3 py3-pip ;;
    esac
}

# One command line that installs the packages $2 with manager $1, to be run as root (except with brew).
install_command() {
    case $1 in
        apt-get)
            echo "apt-get update && DEBIAN_FRONTEND=noninteractive" \
                "apt-get -o DPkg::Lock::Timeout=120 install -y --no-install-recommends $2" ;;
        dnf) echo "dnf install -y $2" ;;
        pacman) echo "pacman -Sy --needed --noconfirm $2" ;;
        zypper) echo "zypper --non-interactive install $2" ;;
        apk) echo "apk add $2" ;;
        brew) echo "brew install $2" ;;
    esac
}

# Runs the command line $1 as root, or prints what to type.
run_as_root() {
    if [ "$(id -u)" = 0 ] || [ "$(manager)" = brew ]; then
        run sh -c "$1"
    elif have sudo && sudo -n true 2>/dev/null; then
        run sudo -n sh -c "$1"
    elif have sudo && [ -t 0 ]; then
        say "installing needs root; sudo may ask for your password"
        run sudo sh -c "$1"
    elif have sudo; then
        refuse "installing needs root. Type:  sudo sh -c '$1'"
    else
        refuse "installing needs root. Type:  su -c '$1'"
    fi
}

run() {
    if [ -n "${SETUP_DRY_RUN:-}" ]; then
        echo "$*"
    else
        # Package managers are talkative; stdout stays free for results.
        "$@" >&2 || refuse "that failed: $*"
    fi
}

# --- Checks --------------------------------------------------------------------------------------------------------

check_rust() {
    if ! have cargo; then
        refuse "Rust is missing. Type:  curl --proto '=https' --tlsv1.2 -sSf https://sh.rustup.rs | sh -s -- -y"
    fi
    needed=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
    found=$(rustc --version | sed 's/^rustc \([0-9]*\.[0-9]*\).*/\1/')
    if [ "${found%%.*}" -lt "${needed%%.*}" ] ||
        { [ "${found%%.*}" = "${needed%%.*}" ] && [ "${found#*.}" -lt "${needed#*.}" ]; }; then
        refuse "Rust $found is too old, $needed is needed. Type:  rustup update stable"
    fi
}

check_components() {
    cargo fmt --version >/dev/null 2>&1 && cargo clippy --version >/dev/null 2>&1 && return 0
    have rustup || refuse "rustfmt or clippy is missing; install both through whatever installed Rust"
    run rustup component add rustfmt clippy
}

# Names what is missing: any of linker, loader, driver, layers, xlib, display, python.
missing() {
    has_linker || echo linker
    if [ "$want_vulkan" = yes ]; then
        has_loader || echo loader
        has_driver || echo driver
    fi
    if [ "$want_vulkan$want_tests" = yesyes ]; then
        has_layers || echo layers
        has_xlib || echo xlib
        has_display || echo display
    fi
    [ "$want_python" = no ] || has_python || echo python
}

cd "$(dirname "$0")/.."
check_rust
[ "$want_lint" = no ] || check_components
lacks=$(missing) || exit 1
[ -n "$lacks" ] || exit 0

case $(uname -s):$lacks in
    Darwin:linker*) refuse "a C linker is missing. Type:  xcode-select --install" ;;
esac
manager=$(manager)
list=
for thing in $lacks; do list="$list $(packages "$manager" "$thing")"; done
# shellcheck disable=SC2086
say "missing:" $lacks
[ "$manager" != none ] ||
    refuse "no package manager that this script knows; install a C linker, the Vulkan loader (libvulkan.so.1)," \
        "a Vulkan driver (Mesa's lavapipe will do) and, for tests, the Khronos validation layer, libX11 and Xvfb"
run_as_root "$(install_command "$manager" "${list# }")"
[ -z "${SETUP_DRY_RUN:-}" ] || exit 0
lacks=$(missing) || exit 1
# shellcheck disable=SC2086
[ -z "$lacks" ] || refuse "still missing after the installation:" $lacks
