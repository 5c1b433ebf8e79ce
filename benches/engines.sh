#!/usr/bin/env bash
# End-to-end test of the scripts in examples/many-machines: one plan traced by GNU parallel and by Slurm, with a
# command killed (kill -9), a node drained, a node lost and a time limit reached on purpose. The pictures must equal one run of the plan byte
# by byte.
#
#   apt-get install parallel slurm-wlm munge
#   benches/engines.sh [parallel] [slurm] > benches/runs/DATE-engines.txt
#
# It must run as root, in a container or on a spare machine: it starts munged, slurmctld and three slurmd of its own,
# and ends them. ZERKALO names a program that has been built already. It takes eleven minutes on two cores,
# of which Slurm waits four before it starts tasks again.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- parallel slurm

if [ -z "${ZERKALO:-}" ]; then
    cargo build >&2
    ZERKALO="$(cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')/debug/zerkalo"
fi
export ZERKALO
size="${SIZE:-560x420}"
work="$(mktemp -d)"
daemons=()
cleanup() {
    for pid in "${daemons[@]}"; do kill "$pid" 2>/dev/null || true; done
    wait
    rm -rf "$work"
}
trap cleanup EXIT
start="$SECONDS"
say() { printf '%4d s  %s\n' "$((SECONDS - start))" "$*"; }

# Process of the shard $1 of the plan $2, as soon as it has written a checkpoint.
shard_process() {
    until [ -e "$work/$2-$1.zk" ]; do sleep 0.2; done
    pgrep -f "^$ZERKALO render .*$2.plan --shard $1 " || {
        echo "shard $1 has ended already; use a larger SIZE than $size" >&2
        return 1
    }
}

# plan NAME [SHARDS] [NOISE]
plan() {
    "$ZERKALO" plan scenes/features/glass-solids.toml --size "$size" --noise "${3:-${NOISE:-0.25}}" --pilot 2 --shards "${2:-8}" \
        -o "$work/$1.plan" --base "$work/$1-0.zk"
}

equal() {
    cmp "$work/one.png" "$work/$1.png" && say "$1.png equals the picture of one run"
}

echo "$(uname -sr), $(nproc) cores, zerkalo $("$ZERKALO" --version | cut -d' ' -f2)"
plan one
"$ZERKALO" render scenes/features/glass-solids.toml --plan "$work/one.plan" -o "$work/one.png" 2>/dev/null
say "one run of the plan is done"

wait_for_jobs() {
    while squeue -h -o '%i %T %r' | grep -q .; do
        squeue -h -o '%i %T %r' > "$work/queue"
        if grep -q "DependencyNeverSatisfied" "$work/queue"; then
            cat "$work/queue" "$work"/*.log
            scontrol show job
            exit 1
        fi
        sleep 1
    done
}

gnu_parallel() {
    plan job > /dev/null
    printf '1/:\n1/:\n1/:\n' > "$work/hosts"
    say "GNU parallel $(parallel --version | head -n 1 | cut -d' ' -f3): 8 shards, three at a time"
    RENDER_OPTIONS="--threads 1" examples/many-machines/parallel.sh scenes/features/glass-solids.toml "$work/job.plan" "$work/hosts" "$work/job.png" \
        > "$work/parallel.log" 2>&1 &
    local engine=$! victim
    victim="$(shard_process 2 job)"
    say "kill -9 of shard 2 after its first checkpoint"
    kill -9 "$victim"
    wait "$engine" || { cat "$work/parallel.log"; exit 1; }
    grep -v '^\([0-9.]* % .* left\|$\)' "$work/parallel.log" | sed "s|$work/||g; s/^/        /"
    say "exit statuses (GNU parallel's job log, the last attempt of each shard):"
    awk 'NR > 1 { printf "        shard %s: exit %s, signal %s, %s s\n", $1, $7, $8, $4 }' "$work/job.joblog"
    equal job
}

slurm() {
    local host
    host="$(hostname -s)"
    mkdir -p "$work/munge" "$work/state"
    chmod 755 "$work"
    dd if=/dev/urandom of="$work/munge/key" bs=1024 count=1 2>/dev/null
    chown -R munge: "$work/munge"
    chmod 700 "$work/munge/key" && chmod 755 "$work/munge" && chmod 600 "$work/munge/key"
    setpriv --reuid=munge --regid=munge --clear-groups munged --foreground --key-file="$work/munge/key" \
        --socket="$work/munge/socket" --pid-file="$work/munge/pid" --log-file="$work/munge/log" \
        --seed-file="$work/munge/seed" > "$work/munge.out" 2>&1 &
    daemons+=($!)
    {
        echo "ClusterName=test"
        echo "SlurmctldHost=$host"
        echo "SlurmUser=root"
        echo "AuthType=auth/munge"
        echo "AuthInfo=socket=$work/munge/socket"
        echo "StateSaveLocation=$work/state"
        echo "SlurmdSpoolDir=$work/spool.%n"
        echo "SlurmctldPidFile=$work/slurmctld.pid"
        echo "SlurmdPidFile=$work/slurmd.%n.pid"
        echo "SlurmctldPort=17000"
        echo "ProctrackType=proctrack/linuxproc"
        echo "TaskPlugin=task/none"
        echo "SelectType=select/cons_tres"
        echo "SelectTypeParameters=CR_CPU"
        echo "SlurmdParameters=config_overrides"
        echo "JobRequeue=1"
        echo "KillWait=5"
        echo "ReturnToService=2"
        echo "SlurmdTimeout=15"
        for node in 1 2 3; do
            echo "NodeName=node$node NodeHostname=$host NodeAddr=127.0.0.1 Port=1700$node CPUs=1 State=UNKNOWN"
        done
        echo "PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP"
    } > "$work/slurm.conf"
    export SLURM_CONF="$work/slurm.conf"
    slurmctld -D > "$work/slurmctld.log" 2>&1 &
    daemons+=($!)
    local slurmd=()
    for node in 1 2 3; do
        mkdir -p "$work/spool.node$node"
        slurmd -D -N "node$node" > "$work/slurmd.$node.log" 2>&1 &
        daemons+=($!)
        slurmd+=($!)
    done
    for _ in $(seq 60); do
        [ "$(sinfo -h -t idle -o %D 2>/dev/null || true)" = 3 ] && break
        sleep 1
    done
    say "Slurm $(slurmctld -V | cut -d' ' -f2): $(sinfo -h -o '%D nodes %t')"
    plan slurm > /dev/null
    local jobs array victim shard
    jobs="$(examples/many-machines/slurm.sh scenes/features/glass-solids.toml "$work/slurm.plan" "$work/slurm.png")"
    say "$jobs"
    array="${jobs#shards: }" array="${array%%,*}"

    victim="$(shard_process 1 slurm)"
    say "kill -9 of shard 1 after its first checkpoint"
    kill -9 "$victim"

    shard="$(squeue -h -t R -w node2 -o %K)"
    shard_process "$shard" slurm > /dev/null
    say "node2 is drained, and its task (shard $shard) put back into the queue"
    scontrol update NodeName=node2 State=DRAIN Reason=maintenance
    scontrol requeue "${array}_$shard"
    sinfo -h -N -o '        %N %t'

    shard="$(squeue -h -t R -w node3 -o %K)"
    until [ -n "$shard" ]; do sleep 1; shard="$(squeue -h -t R -w node3 -o %K)"; done
    shard_process "$shard" slurm > /dev/null
    # All processes of the node at once: daemon, job step, script, command.
    say "node3 is lost (slurmd, task and shard $shard are killed)"
    victim="$(shard_process "$shard" slurm)"
    local script step
    script="$(ps -o ppid= -p "$victim" | tr -d ' ')"
    step="$(ps -o ppid= -p "$script" | tr -d ' ')"
    kill -9 "${slurmd[2]}" "$step" "$script" "$victim"
    scontrol update NodeName=node3 State=DOWN Reason=lost
    sinfo -h -N -o '        %N %t'
    sleep 5
    say "the maintenance of node2 is over"
    scontrol update NodeName=node2 State=RESUME

    wait_for_jobs
    say "logs of the tasks"
    for log in "$work"/slurm-[1-8].log "$work/slurm-merge.log"; do
        grep -hv '^\([0-9.]* % .* left\|$\)' "$log" | sed "s|$work/||g; s|^|        $(basename "$log" .log): |"
    done
    equal slurm

    # One shard of some three minutes of processor time. Slurm ends tasks up to a minute after their limit.
    plan limit 1 "${LIMIT_NOISE:-0.12}" > /dev/null
    say "a time limit of two minutes"
    SBATCH_OPTIONS="--time=2" examples/many-machines/slurm.sh scenes/features/glass-solids.toml "$work/limit.plan" "$work/limit.png"
    wait_for_jobs
    grep 'exit status' "$work/limit-1.log" | sed 's/^/        /'
    grep -q 'exit status 143' "$work/limit-1.log" || { echo "the shard was not stopped at its limit" >&2; exit 1; }
    "$ZERKALO" render scenes/features/glass-solids.toml --plan "$work/limit.plan" -o "$work/one.png" 2>/dev/null
    equal limit
}

for engine in "$@"; do
    case "$engine" in
        parallel) gnu_parallel ;;
        slurm) slurm ;;
        *) echo "unknown engine $engine" >&2; exit 2 ;;
    esac
done
say "done"
