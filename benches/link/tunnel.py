#!/usr/bin/env python3
"""Real TCP connection of a rate and a delay: two TUN devices, the second of them in a network namespace.

Arguments: name of the namespace, bytes per second from the namespace to the host, seconds of delay of each
direction. The host has the address 10.77.0.1, the namespace 10.77.0.2. The bottleneck queues up to 96 KB and
drops what exceeds them. Needs root. Prints a line when the devices are up; ends when stdin is closed.
"""

import collections
import fcntl
import os
import select
import struct
import subprocess
import sys
import time

NAMESPACE, RATE, DELAY = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
QUEUE_BYTES = 96 << 10
DEVICES = ("zerkalo0", "zerkalo1")
TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000


def run(command):
    subprocess.run(command, shell=True, check=True)


def tun(name):
    device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH", name.encode(), IFF_TUN | IFF_NO_PI))
    return device


host, server = map(tun, DEVICES)
run(f"ip link set {DEVICES[1]} netns {NAMESPACE}")
run(f"ip addr add 10.77.0.1/30 dev {DEVICES[0]} && ip link set {DEVICES[0]} up mtu 1500")
inside = f"ip netns exec {NAMESPACE}"
run(f"{inside} ip addr add 10.77.0.2/30 dev {DEVICES[1]}")
run(f"{inside} ip link set {DEVICES[1]} up mtu 1500 && {inside} ip link set lo up")
print("up", flush=True)

# Packets with their times of arrival, by destination.
transit = {host: collections.deque(), server: collections.deque()}
free_at = 0.0
while True:
    now = time.monotonic()
    next_at = min((packets[0][0] for packets in transit.values() if packets), default=now + 1)
    ready, _, _ = select.select([host, server, sys.stdin], [], [], max(0, next_at - now))
    if sys.stdin in ready:
        break
    for source in ready:
        while True:
            try:
                packet = os.read(source, 65536)
            except BlockingIOError:
                break
            now = time.monotonic()
            if source == host:
                transit[server].append((now + DELAY, packet))
            elif (max(free_at, now) - now) * RATE <= QUEUE_BYTES:
                free_at = max(free_at, now) + len(packet) / RATE
                transit[host].append((free_at + DELAY, packet))
    now = time.monotonic()
    for destination, packets in transit.items():
        while packets and packets[0][0] <= now:
            try:
                os.write(destination, packets.popleft()[1])
            except OSError:
                pass
