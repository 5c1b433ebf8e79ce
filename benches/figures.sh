#!/usr/bin/env bash
# Prints the figures of docs/accuracy.md and the README: speed, memory, time to equal error.
# Usage: benches/figures.sh [RUNS]   (default 5; medians are printed)
# Needs the release build: cargo build --release
set -euo pipefail
cd "$(dirname "$0")/.."
runs="${1:-5}"
zerkalo="${ZERKALO:-target/release/zerkalo}"
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
physical=scenes/features/mirror-room-physical.toml
room=scenes/mirror-room.toml

# value KEY FILE: a number from a --stats file.
value() { sed -n "s/^ *\"$1\": \([0-9.e+-]*\),\{0,1\}$/\1/p" "$2"; }
median() { sort -g | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }
# sample KEY ARGS...: the median of a figure over the runs.
sample() {
    local key="$1"
    shift
    for _ in $(seq "$runs"); do
        "$zerkalo" render "$@" -o "$scratch/out.png" --stats "$scratch/stats.json" >/dev/null 2>&1
        value "$key" "$scratch/stats.json"
    done | median
}
million() { awk '{ printf "%.1f", $1 / 1e6 }'; }

echo "machine: $(grep -m1 'model name' /proc/cpuinfo | cut -d: -f2 | xargs), $(nproc) cores; $(rustc --version)"
echo "medians of $runs runs"
echo
echo "camera samples per second on one core, physical mirror room, 640x480, uniform (millions):"
for precision in single double; do
    speed="$(sample samples_per_second $physical --uniform --spp 128 --threads 1 --precision $precision | million)"
    echo "  $precision  $speed"
done
echo
echo "two threads against two processes of one thread, samples per second (millions):"
for _ in $(seq "$runs"); do
    "$zerkalo" render $physical --uniform --spp 256 --threads 2 -o "$scratch/a.png" --stats "$scratch/t.json" >/dev/null 2>&1
    "$zerkalo" render $physical --uniform --spp 256 --threads 1 -o "$scratch/a.png" --stats "$scratch/p.json" >/dev/null 2>&1 &
    "$zerkalo" render $physical --uniform --spp 256 --threads 1 -o "$scratch/b.png" --stats "$scratch/q.json" >/dev/null 2>&1
    wait
    echo "$(value samples_per_second "$scratch/t.json") $(value samples_per_second "$scratch/p.json") $(value samples_per_second "$scratch/q.json")"
done | awk '{ printf "  threads %.1f  processes %.1f  ratio %.3f\n", $1 / 1e6, ($2 + $3) / 1e6, $1 / ($2 + $3) }' | sort -k6 -g
echo
echo "seconds to a linear RMSE of 0.00068, physical mirror room, 2 threads:"
echo "  $(sample seconds $physical --rmse 0.00068 --threads 2)"
echo
echo "first picture: one sample per replicate and pixel of 640x480, whole process, seconds:"
echo "  $(sample total_seconds $physical --spp 2)"
echo
echo "peak memory, physical mirror room at 1920x1080 to PNG, bytes:"
echo "  $(sample peak_rss_bytes $physical --size 1920x1080 --spp 32)"
echo
echo "samples and seconds to equal error on the mirror room (linear RMSE 0.001, 2 threads):"
for kind in "sobol adaptive" "sobol uniform" "random adaptive" "random uniform"; do
    read -r sampler order <<<"$kind"
    flags=(--rmse 0.001 --sampler "$sampler" --threads 2)
    [ "$order" = uniform ] && flags+=(--uniform)
    seconds="$(sample seconds $room "${flags[@]}")"
    samples="$(value samples "$scratch/stats.json" | million)"
    printf '  %-7s %-9s %8s million samples %7.2f s\n' "$sampler" "$order" "$samples" "$seconds"
done
