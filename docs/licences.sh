#!/usr/bin/env bash
# Prints the licences of all crates that are linked into the program, with the texts in their packages.
# `docs/licences.sh > LICENCES.txt`, from the root of the repository.
set -euo pipefail
sources="${CARGO_HOME:-$HOME/.cargo}/registry/src"
cargo fetch --locked --quiet
cargo tree --locked --package zerkalo --edges normal --prefix none --no-dedupe --format '{p}|{l}' | sort -u |
    while IFS='|' read -r package licence; do
        [[ $package == zerkalo* ]] && continue
        read -r name version _ <<< "$package"
        printf '==== %s %s: %s\n\n' "$name" "${version#v}" "$licence"
        texts=$(find "$sources"/*/"$name-${version#v}" -maxdepth 1 -type f -iregex '.*/\(un\)?\(licen[cs]e\|copying\).*' | sort)
        [ -n "$texts" ] || echo "(The package has no text.)"
        for text in $texts; do cat "$text" && echo; done
    done
printf '==== The font of plots\n\n'
cat src/measure/font/LICENCE.txt
