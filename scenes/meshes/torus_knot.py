"""Writes torus-knot.ply: a tube round the torus knot (2, 5)."""
import math, struct
N, K, P, Q, R, r, TUBE = 640, 18, 2, 5, 0.62, 0.30, 0.125

def point(t):
    w = R + r * math.cos(Q * t)
    return (w * math.cos(P * t), w * math.sin(P * t), r * math.sin(Q * t))

def unit(v):
    n = math.sqrt(sum(c * c for c in v))
    return tuple(c / n for c in v)

def cross(a, b):
    return (a[1]*b[2]-a[2]*b[1], a[2]*b[0]-a[0]*b[2], a[0]*b[1]-a[1]*b[0])

vertices, faces = [], []
for i in range(N):
    t = 2 * math.pi * i / N
    c, h = point(t), 1e-4
    a, b = point(t - h), point(t + h)
    tangent = unit(tuple(y - x for x, y in zip(a, b)))
    core = (R * math.cos(P * t), R * math.sin(P * t), 0)
    out = tuple(x - y for x, y in zip(c, core))
    side = unit(cross(tangent, out))
    normal = cross(side, tangent)
    for k in range(K):
        u = 2 * math.pi * k / K
        vertices.append(tuple(c[j] + TUBE * (math.cos(u) * normal[j] + math.sin(u) * side[j]) for j in range(3)))
        i1, k1 = (i + 1) % N, (k + 1) % K
        faces.append((i * K + k, i * K + k1, i1 * K + k1, i1 * K + k))
with open("torus-knot.ply", "wb") as f:
    f.write(("ply\nformat binary_little_endian 1.0\ncomment A tube round the torus knot (2, 5).\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar ushort vertex_indices\nend_header\n").encode())
    for v in vertices: f.write(struct.pack("<3f", *v))
    for q in faces: f.write(struct.pack("<B4H", 4, *q))
