#!/usr/bin/env python3
"""Small files that declare or inflate to gigabytes, opened by every command under a limit of 600 MB: images,
meshes, texts and films of each format. No command may abort, panic, or take longer than 20 seconds, and the
dashboard must end within half a second of `q`.

    cargo build --release && benches/bombs.py

ZERKALO names another build. The exit status is the number of faults.
"""
import json
import os
import pty
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import zlib

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
ZERKALO = os.path.abspath(os.environ.get("ZERKALO", f"{ROOT}/target/release/zerkalo"))
LIMIT_KB = 600_000
LONGEST = 20
SCENE = "film.size = [64, 48]\nambient.color = [1, 1, 1]\n[[object]]\n"
BALL = "shape.sphere = { center = [0, 0, -3], radius = 1 }\n"

folder = tempfile.mkdtemp(prefix="zerkalo-bombs-")
os.chdir(folder)
faults = 0


def write(name, data):
    with open(name, "wb") as file:
        file.write(data if isinstance(data, bytes) else data.encode())
    return name


def deflated_zeros(count):
    """Zlib stream of `count` zeros, made in pieces."""
    packer = zlib.compressobj(9)
    pieces = [packer.compress(bytes(1 << 20)) for _ in range(count >> 20)]
    return b"".join(pieces) + packer.compress(bytes(count & 0xFFFFF)) + packer.flush()


def png_chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width, height, depth, kind, data, more=b""):
    head = png_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + more + png_chunk(b"IDAT", data) + png_chunk(b"IEND", b"")


def jpeg(side):
    frame = struct.pack(">BBHBHHBBBB", 0xFF, 0xC0, 11, 8, side, side, 1, 1, 0x11, 0)
    return b"\xff\xd8" + frame + bytes([0xFF, 0xDA, 0, 8, 1, 1, 0, 0, 63, 0]) + bytes(200_000)


def exr(width, height, compression):
    def attribute(name, kind, value):
        return name + b"\0" + kind + b"\0" + struct.pack("<I", len(value)) + value

    channel = b"".join(name + b"\0" + struct.pack("<IIII", 1, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    one = struct.pack("<f", 1)
    return b"\x76\x2f\x31\x01\x02\0\0\0" + b"".join((
        attribute(b"channels", b"chlist", channel), attribute(b"compression", b"compression", bytes([compression])),
        attribute(b"dataWindow", b"box2i", window), attribute(b"displayWindow", b"box2i", window),
        attribute(b"lineOrder", b"lineOrder", b"\0"), attribute(b"pixelAspectRatio", b"float", one),
        attribute(b"screenWindowCenter", b"v2f", bytes(8)), attribute(b"screenWindowWidth", b"float", one),
    )) + bytes(9000)


def hdr(width, height):
    row = bytes([9] * 4 + [1, 1, 1, 255] + [1, 1, 1, 63])
    return f"#?RADIANCE\n\n-Y {height} +X {width}\n".encode() + row * 500


def ply(form, count):
    return (f"ply\nformat {form} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n"
            f"element face {count}\nproperty list uint int vertex_indices\nend_header\n")


def gltf(count, length, copies, uri="data:application/octet-stream;base64,"):
    zeros = "A" * (4 * -(-min(length, 120_000) // 3))
    return json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(copies))}],
        "nodes": [{"mesh": 0}] * copies, "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}] * copies}],
        "buffers": [{"byteLength": length, "uri": uri + zeros}], "bufferViews": [{"buffer": 0, "byteLength": length}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"}],
    })


def glb(count):
    text = gltf(count, 36, 1).encode()
    return b"glTF\x02\0\0\0\xff\xff\xff\xff" + struct.pack("<I", len(text)) + b"JSON" + text + b"\xf0\xff\xff\xffBIN\0"


def film(source, size=None, groups=None, entries=None):
    """The film file `source` with another size or number of light groups, or with `entries` of metadata."""
    data, out, at = open(source, "rb").read(), b"", 12
    while at < len(data):
        tag, (length,) = data[at:at + 4], struct.unpack("<Q", data[at + 4:at + 12])
        contents = bytearray(data[at + 12:at + 12 + length])
        if tag == b"HEAD" and size:
            contents[:8] = struct.pack("<II", *size)
        if tag == b"HEAD" and groups:
            contents[8:12] = struct.pack("<I", groups)
        if tag == b"META" and entries:
            contents[:4] = struct.pack("<I", entries)
        chunk = tag + struct.pack("<Q", len(contents)) + contents
        out += chunk + struct.pack("<I", zlib.crc32(chunk))
        at += 16 + length
    return data[:12] + out


def limited(args):
    return ["sh", "-c", f'ulimit -v {LIMIT_KB}; exec "$0" "$@"', ZERKALO, *args]


def fault(what, *words):
    global faults
    faults += 1
    print("FAULT", what, *words, flush=True)


def check_status(what, status, text):
    if status < 0 or status in (101, 124, 134, 139) or b"panicked" in text or b"memory allocation" in text:
        fault(what, status, text[-300:])


def run(*args):
    what = " ".join(args)
    try:
        ended = subprocess.run(limited(args), capture_output=True, timeout=LONGEST, stdin=subprocess.DEVNULL)
        check_status(what, ended.returncode, ended.stdout + ended.stderr)
    except subprocess.TimeoutExpired:
        fault(what, "hangs")


def show(*args, seconds=1.5):
    """Opens the dashboard in a terminal, scrolls, and quits."""
    what, started = "dashboard " + " ".join(args), time.monotonic()
    child, terminal = pty.fork()
    if child == 0:
        os.environ["TERM"] = "xterm-256color"
        command = limited(args)
        os.execvp(command[0], command)
    text, quit_at, status = b"", None, None
    while status is None and time.monotonic() < started + LONGEST:
        if select.select([terminal], [], [], 0.02)[0]:
            try:
                new = os.read(terminal, 1 << 16)
            except OSError:
                new = b""
            text += new
            os.write(terminal, b"\x1b[?62;22c" * new.count(b"\x1b[c") + b"\x1b[0n" * new.count(b"\x1b[5n"))
        if quit_at is None and time.monotonic() > started + seconds:
            quit_at = time.monotonic()
            os.write(terminal, b"q")
        ended, code = os.waitpid(child, os.WNOHANG)
        status = os.waitstatus_to_exitcode(code) if ended else None
    if status is None:
        fault(what, "hangs", text[-200:])
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    else:
        check_status(what, status, text)
        if quit_at and time.monotonic() - quit_at > 0.5:
            print(f"slow  {what}: {time.monotonic() - quit_at:.2f} s after q", flush=True)
    os.close(terminal)


write("good.toml", SCENE + BALL)
subprocess.run([ZERKALO, "render", "good.toml", "-o", "good.png", "--checkpoint", "good.zk", "--spp", "2", "-q"], check=True)
subprocess.run([ZERKALO, "plan", "good.toml", "--noise", "1", "--shards", "1", "-o", "job.plan", "-q"], check=True)
plain = deflated_zeros(8000 * (8000 * 8 + 1))
text = b"Comment\0\0" + deflated_zeros(1 << 30)
images = {
    "inflates.png": png(8000, 8000, 16, 6, plain), "interlaced.png": png(30000, 30000, 1, 0, deflated_zeros(30000 * 3751)),
    "claims.png": png(1 << 30, 1 << 30, 8, 2, plain[:9000]), "text.png": png(16, 16, 8, 0, deflated_zeros(16 * 17), png_chunk(b"zTXt", text)),
    "profile.png": png(16, 16, 8, 0, deflated_zeros(16 * 17), png_chunk(b"iCCP", b"p\0\0" + text[9:])),
    "big.jpg": jpeg(8000), "huge.jpg": jpeg(65535), "big.hdr": hdr(16384, 2000), "huge.hdr": hdr(2**31 - 1, 2**31 - 1),
    **{f"big-{kind}.exr": exr(16384, 8192, kind) for kind in range(10)}, "huge.exr": exr(1 << 30, 1 << 30, 3),
}
face = b"".join(bytes([3, 0, 1, 2, 6]) + struct.pack("<I", i) + b"\0\1" for i in range(1_300_000))
copies = (b"ply\nformat binary_little_endian 1.0\nelement vertex 60\nproperty uchar x\nproperty uchar y\nproperty uchar z\n"
          b"element face 1300000\nproperty list uchar uchar vertex_indices\nproperty list uchar uchar texcoord\nend_header\n")
polygon = "f " + " ".join(str(i % 9 + 1) for i in range(2_000_000))
meshes = {
    "many.ply": ply("ascii", 4_000_000_000), "bytes.ply": ply("binary_big_endian", 4_000_000_000), "copies.ply": copies + bytes(180) + face,
    "list.ply": ply("binary_little_endian", 1).encode() + bytes(12) + b"\xff" * 4, "many.stl": bytes(80) + b"\xff" * 4,
    "facets.stl": "solid\n" + "facet normal 0 0 1\n" * 900_000, "corner.obj": "v 0 0 0\n" + "v 1 0 0\n" * 9 + "f 1 2 4000000000\n",
    "polygon.obj": "".join(f"v {i} {i * i % 7} 0\n" for i in range(9)) + polygon, "line.obj": "v " + "1" * 30_000_000,
    "continued.obj": "\\\n" * 9_000_000, "copies.gltf": gltf(9000, 108_000, 100), "claims.gltf": gltf(357_913_941, 2**32 - 4, 1),
    "nodes.gltf": gltf(3, 36, 20_000), "claims.glb": glb(3), "deep.gltf": '{"asset":{"version":"2.0"},"x":' + "[" * 900_000,
}
texts = {
    "nested.toml": "x = " + "[" * 900_000, "keys.toml": "a." * 400_000 + "a = 1", "string.toml": 'x = "' + "y" * 30_000_000,
    "errors.toml": (SCENE[:-11] + "[[object]]\nradius = 1\n" * 300_000), "balls.toml": SCENE[:-11] + ("[[object]]\n" + BALL) * 400_000,
    "size.toml": SCENE.replace("64, 48", "60000, 60000") + BALL, "wide.toml": SCENE.replace("64, 48", "9000, 8000") + BALL,
    "depth.toml": SCENE + BALL + "shape.union = { parts = [" + "{ union = { parts = [" * 9000,
}
films = {
    "wide.zk": film("good.zk", size=(9000, 8000)), "huge.zk": film("good.zk", size=(2**31 - 1, 2**31 - 1)), "row.zk": film("good.zk", size=(2**32 - 1, 1)),
    "groups.zk": film("good.zk", groups=2**32 - 1), "metadata.zk": film("good.zk", entries=2**32 - 1), "part.zk": film("job-0.zk", size=(9000, 8000)),
}
for name, data in {**images, **meshes, **texts, **films}.items():
    write(name, data)
    scene = name
    if name in meshes:
        scene = write("bomb.toml", SCENE + f'shape.mesh.file = "{name}"\n')
    elif name in images and not name.endswith((".hdr", ".exr")):
        scene = write("bomb.toml", f'{SCENE}material = "m"\n{BALL}[materials.m]\ntexture.image.file = "{name}"\n')
    elif name in images:
        scene = write("bomb.toml", f'{SCENE}{BALL}[[light]]\nenvironment.file = "{name}"\n')
    if name in films:
        run("render", "good.toml", "-o", "a.png", "--resume", name, "--spp", "4")
        run("merge", name, "-o", "b.png")
        show("watch", name)
    else:
        run("check", scene)
        run("render", scene, "-o", "a.png", "--spp", "2", "--size", "16x12")
    if name in images:
        run("compare", name, "good.png")
        run("measure", "good.toml", "--seconds", "1", "--reference", name)
    run("info", name)
    show(scene)
    if name.endswith(".png") and name in images:
        # As the environment, too.
        show(write("sky.toml", f'{SCENE}{BALL}[[light]]\nenvironment.file = "{name}"\n'))
    print("done ", name, flush=True)
write("list.toml", SCENE[:-11] + "".join(f'[[object]]\nmaterial = "m{i}"\n{BALL}[materials.m{i}]\ntexture.image.file = "{i}.png"\n' for i in range(40)))
shutil.copy("good.png", "0.png")
for i in range(40):
    write(f"{i}.png", png(4000, 4000, 8, 2, plain[:200_000] if i % 2 else deflated_zeros(4000 * 12001)))
run("check", "list.toml")
show("list.toml")
os.chdir("/")
shutil.rmtree(folder)
print(f"{len(images) + len(meshes) + len(texts) + len(films) + 1} bombs, {faults} faults")
sys.exit(min(faults, 99))
