# Sourced by tools/demo and tools/check: installs what is missing on a Debian machine with Rust, git, gcc and Python.

repository=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$repository" || exit 1

# What is installed together: the command, and the programs that it starts.
programs=(stepvalve stepvalve-supervisor plant-simulator trajectory-generator step-controller run-recorder valve-bridge)

say() { printf '\n\033[1m== %s\033[0m\n' "$*"; }

# install PACKAGE... : Debian packages that are not there yet.
install() {
    local missing=()
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] && return
    say "installing ${missing[*]}"
    local sudo=()
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null || { echo "as root: apt-get install ${missing[*]}" >&2; exit 1; }
        sudo=(sudo)
    fi
    local log
    log=$(mktemp)
    if ! { "${sudo[@]}" apt-get update && DEBIAN_FRONTEND=noninteractive "${sudo[@]}" apt-get install -y --no-install-recommends "${missing[@]}"; } >"$log" 2>&1; then
        tail -n 20 "$log" >&2
        echo "could not install ${missing[*]}; the whole log is in $log" >&2
        exit 1
    fi
    rm -f "$log"
}

# package_version: the workspace's.
package_version() { sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1; }

# clean_debian FOLDER OPTION... : this machine's Debian with mmdebstrap's options, from this machine's sources.
clean_debian() {
    local folder=$1 codename sources log
    shift
    install mmdebstrap
    codename=$(. /etc/os-release && echo "$VERSION_CODENAME")
    sources=$(ls /etc/apt/sources.list /etc/apt/sources.list.d/*.sources /etc/apt/sources.list.d/*.list 2>/dev/null || true)
    log=$(mktemp)
    # shellcheck disable=SC2086
    mmdebstrap --quiet "$@" "$codename" "$folder" $sources >"$log" 2>&1 || { tail -n 20 "$log" >&2; echo "FAILED: mmdebstrap" >&2; exit 1; }
    rm "$log"
}

require_rust() {
    command -v cargo >/dev/null && return
    [ -f "$HOME/.cargo/env" ] && . "$HOME/.cargo/env"
    command -v cargo >/dev/null || { echo "Rust is missing: install it with rustup" >&2; exit 1; }
}

# python_environment: tools/.venv with what the two lists of Python packages name, and a browser for the pages' tests.
python_environment() {
    local stamp=tools/.venv/installed lists=(tools/requirements.txt tests/browser/requirements.txt) wanted
    install chromium chromium-driver
    wanted=$(cat "${lists[@]}" | sha256sum | cut -d' ' -f1)
    [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$wanted" ] && return
    say "Python packages of ${lists[*]}"
    python3 -c 'import ensurepip, venv' 2>/dev/null || install python3-venv
    rm -rf tools/.venv
    python3 -m venv tools/.venv || exit 1
    tools/.venv/bin/pip install --quiet --disable-pip-version-check "${lists[@]/#/--requirement=}" || exit 1
    echo "$wanted" >"$stamp"
}

# zig_linker: cargo zigbuild, a C compiler and cmake for other machines than this one, as Python packages in target/zig.
zig_linker() {
    local place=$repository/target/zig
    if [ ! -x "$place/bin/cmake" ]; then
        say "a linker for other machines"
        python3 -c 'import ensurepip, venv' 2>/dev/null || install python3-venv
        python3 -m venv "$place"
        "$place/bin/pip" install --quiet --disable-pip-version-check ziglang==0.17.1 cargo-zigbuild==0.24.1 'cmake>=3.26,<5'
    fi
    export PATH="$place/bin:$PATH"
}

# needs_old_glibc FILE... : fails where one needs a glibc newer than 2.17.
needs_old_glibc() {
    local file newest
    for file in "$@"; do
        newest=$(grep -ao 'GLIBC_2\.[0-9]*' "$file" | sort -uV | tail -n 1)
        echo "$file: needs ${newest#GLIBC_} of glibc"
        if [ "$(printf '%s\n' "$newest" GLIBC_2.17 | sort -V | tail -n 1)" != GLIBC_2.17 ]; then
            echo "expected 2.17 or older" >&2
            return 1
        fi
    done
}

# cargo_deny: built into target/tools where none is installed. It runs once, so that little is optimised.
cargo_deny() {
    PATH=$PATH:$repository/target/tools/bin
    command -v cargo-deny >/dev/null && return
    say "building cargo-deny $CARGO_DENY"
    CARGO_INCREMENTAL=0 CARGO_PROFILE_RELEASE_OPT_LEVEL=0 CARGO_PROFILE_RELEASE_LTO=off CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 \
        cargo install --quiet --locked --root target/tools --version "$CARGO_DENY" cargo-deny || exit 1
}
CARGO_DENY=0.20.2
