#!/usr/bin/env bash
# Cost of many point lights, to equal error: the physical mirror room with N lights over the whole room, together as
# bright as its one lamp. Needs a quiet machine.
#
#     cargo build --release
#     benches/many-lights.sh [N...] > benches/runs/DATE-many-lights.txt
#
# LAMPS=1: instead, rectangle lamps in the ceiling of the box room of scenes/features/rectangle-light.toml.
# Prints the processor time to a linear RMSE of 0.00068 (adaptive), and processor time times squared error of uniform
# pictures, the mean of SEEDS runs (3), as multiples of the first N. ZERKALO names a program that has been built already.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- 1 4 8 16 24 32 47 64 100 256 1000
zerkalo="${ZERKALO:-target/release/zerkalo}"
rmse=0.00068
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
TIMEFORMAT=%U

# Prints the box room with $1 lamps in its ceiling, of the same power together.
lamps() {
    awk -v n="$1" '
        /^\[\[light\]\]/ && !done {
            done = skip = 1
            columns = n > 1 ? int(sqrt(n - 1)) + 1 : 1
            rows = int((n - 1) / columns) + 1
            for (i = 0; i < n; i++)
                printf "[[light]]\nrectangle = { center = [%.4f, 3.0, %.4f], size = [%.4f, %.4f], normal = [0.0, -1.0, 0.0] }\n" \
                    "intensity = %.6f\nunit = \"power\"\n\n", 3.6 * (i % columns + 0.5) / columns - 1.8,
                    3.6 * (int(i / columns) + 0.5) / rows - 1.8, 2.2 / columns, 2.2 / columns, 24.6 / n
        }
        /^\[materials/ { skip = 0 }
        !skip { print }
    ' scenes/features/rectangle-light.toml
}

# Prints the physical mirror room with $1 lights, in a square of rows at the height of its lamp.
scene() {
    [ -z "${LAMPS:-}" ] || { lamps "$1"; return; }
    awk -v n="$1" '
        /^\[\[light\]\]/ && n > 1 {
            skip = 1
            columns = int(sqrt(n - 1)) + 1
            rows = int((n - 1) / columns) + 1
            for (i = 0; i < n; i++)
                printf "[[light]]\npoint = { position = [%.4f, 4.0, %.4f] }\nintensity = %.6f\nfalloff = \"inverse-square\"\n\n",
                    7 * (i % columns + 0.5) / columns - 3.5, 7 * (int(i / columns) + 0.5) / rows - 3.5, 40 / n
        }
        /^\[materials/ { skip = 0 }
        !skip { print }
    ' scenes/features/mirror-room-physical.toml
}

# Renders $work/room.toml with the given options. Prints processor seconds, samples per pixel and linear RMSE.
run() {
    local seconds
    seconds="$({ time "$zerkalo" render "$work/room.toml" -o "$work/room.png" --stats "$work/stats.json" "$@" \
        > /dev/null 2>&1; } 2>&1 | tail -n 1)"
    awk -v seconds="$seconds" -F '[:,]' '
        /"spp_mean"/ { spp = $2 }
        /"rmse_linear"/ { rmse = $2 }
        END { print seconds, spp, rmse }
    ' "$work/stats.json"
}

echo "$(uname -sr), $(nproc) cores, zerkalo $("$zerkalo" --version | cut -d' ' -f2)"
printf '%6s  %22s  %8s  %12s  %24s\n' lights "seconds to $rmse" times "samples/pixel" "uniform: seconds x error^2"
for n in "$@"; do
    scene "$n" > "$work/room.toml"
    for seed in $(seq "${SEEDS:-3}"); do
        echo "$(run --seed "$seed" --rmse "$rmse") $(run --seed "$seed" --uniform --spp 128)"
    done > "$work/runs.txt"
    awk -v n="$n" -v first="${first:-}" '
        { seconds += $1; spp += $2; cost += $4 * $6 * $6 }
        END {
            if (first == "") first = seconds / NR " " cost / NR
            split(first, one, " ")
            printf "%6d  %22.2f  %8.2f  %12.1f  %24.2f\n",
                n, seconds / NR, seconds / NR / one[1], spp / NR, cost / NR / one[2]
        }
    ' "$work/runs.txt"
    [ -n "${first:-}" ] || first="$(awk '{ a += $1; b += $4 * $6 * $6 } END { print a / NR, b / NR }' "$work/runs.txt")"
done
