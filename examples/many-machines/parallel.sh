#!/usr/bin/env bash
# Renders a plan by GNU parallel on the hosts of a file, one per line (`:` is this machine), and merges the parts.
#
#   zerkalo plan scene.toml --noise 0.25 --shards 8 -o job.plan
#   examples/many-machines/parallel.sh scene.toml job.plan hosts final.png
#
# Scene, plan and parts are on a file system that all hosts mount under the same path. A command that fails, is
# killed, or loses its host is started again on another host, where it continues from its part file. Options of
# `zerkalo render` go into RENDER_OPTIONS, such as "--threads 8".
set -euo pipefail

[ $# -eq 4 ] || { echo "usage: $0 SCENE PLAN HOSTS OUTPUT" >&2; exit 2; }
scene="$(realpath "$1")" plan="$(realpath "$2")" hosts="$3" output="$4"
zerkalo="${ZERKALO:-zerkalo}"
read -ra options <<< "${RENDER_OPTIONS:-}"
parts="${plan%.plan}"
shards="$(sed -n 's/^shards //p' "$plan")"

# Paths are inputs of GNU parallel, which quotes them for the shells of the hosts. `--retries` counts all attempts.
# `--halt soon,fail=1` gives up when a shard has failed that often.
# shellcheck disable=SC1083
parallel --sshloginfile "$hosts" --jobs "${JOBS_PER_HOST:-1}" --retries 5 --halt soon,fail=1 --joblog "$parts.joblog" \
    exec {1} render {2} --plan {3} --shard {4} -o {5}-{4}.zk "${options[@]}" \
    ::: "$zerkalo" ::: "$scene" ::: "$plan" :::: <(seq "$shards") ::: "$parts"

"$zerkalo" merge "$plan" -o "$output"
