#!/usr/bin/env bash
# Latency over a slow connection: `cargo bench --bench link` behind an OpenSSH server, plain and inside
# tmux and screen, through a relay and through a tunnel. Installs missing programs if it may.
set -euo pipefail
cd "$(dirname "$0")/.."
missing=()
[ -x /usr/sbin/sshd ] || missing+=(openssh-server)
command -v ssh >/dev/null || missing+=(openssh-client)
command -v tmux >/dev/null || missing+=(tmux)
command -v screen >/dev/null || missing+=(screen)
if [ ${#missing[@]} -gt 0 ]; then
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null &&
        apt-get install -y --no-install-recommends "${missing[@]}" >/dev/null 2>&1; then
        echo "installed: ${missing[*]}"
    else
        echo "missing and not installed: ${missing[*]}; rows that need them are skipped"
    fi
fi
echo "machine: $(grep -m1 'model name' /proc/cpuinfo | cut -d: -f2 | xargs), $(nproc) cores; $(date +%F)"
echo "connections by rate and round trip; 160x45 cells; from a key to the first change of the picture"
echo "through a relay, which acknowledges the server's bytes at once:"
cargo bench --quiet --bench link -- "$@"
echo "through a relay that buffers 48 KiB, for terminals without replies:"
cargo bench --quiet --bench link -- --buffer "no " "$@"
echo "through a tunnel, so that the client acknowledges them a round trip later (needs root and python3):"
cargo bench --quiet --bench link -- --tunnel "$@"
echo "on a simulated connection, one wave at a time to 1,024 samples per pixel:"
cargo test --release --quiet --test program link:: -- --nocapture --test-threads 1 | grep -E "room|noisy|acting"
