#!/usr/bin/env bash
# End-to-end test of the scripts in examples/many-machines: a scene rendered by GNU parallel and by Slurm, with a worker
# killed (kill -9), all workers and the engine killed between two rounds, a node drained, a node lost and a time limit
# reached on purpose. The pictures must equal one run of the last plan byte by byte.
#
#   apt-get install parallel slurm-wlm munge
#   benches/engines.sh [parallel] [slurm] > benches/runs/DATE-engines.txt
#
# It must run as root, in a container or on a spare machine: it starts munged, slurmctld and four slurmd of its own,
# and ends them. ZERKALO names a program that has been built already. Slurm waits four minutes before it starts tasks again.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- parallel slurm

if [ -z "${ZERKALO:-}" ]; then
    cargo build --release >&2
    ZERKALO="$(cargo metadata --format-version 1 --no-deps | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')/release/zerkalo"
fi
export ZERKALO
scene=scenes/features/glass-solids.toml
noise="${NOISE:-0.25}"
export PLAN_OPTIONS="--size ${SIZE:-400x300}" SHARDS="${SHARDS:-32}"
work="$(mktemp -d)"
daemons=()
cleanup() {
    # Daemons wait for their tasks.
    [ -z "${SLURM_CONF:-}" ] || { scancel --user=root && sleep 10; } 2>/dev/null || true
    pgrep -f "^$ZERKALO work .*$work" | xargs -r kill 2>/dev/null || true
    for pid in "${daemons[@]}"; do kill "$pid" 2>/dev/null || true; done
    wait
    rm -rf "$work"
}
trap cleanup EXIT
start="$SECONDS"
say() { printf '%4d s  %s\n' "$((SECONDS - start))" "$*"; }

# Waits until workers trace parts of the plan $1.
wait_for_part() {
    until compgen -G "$work/$1-*.zk" > /dev/null; do sleep 0.2; done
    sleep 1
}

# Processes of the workers of the job $1.
workers() {
    pgrep -f "^$ZERKALO work .*$work/$1.plan" || { echo "no worker of $1 runs; use a larger SIZE" >&2; return 1; }
}

# Compares the picture of the job $1 with one run of its last plan.
equal() {
    local plan="$work/$1.plan" round=2
    while [ -e "$work/$1.$round.plan" ]; do plan="$work/$1.$round.plan" round=$((round + 1)); done
    "$ZERKALO" render "$scene" --plan "$plan" -o "$work/one.png" 2>/dev/null | sed "s|$work/||g; s/^/        /"
    cmp "$work/one.png" "$work/$1.png" && say "$1.png equals the picture of one run of $(basename "$plan")"
}

echo "$(uname -sr), $(nproc) cores, zerkalo $("$ZERKALO" --version | cut -d' ' -f2)"

# Number of the task that runs on the node $1, as soon as there is one.
task_on() {
    local task=""
    until [ -n "$task" ]; do
        squeue -h | grep -q . || { echo "the job has ended already; use a larger SIZE" >&2; return 1; }
        sleep 0.2
        task="$(squeue -h -t R -w "$1" -o %K)"
    done
    echo "$task"
}

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
    printf '1/:\n1/:\n1/:\n1/:\n' > "$work/hosts"
    say "GNU parallel $(parallel --version | head -n 1 | cut -d' ' -f3): $SHARDS shards, four workers"
    local run=(env "WORK_OPTIONS=--threads 1" examples/many-machines/parallel.sh "$scene" "$noise" "$work/hosts" "$work/job.png")
    setsid "${run[@]}" > "$work/parallel.log" 2>&1 &
    local engine=$!
    wait_for_part job
    say "kill -9 of a worker"
    kill -9 "$(workers job | head -n 1)"
    until [ -e "$work/job.2.plan" ]; do sleep 0.1; done
    say "kill -9 of GNU parallel and of all workers, one of which has planned round 2"
    kill -9 -- "-$engine" 2>/dev/null || true
    { workers job | xargs kill -9; } 2>/dev/null || true
    wait "$engine" 2>/dev/null || true
    say "the same command again"
    "${run[@]}" > "$work/parallel.log" 2>&1 || { cat "$work/parallel.log"; exit 1; }
    grep -h '8-bit levels\|finished' "$work/parallel.log" | sort -u | sed "s|$work/||g; s/^/        /"
    "$ZERKALO" status "$work/job.plan" | sed "s|$work/||; s/^/        /"
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
        for node in 1 2 3 4; do
            echo "NodeName=node$node NodeHostname=$host NodeAddr=127.0.0.1 Port=1700$node CPUs=1 State=UNKNOWN"
        done
        echo "PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP"
    } > "$work/slurm.conf"
    export SLURM_CONF="$work/slurm.conf"
    slurmctld -D > "$work/slurmctld.log" 2>&1 &
    daemons+=($!)
    local slurmd=()
    for node in 1 2 3 4; do
        mkdir -p "$work/spool.node$node"
        slurmd -D -N "node$node" > "$work/slurmd.$node.log" 2>&1 &
        daemons+=($!)
        slurmd+=($!)
    done
    for _ in $(seq 60); do
        [ "$(sinfo -h -t idle -o %D 2>/dev/null || true)" = 4 ] && break
        sleep 1
    done
    say "Slurm $(slurmctld -V | cut -d' ' -f2): $(sinfo -h -o '%D nodes %t')"
    local jobs array victim task
    jobs="$(SBATCH_OPTIONS="--time=2" examples/many-machines/slurm.sh "$scene" "$noise" 4 "$work/slurm.png" 2>/dev/null)"
    say "$jobs, with a time limit of two minutes"
    array="${jobs#workers: }" array="${array%%,*}"

    wait_for_part slurm
    say "kill -9 of a worker"
    kill -9 "$(workers slurm | head -n 1)"

    task="$(task_on node2)"
    say "node2 is drained, and its task (worker $task) put back into the queue"
    scontrol update NodeName=node2 State=DRAIN Reason=maintenance
    scontrol requeue "${array}_$task"

    task="$(task_on node3)"
    # All processes of the node at once: daemon, job step, script, worker.
    say "node3 is lost (slurmd, task and worker $task are killed)"
    local script step
    for victim in $(workers slurm); do
        script="$(ps -o ppid= -p "$victim" | tr -d ' ')"
        step="$(ps -o ppid= -p "$script" | tr -d ' ')"
        grep -q "SLURMD_NODENAME=node3" -z "/proc/$victim/environ" || continue
        kill -9 "${slurmd[2]}" "$step" "$script" "$victim"
    done
    scontrol update NodeName=node3 State=DOWN Reason=lost
    sinfo -h -N -o '        %N %t'
    sleep 5
    say "the maintenance of node2 is over"
    scontrol update NodeName=node2 State=RESUME

    wait_for_jobs
    say "logs of the tasks"
    grep -h 'exit status' "$work"/slurm-worker-*.log | sort | sed 's/^/        /'
    grep -h '8-bit levels\|finished' "$work"/slurm-worker-*.log "$work/slurm-merge.log" | sort -u | sed "s|$work/||g; s/^/        /"
    equal slurm
}

for engine in "$@"; do
    case "$engine" in
        parallel) gnu_parallel ;;
        slurm) slurm ;;
        *) echo "unknown engine $engine" >&2; exit 2 ;;
    esac
done
say "done"
