#!/bin/sh
# Tries the mutations of this folder. A copy of the source gets all of them at once, each disabled until the
# environment variable ZERKALO_MUTANT has its name, so that it is compiled once. Then every test that must
# notice a mutation runs with it, and has to fail.
#
#     tests/features/mutate.sh [NAME ...]
#     tests/features/mutate.sh --check      only whether the copy compiles
#
# MUTATE_IN: folder for the copy, kept afterwards. Status 1: a mutation was not noticed.
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
mutations=tests/features/mutations
value() { sed -n "s/^$2 //p" "$mutations/$1"; }

for path in "$mutations"/*; do
    name=${path##*/}
    file=$(value "$name" file)
    # `before «this» after` becomes `before (if mutant { by } else { this }) after`, literally.
    name=$name replace=$(value "$name" replace) by=$(value "$name" by) awk '
        BEGIN {
            split(ENVIRON["replace"], part, "«|»")
            text = part[1] part[2] part[3]
            new = "(if crate::mutant(\"" ENVIRON["name"] "\") { " ENVIRON["by"] " } else { " part[2] " })"
        }
        {
            at = index($0, text)
            if (at) $0 = substr($0, 1, at - 1) part[1] new part[3] substr($0, at + length(text))
            print
        }' "$file" > mutated
    cp mutated "$file"
done
for crate in crates/*/src src; do
    { echo '#![allow(unused_parens)]'; cat "$crate/lib.rs"; } > mutated
    cp mutated "$crate/lib.rs"
done
for crate in crates/scene/src crates/world/src crates/render/src src; do
    echo 'pub use zerkalo_kernel::mutant;' >> "$crate/lib.rs"
done
cat >> crates/kernel/src/lib.rs <<'RUST'

/// Returns `true` if the mutation `name` is enabled.
pub fn mutant(name: &str) -> bool {
    static AWAKE: std::sync::OnceLock<String> = std::sync::OnceLock::new();
    AWAKE.get_or_init(|| std::env::var("ZERKALO_MUTANT").unwrap_or_default()) == name
}
RUST
if [ "${1:-}" = --check ]; then
    cargo check --quiet -p zerkalo-render
    exit
fi
cargo test --release --quiet --test engine --no-run

if [ $# -eq 0 ]; then
    cd "$mutations"
    set -- *
    cd "$scratch"
fi
status=0
for name in "$@"; do
    test=$(value "$name" test)
    # Without the mutation the copy equals the original.
    if ! cargo test --release --quiet --test engine "$test" > before.log 2>&1; then
        outcome="FAILS WITHOUT IT, TOO"
    elif ZERKALO_MUTANT=$name cargo test --release --quiet --test engine "$test" > mutate.log 2>&1; then
        outcome="NOT NOTICED"
    else
        # The message after the location of the panic.
        outcome="noticed: $(sed -n '/panicked at/{n;p;q;}' mutate.log | cut -c 1-110)"
    fi
    printf '%-30s %-28s %s\n' "$name" "$test" "$outcome"
    case $outcome in noticed*) ;; *) status=1 ;; esac
done
exit $status
