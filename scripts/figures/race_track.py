"""A race track as game levels have them: strips of grass, sand, kerbs, lines and asphalt along a
closed course, walls and houses beside it, all with small textures that repeat."""

import math
import random
import struct
import zlib
from pathlib import Path

# Offset from the middle of the course, metres, and the material from there to the next.
STRIPS = [
    (-90, "grass"), (-50, "grass"), (-25, "grass"), (-13, "sand"), (-7.2, "kerb"), (-6.5, "line"),
    (-6.3, "asphalt"), (-2, "asphalt"), (2, "asphalt"), (6.3, "line"), (6.5, "kerb"),
    (7.2, "grass"), (14, "grass"), (30, "grass"), (55, "grass"), (90, None),
]
# Metres that a texture covers before it repeats.
PERIODS = {"grass": 4, "asphalt": 5, "kerb": 2, "line": 1, "sand": 3, "wall": 8, "house": 6, "roof": 1}
SIDES = {"grass": 128, "asphalt": 128, "kerb": 32, "line": 8, "sand": 64, "wall": 64, "house": 96, "roof": 16}


def write(folder, segments=900, seed=5):
    """Writes track.obj, track.mtl and the textures; returns the OBJ's path. Metres, z up."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    rng = random.Random(seed)
    for name, side in SIDES.items():
        write_png(folder / f"{name}.png", side, lambda x, y: texel(name, x, y, rng))
    (folder / "track.mtl").write_text(
        "".join(f"newmtl {name}\nKd 1 1 1\nmap_Kd {name}.png\n" for name in SIDES)
    )
    mesh = Mesh()
    rows = list(course_rows(segments, mesh))
    for a, b in zip(rows, rows[1:]):
        for (left, right), (_, material) in zip(zip(zip(a, b), zip(a[1:], b[1:])), STRIPS):
            mesh.quad(material, [left[0], right[0], right[1], left[1]])
    for number, (a, b) in enumerate(zip(rows, rows[1:])):
        if number // 60 % 2 == 0:
            wall(mesh, a[2], b[2])
    for number in range(60):
        house(mesh, math.tau * number / 60, rng)
    path = folder / "track.obj"
    path.write_text(mesh.text())
    return path


class Mesh:
    """Vertices, texture coordinates, and faces by material."""

    def __init__(self):
        self.positions, self.texcoords = [], []
        self.faces = {name: [] for name in SIDES}

    def vertex(self, position):
        self.positions.append(position)
        return len(self.positions)

    def texcoord(self, texcoord):
        self.texcoords.append(texcoord)
        return len(self.texcoords)

    def quad(self, material, corners):
        """Corners are (vertex, along, across) with metres along and across the texture."""
        period = PERIODS[material]
        ends = [
            (vertex, self.texcoord((along / period, across / period)))
            for vertex, along, across in corners
        ]
        self.faces[material] += [ends[:3], [ends[0], *ends[2:]]]

    def text(self):
        lines = ["mtllib track.mtl"]
        lines += ["v %.4f %.4f %.4f" % position for position in self.positions]
        lines += ["vt %.5f %.5f" % texcoord for texcoord in self.texcoords]
        for material, faces in self.faces.items():
            lines.append(f"usemtl {material}")
            lines += ["f " + " ".join(f"{v}/{t}" for v, t in face) for face in faces]
        return "\n".join(lines) + "\n"


def course(turn):
    radius = 1 + 0.28 * math.sin(3 * turn) + 0.12 * math.sin(7 * turn + 1)
    return 420 * radius * math.cos(turn), 300 * radius * math.sin(turn)


def to_the_right(turn):
    (x, y), (next_x, next_y) = course(turn), course(turn + 1e-4)
    length = math.hypot(next_x - x, next_y - y)
    return (next_y - y) / length, -(next_x - x) / length


def height(x, y):
    return 6 * math.sin(x / 150) + 5 * math.cos(y / 190) + 2 * math.sin((x + y) / 60)


def course_rows(segments, mesh):
    """Rows of corners across the course, level near its middle."""
    along, before = 0.0, None
    for number in range(segments + 1):
        turn = math.tau * number / segments
        (x, y), (right_x, right_y) = course(turn), to_the_right(turn)
        along += math.dist((x, y), before) if before else 0.0
        before = (x, y)
        row = []
        for offset, _ in STRIPS:
            at_x, at_y = x + right_x * offset, y + right_y * offset
            share = min(1, max(0, (abs(offset) - 8) / 40))
            z = height(x, y) * (1 - share) + height(at_x, at_y) * share
            row.append((mesh.vertex((at_x, at_y, z)), along, offset))
        yield row


def wall(mesh, a, b):
    tops = []
    for vertex, along, _ in (a, b):
        x, y, z = mesh.positions[vertex - 1]
        tops.append((mesh.vertex((x, y, z + 1.2)), along, PERIODS["wall"]))
    (first, along, _), (second, next_along, _) = a, b
    mesh.quad("wall", [(first, along, 0), (second, next_along, 0), tops[1], tops[0]])


def house(mesh, turn, rng):
    (x, y), (right_x, right_y) = course(turn), to_the_right(turn)
    x, y = x + right_x * 70, y + right_y * 70
    z, half_x, half_y, tall = height(x, y) - 1, rng.uniform(5, 10), rng.uniform(6, 14), rng.uniform(6, 12)
    corners = [(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)]
    low, high = ([mesh.vertex((x + i, y + j, z + k)) for i, j in corners] for k in (0, tall))
    for side in range(4):
        after = (side + 1) % 4
        length = math.dist(corners[side], corners[after])
        mesh.quad(
            "house",
            [(low[side], 0, 0), (low[after], length, 0), (high[after], length, tall), (high[side], 0, tall)],
        )
    mesh.quad("roof", [(high[at], *corners[at]) for at in range(4)])


def texel(name, x, y, rng):
    shade = rng.gauss(0, 1)
    if name == "grass":
        wave = 12 * math.sin(x * math.tau / 64) * math.sin(y * math.tau / 64)
        return [70 + 22 * shade + wave, 120 + 28 * shade + wave, 50 + 22 * shade]
    if name == "asphalt":
        return [88 + 9 * shade] * 3
    if name == "kerb":
        return [210, 30, 30] if x < 16 else [235] * 3
    if name == "line":
        return [240] * 3
    if name == "sand":
        return [200 + 10 * shade, 180 + 10 * shade, 130 + 10 * shade]
    if name == "wall":
        return [200, 60, 50] if (x // 16 + y // 16) % 2 else [235, 235, 240]
    if name == "house":
        return [60, 70, 90] if 8 < x % 32 < 24 and 10 < y % 48 < 36 else [205, 190, 170]
    return [160 if y % 8 > 5 else 150, 70, 55]


def write_png(path, side, color):
    clamped = lambda value: max(0, min(255, round(value)))
    rows = b"".join(
        b"\0" + bytes(clamped(part) for x in range(side) for part in color(x, y)) for y in range(side)
    )

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )
