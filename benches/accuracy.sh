#!/usr/bin/env bash
# Measures what docs/accuracy.md names and puts the tables and drawings there anew. For a quiet machine.
#
#     cargo build --release
#     benches/accuracy.sh [KEY...]      only the blocks with these keys
#
# In docs/accuracy.md a block between `<!-- measured: KEY SCENE OPTIONS -->` and `<!-- end -->` is replaced by what
# `zerkalo measure scenes/SCENE.toml OPTIONS` prints; the drawing goes to docs/images/accuracy-KEY.svg, the numbers to
# benches/runs/DATE-accuracy-KEY.csv.
set -euo pipefail
cd "$(dirname "$0")/.."

page=docs/accuracy.md
day="$(date +%F)"
zerkalo="${ZERKALO:-target/release/zerkalo}"
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT

sed -n 's/^<!-- measured: \(.*\) -->$/\1/p' "$page" > "$scratch/blocks"
while read -r key scene options; do
    if [ $# -gt 0 ] && [[ " $* " != *" $key "* ]]; then
        continue
    fi
    echo "$key: $scene $options" >&2
    # shellcheck disable=SC2086 # Options are words.
    "$zerkalo" measure "scenes/$scene.toml" $options \
        --plot "docs/images/accuracy-$key.svg" --csv "benches/runs/$day-accuracy-$key.csv" \
        > "$scratch/$key.txt" < /dev/null
    awk -v key="$key" -v text="$scratch/$key.txt" '
        /^<!-- measured: / && $3 == key {
            print
            command = $0
            sub(/^<!-- measured: [^ ]+ [^ ]+/, "", command)
            sub(/ -->$/, "", command)
            print "\n    $ zerkalo measure scenes/" $4 ".toml" command "\n"
            while ((getline line < text) > 0) print (line == "" ? "" : "    " line)
            print "\n![Error against time](images/accuracy-" key ".svg)\n"
            inside = 1
            next
        }
        /^<!-- end -->$/ { inside = 0 }
        !inside { print }
    ' "$page" > "$scratch/page"
    cp "$scratch/page" "$page"
done < "$scratch/blocks"
