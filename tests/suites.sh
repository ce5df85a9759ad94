# Test suites for tests/run: each is run, counted and timed, and its output is shown only if it fails. This file is
# sourced, with `root` set to the checkout.
passed=0 failed=0 skipped=0
jobs=$(nproc)
output=$(mktemp)     # output of the current suite
durations=$(mktemp)  # lines "SECONDS s: TEST"
trap 'rm -f "$output" "$durations"' EXIT

# suite NAME COMMAND...: the last line of the command's output has its counts.
suite() {
    local name=$1 started=$SECONDS status=0 counts p f s
    shift
    "$@" >"$output" 2>&1 || status=$?
    counts=$(tail -n 1 "$output")
    if [[ ! $counts =~ ^([0-9]+)\ passed,\ ([0-9]+)\ failed,\ ([0-9]+)\ skipped$ ]]; then
        counts="0 passed, 1 failed, 0 skipped"  # it failed before it could count
        status=1
    fi
    read -r p _ f _ s _ <<<"$counts"
    ((status == 0 || f > 0)) || f=1
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
    ((status == 0)) || cat "$output"
    sed -nE 's/^([0-9]+: )?([0-9]+\.[0-9]{3} s: )/\2/p' "$output" >>"$durations"
    printf '%-22s %5d passed %3d failed %3d skipped %5d s\n' "$name" "$p" "$f" "$s" $((SECONDS - started))
}

# built NAME PRESET TARGET...: a build is timed like a suite, and a failed one counts as a failure.
built() {
    local name=$1 started=$SECONDS status=0
    shift
    build "$@" || status=$?
    failed=$((failed + (status != 0)))
    printf '%-22s %47d s\n' "$name" $((SECONDS - started))
    return "$status"
}

# count_catch STATUS: counts the test cases in the output of ctest, which ended with this status. An executable that
# ended without a summary counts as one failure.
count_catch() {
    awk -v status="$1" '
        /^[0-9]+: All tests passed \(/ { summary[$1 + 0] = 1; for (i = 2; i <= NF; ++i) if ($i == "test") passed += $(i - 1) }
        /^[0-9]+: test cases: / {
            summary[$1 + 0] = 1
            for (i = 2; i <= NF; ++i) { if ($i == "passed") passed += $(i - 1); if ($i == "failed") failed += $(i - 1) }
        }
        /^[ \t]+[0-9]+ - .* \(.*\)$/ { if (!summary[$1 + 0]) ++failed }
        END {
            if (status != 0 && failed == 0) failed = 1
            printf "%d passed, %d failed, 0 skipped\n", passed, failed
        }'
}

# catch_tests PRESET OPTION...: the entries of ctest (tests/CMakeLists.txt) that these options select.
catch_tests() {
    local status=0 said
    said=$(ctest --preset "$1" "${@:2}" --parallel "$jobs" --verbose 2>&1) || status=$?
    printf '%s\n' "$said"
    count_catch "$status" <<<"$said"
    return "$status"
}

# catch_filter FOLDER FILTER: the cases of test_FOLDER that the filter selects; [#test_column] is a file.
catch_filter() {
    local status=0 said
    said=$("build/test/bin/test_$1" --filenames-as-tags --min-duration 0.1 "$2" 2>&1) || status=$?
    printf '%s\n' "$said"
    sed 's/^/1: /' <<<"$said" | count_catch "$status"
    return "$status"
}

# lua_tests BUILD FILE...
lua_tests() { "$1/bin/rapid" test --slowest 30 "${@:2}"; }

# sanitized SUITE PRESET FOLDER...: builds the Catch2 tests of the folders with a sanitizer and assertions, and runs
# them. FOLDER_thorough runs the folder's cases that are tagged [slow].
sanitized() {
    local name=$1 preset=$2
    shift 2
    if built "build/$preset" "$preset" $(printf 'test_%s ' "${@%_thorough}"); then
        suite "$name" catch_tests "$preset" --tests-regex "^($(IFS='|' && echo "$*"))\$"
    fi
}

list_slowest() {
    echo "The slowest tests:"
    sort -rn "$durations" | awk '!seen[$0]++ && ++told <= 30'
}

finish() {
    printf '%d passed, %d failed, %d skipped\n' "$passed" "$failed" "$skipped"
    ((failed == 0))
    exit
}
