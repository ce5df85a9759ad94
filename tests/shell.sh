# For tests written in bash: expect "a true sentence" COMMAND... passes when the command succeeds. To be sourced; the
# script's last line is `finish`, which prints the counts and exits 1 when something failed.
passed=0
failed=0

expect() {
    local sentence=$1 output
    shift
    if output=$("$@" 2>&1); then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        printf 'FAILED: %s\n    %s\n%s\n' "$sentence" "$*" "$output"
    fi
}

finish() {
    printf '%d passed, %d failed, 0 skipped\n' "$passed" "$failed"
    ((failed == 0))
    exit
}
