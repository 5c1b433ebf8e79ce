#!/usr/bin/env bash
# Measures the blocks of the newest benches/runs/*-accuracy.md and replaces its tables and plots. Needs a quiet machine.
#
#     cargo build --release
#     benches/accuracy.sh [KEY...]      only the blocks with these keys
#
# A block between `<!-- measured: KEY SCENE OPTIONS -->` and `<!-- end -->` is replaced by the output of
# `zerkalo measure scenes/features/SCENE.toml OPTIONS`; the plot goes to docs/images/accuracy-KEY.svg. The block
# `<!-- extremes -->` of docs/accuracy.md (its key is `extremes`) is replaced by the results that the tests of extremes
# print; it does not need a quiet machine.
set -euo pipefail
cd "$(dirname "$0")/.."

runs=(benches/runs/*-accuracy.md)
page="${runs[-1]}"
zerkalo="${ZERKALO:-target/release/zerkalo}"
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT

# Replaces the block whose first line is in file $1 by the text of file $2.
replace() {
    awk -v begin="$(cat "$1")" -v text="$2" '
        $0 == begin {
            print
            while ((getline line < text) > 0) print line
            inside = 1
            next
        }
        /^<!-- end -->$/ { inside = 0 }
        !inside { print }
    ' "$page" > "$scratch/page"
    cp "$scratch/page" "$page"
}

wanted() {
    local key="$1"
    shift
    [ $# -eq 0 ] || [[ " $* " == *" $key "* ]]
}

sed -n 's/^<!-- measured: \(.*\) -->$/\1/p' "$page" > "$scratch/blocks"
while read -r key scene options; do
    wanted "$key" "$@" || continue
    echo "$key: $scene $options" >&2
    # shellcheck disable=SC2086 # Options are words.
    "$zerkalo" measure "scenes/features/$scene.toml" $options \
        --plot "docs/images/accuracy-$key.svg" > "$scratch/$key.txt" < /dev/null
    {
        printf '\n    $ zerkalo measure scenes/features/%s.toml%s\n\n' "$scene" "${options:+ $options}"
        sed 's/^\(.\)/    \1/' "$scratch/$key.txt"
        printf '\n![Error against time](../../docs/images/accuracy-%s.svg)\n\n' "$key"
    } > "$scratch/$key.md"
    echo "<!-- measured: $key $scene${options:+ $options} -->" > "$scratch/begin"
    replace "$scratch/begin" "$scratch/$key.md"
done < "$scratch/blocks"

if wanted extremes "$@"; then
    echo "extremes: the tests" >&2
    cargo test --release --test scene --test world --test render --test application --test engine \
        -- --nocapture extreme all_thirty < /dev/null > "$scratch/tests.txt"
    grep -o 'extreme [0-9][0-9] | .*' "$scratch/tests.txt" | LC_ALL=C sort -u > "$scratch/cells.txt"
    awk -F ' [|] ' '
        function add(column, words) {
            cell[n, column] = cell[n, column] (cell[n, column] == "" ? "" : "; ") words
        }
        {
            n = substr($1, 9) + 0
            if ($2 == "both") { add("single", $3); add("double", $3) } else add($2, $3)
        }
        END {
            print "\n| # | case | criterion | single | double | `auto` chooses |"
            print "|---|---|---|---|---|---|"
            for (n = 1; n <= 30; n++)
                printf "| %d | %s | %s | %s | %s | %s |\n", n, cell[n, "about"], cell[n, "criterion"], \
                    cell[n, "single"], cell[n, "double"], cell[n, "auto"]
            print ""
        }
    ' "$scratch/cells.txt" > "$scratch/extremes.md"
    echo "<!-- extremes -->" > "$scratch/begin"
    page=docs/accuracy.md
    replace "$scratch/begin" "$scratch/extremes.md"
fi
