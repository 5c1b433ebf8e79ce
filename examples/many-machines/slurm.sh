#!/usr/bin/env bash
# Renders a plan by Slurm: an array job with one task a shard, and a job that merges when all tasks have ended.
#
#   zerkalo plan scene.toml --noise 0.25 --shards 64 -o job.plan
#   examples/many-machines/slurm.sh scene.toml job.plan final.png
#
# Scene, plan and parts are on a file system that all nodes mount. Options of sbatch go into SBATCH_OPTIONS, such as
# "--partition=long --cpus-per-task=32". Prints the numbers of both jobs. If tasks have failed, the merge fails, too, and
# its log names the missing shards.
set -euo pipefail

[ $# -eq 3 ] || { echo "usage: $0 SCENE PLAN OUTPUT" >&2; exit 2; }
scene="$(realpath "$1")" plan="$(realpath "$2")" output="$(realpath "$3")"
export ZERKALO="${ZERKALO:-zerkalo}"
here="$(dirname "$(realpath "$0")")"
parts="${plan%.plan}"
shards="$(sed -n 's/^shards //p' "$plan")"
read -ra options <<< "${SBATCH_OPTIONS:-}"
# Slurm replaces `%` in the names of logs.
log="${parts//%/%%}"

array="$(sbatch --parsable "${options[@]}" --array="1-$shards" --output="$log-%a.log" --open-mode=append \
    "$here/shard.sbatch" "$scene" "$plan" "$parts")"
merge="$(sbatch --parsable "${options[@]}" --dependency="afterany:$array" --output="$log-merge.log" \
    "$here/merge.sbatch" "$plan" "$output")"
echo "shards: $array, merge: $merge"
