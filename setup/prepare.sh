# Shared by ./rapid and tests/run: installs missing packages, configures, and builds. This file is sourced, with `root`
# set to the checkout. All messages go to standard error.
. "$root/setup/packages.sh"

say() { printf 'rapid: %s\n' "$*" >&2; }

# fail MESSAGE...: exits with status 2, as for every error that is found before a run.
fail() {
    say "$@"
    exit 2
}

# install_missing PACKAGE...
install_missing() {
    command -v dpkg-query apt-get >/dev/null || return 0  # not Debian: CMake will report missing packages
    local package status missing=() install
    local -A installed=()
    while read -r package status; do
        [[ $status != installed ]] || installed[$package]=1
    done < <(dpkg-query -W -f '${Package} ${db:Status-Status}\n' "$@" 2>/dev/null)
    for package in "$@"; do
        [[ ${installed[$package]:-} ]] || missing+=("$package")
    done
    ((${#missing[@]})) || return 0

    local as_root=()
    install="apt-get install --yes --no-install-recommends ${missing[*]}"
    if ((EUID != 0)); then
        if ! command -v sudo >/dev/null; then
            fail "these packages are missing, and installing them needs root; type"$'\n'"    su -c 'apt-get update && $install'"
        fi
        # sudo may ask for a password only on a terminal.
        if [[ ! -t 0 ]] && ! sudo -n true 2>/dev/null; then
            fail "these packages are missing, and sudo needs a password; type"$'\n'"    sudo apt-get update && sudo $install"
        fi
        as_root=(sudo)
    fi
    say "installing ${missing[*]}"
    local log
    log=$(mktemp)
    if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        sh -c "apt-get update && $install" >"$log" 2>&1; then
        cat "$log" >&2
        rm -f "$log"
        fail "apt-get could not install what is missing; after fixing that, type"$'\n'"    ${as_root[*]} $install"
    fi
    rm -f "$log"
}

# build PRESET TARGET...: configures if the presets have changed since the last time, and builds. Returns 1 and shows
# the compiler's output if the build fails.
build() {
    local preset=$1 started=$SECONDS
    shift
    command -v cmake ninja >/dev/null || fail "needs cmake and ninja, and (as Debian names them) ${build_packages[*]}"
    mkdir -p "$root/build/$preset" 2>/dev/null || fail "can't write to $root/build"
    local log=$root/build/$preset/log

    if [[ ! $root/build/$preset/build.ninja -nt $root/CMakePresets.json ]]; then
        say "configuring build/$preset"
        if ! (cd "$root" && cmake --preset "$preset") >"$log" 2>&1; then
            cat "$log" >&2
            say "could not configure build/$preset"
            return 1
        fi
    fi

    # Eight sources with OpenVDB take 2 GB to compile, others half of that.
    local jobs memory
    jobs=$(nproc)
    memory=$(awk '/^MemAvailable/ { print int($2 / 1800000) }' /proc/meminfo)
    ((memory >= jobs)) || jobs=$((memory > 0 ? memory : 1))

    [[ -t 2 ]] || say "building build/$preset"
    if ! NINJA_STATUS='%f/%t ' ninja -C "$root/build/$preset" -j "$jobs" "$@" 2>&1 | show_progress "$preset" >"$log"; then
        cat "$log" >&2
        say "could not build build/$preset"
        return 1
    fi
    ((SECONDS - started < 2)) || say "built build/$preset in $((SECONDS - started)) s"
}

# Passes on everything but ninja's status lines. On a terminal these become one line with a counter.
show_progress() {
    local line
    while IFS= read -r line; do
        if [[ $line =~ ^[0-9]+/[0-9]+\  ]]; then
            [[ ! -t 2 ]] || printf '\r\e[Krapid: building build/%s: %s' "$1" "${line%% *}" >&2
        else
            printf '%s\n' "$line"
        fi
    done
    [[ ! -t 2 ]] || printf '\r\e[K' >&2
}
