#!/bin/sh
# Tries the mutations of this folder: applies each to a copy of the source, runs the test that must notice
# it there, and tells whether that failed. Takes about a minute and a half a mutation; without arguments
# all are tried.
#
#     tests/features/mutate.sh [NAME ...]
#
# MUTATE_IN: folder for the copy, kept afterwards. Status 1: a mutation was not noticed, or did not compile.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
if [ -n "${MUTATE_IN:-}" ]; then
    scratch=$MUTATE_IN
    mkdir -p "$scratch"
else
    scratch=$(mktemp -d)
    trap 'rm -rf "$scratch"' EXIT
fi
tar -C "$root" --exclude=./target --exclude=./.git -cf - . | tar -C "$scratch" -xf -
cd "$scratch"
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$scratch/target}"

if [ $# -eq 0 ]; then
    set -- $(ls "$root/tests/features/mutations")
fi
status=0
for name in "$@"; do
    mutation=$root/tests/features/mutations/$name
    value() { sed -n "s/^$1 //p" "$mutation"; }
    test=$(value test)
    file=$(value file)
    # Literally, in the one line where it stands.
    replace=$(value replace) by=$(value by) awk '{
        at = index($0, ENVIRON["replace"])
        if (at) $0 = substr($0, 1, at - 1) ENVIRON["by"] substr($0, at + length(ENVIRON["replace"]))
        print
    }' "$root/$file" > "$file"
    log=$scratch/mutate.log
    if cmp -s "$root/$file" "$file"; then
        outcome="DOES NOT APPLY"
    elif ! cargo test --quiet --test features --no-run > "$log" 2>&1; then
        outcome="DOES NOT COMPILE"
    elif cargo test --quiet --test features "$test" > "$log" 2>&1; then
        outcome="NOT NOTICED"
    else
        # The words after the place of the panic.
        outcome="noticed: $(sed -n '/panicked at/{n;p;q;}' "$log" | cut -c 1-100)"
    fi
    cp "$root/$file" "$file"
    printf '%-30s %-28s %s\n' "$name" "$test" "$outcome"
    case $outcome in noticed*) ;; *) status=1 ;; esac
done
exit $status
