"""Writes dawn.png: an equirectangular sky before sunrise with thin clouds; the sun rises at -z."""
import math, random, struct, zlib
W, H = 960, 480
rng = random.Random(7)
lattice = [[rng.random() for _ in range(64)] for _ in range(64)]

def smooth(t): return t * t * (3 - 2 * t)

def noise(x, y):
    i, j = math.floor(x), math.floor(y)
    u, v = smooth(x - i), smooth(y - j)
    g = lambda a, b: lattice[a % 64][b % 64]
    low = g(i, j) + u * (g(i + 1, j) - g(i, j))
    high = g(i, j + 1) + u * (g(i + 1, j + 1) - g(i, j + 1))
    return low + v * (high - low)

def fbm(x, y): return sum(noise(x * 2**k + 11 * k, y * 2**k + 5 * k) / 2**(k + 1) for k in range(5))

def mix(a, b, t): return [x + (y - x) * t for x, y in zip(a, b)]

def ramp(stops, t):
    for (t0, c0), (t1, c1) in zip(stops, stops[1:]):
        if t <= t1: return mix(c0, c1, smooth(max(0, (t - t0) / (t1 - t0))))
    return stops[-1][1]

EAST = [(0, (1.0, 0.80, 0.42)), (0.05, (1.0, 0.52, 0.30)), (0.12, (0.80, 0.40, 0.42)), (0.22, (0.40, 0.33, 0.56)), (0.42, (0.13, 0.22, 0.50)), (1, (0.03, 0.08, 0.26))]
WEST = [(0, (0.20, 0.17, 0.30)), (0.07, (0.44, 0.26, 0.34)), (0.18, (0.50, 0.32, 0.40)), (0.36, (0.20, 0.22, 0.45)), (1, (0.03, 0.08, 0.26))]

def sky(x, y, z):
    up = abs(y)
    east = smooth(0.5 - 0.5 * z) ** 2
    c = mix(ramp(WEST, up), ramp(EAST, up), east)
    px, pz = x / (up + 0.12), z / (up + 0.12)
    d = fbm(px * 0.8 + 3, pz * 1.6 + 8)
    cover = smooth(min(1, max(0, (d - 0.46) / 0.2))) * min(1, up / 0.04) * (1 - 0.5 * up)
    lit = mix((0.42, 0.34, 0.50), (1.0, 0.50, 0.32), east * (1 - smooth(min(1, up * 1.6))))
    return mix(c, lit, 0.8 * cover)

def level(v):
    v = min(1, v)
    return round(255 * (12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055))

rows = b""
for j in range(H):
    elevation = math.pi * (0.5 - (j + 0.5) / H)
    row, before = bytearray(), [0, 0, 0]
    for i in range(W):
        azimuth = 2 * math.pi * ((i + 0.5) / W - 0.5)
        x, y, z = math.cos(elevation) * math.sin(azimuth), math.sin(elevation), -math.cos(elevation) * math.cos(azimuth)
        pixel = [level(v) for v in sky(x, y, z)]
        row += bytes((p - b) % 256 for p, b in zip(pixel, before))
        before = pixel
    rows += b"\x01" + row
chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
with open("dawn.png", "wb") as f:
    f.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", W, H, 8, 2, 0, 0, 0)) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))
