#!/usr/bin/env bash
# Renders a scene by GNU parallel on the hosts of a file, one per line (`:` is this machine), from scene to picture.
#
#   examples/many-machines/parallel.sh scene.toml 0.25 hosts final.png
#
# Scene and picture are on a file system that all hosts mount under the same path. The plan and the parts are beside the
# picture, as final.plan and so on; the same command again continues them. Each host runs a worker, which lives through
# all rounds. A worker that fails, is killed, or loses its host is started again on another host. Number of shards: SHARDS.
# Options of `zerkalo plan` go into PLAN_OPTIONS, those of `zerkalo work` into WORK_OPTIONS, such as "--threads 8".
set -euo pipefail

[ $# -eq 4 ] || { echo "usage: $0 SCENE NOISE HOSTS OUTPUT" >&2; exit 2; }
scene="$(realpath "$1")" noise="$2" hosts="$3" output="$(realpath "$4")"
zerkalo="${ZERKALO:-zerkalo}"
read -ra plan_options <<< "${PLAN_OPTIONS:-}"
read -ra work_options <<< "${WORK_OPTIONS:-}"
job="${output%.*}"
workers="$(grep -c . "$hosts")"
[ -e "$job.plan" ] || "$zerkalo" plan "$scene" --noise "$noise" --shards "${SHARDS:-$((8 * workers))}" \
    "${plan_options[@]}" -o "$job.plan"

# Paths are inputs of GNU parallel, which quotes them for the shells of the hosts. `--retries` counts all attempts.
# Other workers trace the shards of one that has failed that often.
# shellcheck disable=SC1083
parallel --sshloginfile "$hosts" --jobs "${JOBS_PER_HOST:-1}" --retries 5 --joblog "$job.joblog" \
    exec {1} work {2} {3} "${work_options[@]}" \
    ::: "$zerkalo" ::: "$scene" ::: "$job.plan" :::: <(seq "$((workers * ${JOBS_PER_HOST:-1}))") || true

"$zerkalo" merge "$job.plan" -o "$output"
