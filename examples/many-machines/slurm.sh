#!/usr/bin/env bash
# Renders a plan by Slurm: an array job with one task a shard, and a job that merges when all tasks are done.
#
#   zerkalo plan scene.toml --noise 0.25 --shards 64 -o job.plan
#   examples/many-machines/slurm.sh scene.toml job.plan final.png
#
# Scene, plan and parts are on a file system that all nodes mount. Options of sbatch go into SBATCH_OPTIONS, such as
# "--partition=long --cpus-per-task=32". Prints the numbers of both jobs.
set -euo pipefail

[ $# -eq 3 ] || { echo "usage: $0 SCENE PLAN OUTPUT" >&2; exit 2; }
scene="$(realpath "$1")" plan="$(realpath "$2")" output="$(realpath "$3")"
export ZERKALO="${ZERKALO:-zerkalo}"
here="$(dirname "$(realpath "$0")")"
parts="${plan%.plan}"
shards="$(sed -n 's/^shards //p' "$plan")"
read -ra options <<< "${SBATCH_OPTIONS:-}"

array="$(sbatch --parsable "${options[@]}" --array="1-$shards" --output="$parts-%a.log" --open-mode=append \
    "$here/shard.sbatch" "$scene" "$plan" "$parts")"
merge="$(sbatch --parsable "${options[@]}" --dependency="afterok:$array" --output="$parts-merge.log" \
    --job-name=merge --wrap "\"$ZERKALO\" merge \"$parts\"-*.zk -o \"$output\"")"
echo "shards: $array, merge: $merge"
