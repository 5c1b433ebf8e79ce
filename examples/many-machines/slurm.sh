#!/usr/bin/env bash
# Renders a scene by Slurm, from scene to picture: an array job with one worker a task, which lives through all rounds,
# and a job that merges when all tasks have ended.
#
#   examples/many-machines/slurm.sh scene.toml 0.25 64 final.png
#
# Scene and picture are on a file system that all nodes mount. The plan and the parts are beside the picture, as
# final.plan and so on; the same command again continues them, with as many workers as it says. Options of sbatch go into
# SBATCH_OPTIONS, such as "--partition=long --cpus-per-task=32", those of `zerkalo plan` into PLAN_OPTIONS. Prints the
# numbers of both jobs. If the workers could not finish, the merge fails, too, and its log names the missing shards.
set -euo pipefail

[ $# -eq 4 ] || { echo "usage: $0 SCENE NOISE WORKERS OUTPUT" >&2; exit 2; }
scene="$(realpath "$1")" noise="$2" workers="$3" output="$(realpath "$4")"
export ZERKALO="${ZERKALO:-zerkalo}"
here="$(dirname "$(realpath "$0")")"
job="${output%.*}"
read -ra options <<< "${SBATCH_OPTIONS:-}"
read -ra plan_options <<< "${PLAN_OPTIONS:-}"
[ -e "$job.plan" ] || "$ZERKALO" plan "$scene" --noise "$noise" --shards "${SHARDS:-$((8 * workers))}" \
    "${plan_options[@]}" -o "$job.plan" >&2
# Slurm replaces `%` in the names of logs.
log="${job//%/%%}"

array="$(sbatch --parsable "${options[@]}" --array="1-$workers" --output="$log-worker-%a.log" --open-mode=append \
    "$here/worker.sbatch" "$scene" "$job.plan")"
merge="$(sbatch --parsable "${options[@]}" --job-name=merge --dependency="afterany:$array" --output="$log-merge.log" \
    --wrap="$(printf '%q merge %q -o %q' "$ZERKALO" "$job.plan" "$output")")"
echo "workers: $array, merge: $merge"
