#!/usr/bin/env python3
"""Kills of renders, shards, merges and dashboards: all signals, once or several times within half a second, by
`kill`, GNU timeout or GNU parallel, some while the disk is full. Nothing may be lost or torn, no temporary file
may stay, and the bytes of the picture after resuming must be those of a run without kills.

    cargo build --release && benches/kills.py 200 > benches/runs/DATE-kills.txt

The argument is the number of kills. ZERKALO names another build. As root, the folder is a file system of its
own, which is filled while some processes are killed. Slurm: `benches/engines.sh slurm`.
"""
import os
import pty
import random
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
ZERKALO = os.path.abspath(os.environ.get("ZERKALO", f"{ROOT}/target/release/zerkalo"))
SIGNALS = ["TERM", "HUP", "INT", "QUIT", "USR1", "XCPU"]
SIZE = ["--size", "480x360", "--threads", "1"]
SPACE = 100 << 20
KINDS = ["render", "shard", "render", "shard", "dashboard", "merge"]

numbers = random.Random(39)
folder = tempfile.mkdtemp(prefix="zerkalo-kills-")
has_disk = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={SPACE}", "none", folder], stderr=subprocess.DEVNULL).returncode == 0
os.chdir(folder)
# Edits that do not fit on the full disk are kept here.
state = os.environ["XDG_STATE_HOME"] = tempfile.mkdtemp(prefix="zerkalo-state-")
shutil.copy(f"{ROOT}/scenes/mirror-room.toml", "room.toml")
counts = {"kills": 0, "repeated": 0, "full disk": 0, "timeout": 0, "parallel": 0, "faults": 0}


def quietly(command):
    return subprocess.run(command, check=True, capture_output=True, text=True)


def command(kind, name):
    if kind == "render":
        files = ["-o", f"{name}.png", "--checkpoint", f"{name}.zk", "--resume", f"{name}.zk"]
        return [ZERKALO, "render", "room.toml", *files, "--noise", "0.25", "--checkpoint-interval", "0.3", *SIZE]
    if kind == "shard":
        return [ZERKALO, "render", "room.toml", "--plan", last_plan, "--shard", "1", "-o", f"{name}.zk", "--threads", "1"]
    return [ZERKALO, "merge", "job.plan", "-o", f"{name}.png"]


def result(kind, name):
    return f"{name}.zk" if kind == "shard" else f"{name}.png"


def content(path):
    with open(path, "rb") as file:
        return file.read()


def fault(number, what):
    counts["faults"] += 1
    print(f"FAULT in run {number}: {what}", flush=True)


def fill():
    """Fills the file system; returns the function that frees it."""
    if not has_disk:
        return lambda: None
    counts["full disk"] += 1
    with open("ballast", "wb", buffering=0) as file:
        try:
            while True:
                file.write(bytes(1 << 16))
        except OSError:
            pass
    return lambda: os.path.exists("ballast") and os.remove("ballast")


def send(process_id, name):
    try:
        os.kill(process_id, getattr(signal, f"SIG{name}"))
        counts["kills"] += 1
    except ProcessLookupError:
        pass


def kill(process_id, first):
    send(process_id, first)
    if numbers.random() < 0.6:
        counts["repeated"] += 1
        time.sleep(numbers.uniform(0.001, 0.5))
        send(process_id, numbers.choice(SIGNALS))


def stop(kind, number, name, span):
    """Runs the command and stops it once. Returns status and messages."""
    words, way, moment = command(kind, name), numbers.random(), numbers.uniform(0.05, span)
    name = numbers.choice(SIGNALS)
    if way < 0.2:
        counts["timeout"] += 1
        counts["kills"] += 1
        words = ["timeout", "-s", name, f"{moment:.2f}", *words]
    elif way < 0.35:
        # After this time parallel sends TERM twice, then KILL.
        counts["parallel"] += 1
        counts["kills"] += 2
        words = ["parallel", "--will-cite", "--timeout", f"{moment:.2f}", "--termseq", "TERM,200,TERM,30000,KILL", "-N0", " ".join(words), ":::", "1"]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    free = lambda: None
    if way > 0.35:
        time.sleep(moment)
        free = fill() if numbers.random() < 0.3 else free
        time.sleep(numbers.uniform(0, 0.6))
        kill(process.pid, name)
        time.sleep(numbers.uniform(0, 1.5))
    free()
    messages = process.communicate(timeout=300)[1]
    return process.returncode, messages, way


def stopped_job(kind, number, whole):
    name = f"k{number}"
    for attempt in range(3):
        status, messages, way = stop(kind, number, name, spans[kind])
        if status == 0:
            break
        if way > 0.35 and status < 128 and -status not in range(1, 32):
            fault(number, f"{kind}: status {status}: {messages[-300:]}")
        check(number, kind, name, messages)
    quietly(command(kind, name))
    if content(result(kind, name)) != whole:
        fault(number, f"{kind}: other bytes after resuming")
    for path in (f"{name}.png", f"{name}.zk"):
        if os.path.exists(path):
            os.remove(path)


def check(number, kind, name, messages):
    stray = [file for file in os.listdir(".") if file.endswith(".tmp")]
    if stray:
        fault(number, f"{kind}: stray {stray}")
        for file in stray:
            os.remove(file)
    film = f"{name}.zk"
    if os.path.exists(film):
        if subprocess.run([ZERKALO, "info", film], capture_output=True).returncode:
            fault(number, f"{kind}: {film} is torn")
    elif kind == "render" and "before the first picture" not in messages:
        fault(number, f"{kind}: nothing kept: {messages[-300:]}")


def dashboard(number):
    """Edits the scene in a terminal that replies to nothing, and stops the program."""
    process_id, terminal = pty.fork()
    if process_id == 0:
        os.environ.update(TERM="xterm-256color", COLORTERM="truecolor")
        os.execv(ZERKALO, [ZERKALO, "edited.toml", "--threads", "1"])
    output = bytearray()

    def listen(seconds, pattern=None):
        end = time.time() + seconds
        while time.time() < end and not (pattern and pattern in output):
            if select.select([terminal], [], [], 0.05)[0]:
                try:
                    output.extend(os.read(terminal, 65536))
                except OSError:
                    return

    shutil.copy("room.toml", "edited.toml")
    listen(20, b"spp")
    for _ in range(numbers.randrange(1, 4)):
        os.write(terminal, b"]")
        listen(numbers.uniform(0.05, 0.4))
    listen(20, "●".encode())
    free = fill() if numbers.random() < 0.3 else lambda: None
    listen(0.4)
    kill(process_id, numbers.choice(SIGNALS))
    end = time.time() + 20
    while (ended := os.waitpid(process_id, os.WNOHANG))[0] == 0 and time.time() < end:
        listen(0.05)
    listen(1, b"\x1b[?1049l")
    free()
    os.close(terminal)
    if ended[0] == 0:
        fault(number, "dashboard: it does not end")
        os.kill(process_id, signal.SIGKILL)
        os.waitpid(process_id, 0)
    if b"\x1b[?1049l" not in output or b"\x1b[?1002l" not in output:
        fault(number, f"dashboard: the terminal is not restored: {bytes(output[-200:])}")
    kept = [f"{at}/{file}" for top in (".", state) for at, _, files in os.walk(top) for file in files if file.endswith(".unsaved")]
    if len(kept) != 1:
        fault(number, f"dashboard: {kept} of the edits are kept, status {ended[1]}")
    for path in kept:
        shutil.copy(path, "kept.toml")
        if subprocess.run([ZERKALO, "check", "kept.toml"], capture_output=True).returncode or content(path) == content("room.toml"):
            fault(number, f"dashboard: {path} is torn or has no edit")
        os.remove(path)
    if content("edited.toml") != content("room.toml"):
        fault(number, "dashboard: the scene file has changed")
    check(number, "dashboard", "none", "")


start = time.time()
print(f"{quietly([ZERKALO, '--version']).stdout.split(chr(10))[0]}, {os.cpu_count()} cores; {time.strftime('%F')}; {'a full disk of its own' if has_disk else 'no full disk'}", flush=True)
quietly([ZERKALO, "plan", "room.toml", *SIZE[:2], "--noise", "0.2", "--shards", "3", "-o", "job.plan"])
quietly([ZERKALO, "work", "room.toml", "job.plan"])
last_plan = max((name for name in os.listdir(".") if name.endswith(".plan")), key=os.path.getmtime)
wholes, spans = {}, {}
for kind in ("render", "shard", "merge"):
    began = time.time()
    quietly(command(kind, "whole"))
    spans[kind] = time.time() - began
    wholes[kind] = content(result(kind, "whole"))
    for path in ("whole.png", "whole.zk"):
        if os.path.exists(path):
            os.remove(path)
print("seconds of whole runs:", ", ".join(f"{kind} {span:.1f}" for kind, span in spans.items()), flush=True)
number = 0
while counts["kills"] < int(sys.argv[1]):
    kind = KINDS[number % len(KINDS)]
    if kind == "dashboard":
        dashboard(number)
    else:
        stopped_job(kind, number, wholes[kind])
    number += 1
print(f"{number} jobs in {time.time() - start:.0f} s:", ", ".join(f"{count} {name}" for name, count in counts.items()))
os.chdir("/")
if has_disk:
    subprocess.run(["umount", folder])
for used in (folder, state):
    shutil.rmtree(used, ignore_errors=True)
sys.exit(counts["faults"] > 0)
