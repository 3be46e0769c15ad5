#!/usr/bin/env python3
"""Makes the models and the scene file of the courtyard, next to this file.

    python3 make_models.py

Needs nothing but Python 3 and always makes the same files. Lengths are in meters, y is up, and the
visitor looks along -z. Front faces are wound counterclockwise.
"""

import math
import random
from math import copysign, cos, pi, sin, sqrt, tau
from pathlib import Path

HERE = Path(__file__).resolve().parent

BAY = 2.8          # from column to column, and the depth of a gallery
HALF = 2.5 * BAY   # from the center of the court to the axes of the columns: five bays a side
SPRING = 2.75      # height of a column, where the arches start
WALL = 0.6         # thickness of the walls above the columns
ROOF = 4.75        # height of the roofs


class Mesh:
    """Vertices, and faces of three or four corners by material."""

    def __init__(self):
        self.vertices, self.faces = [], {}

    def vertex(self, x, y, z):
        self.vertices.append((x, y, z))
        return len(self.vertices)

    def face(self, material, *corners):
        self.faces.setdefault(material, []).append(corners)

    def quad(self, material, *points):
        self.face(material, *(self.vertex(*p) for p in points))

    def grid(self, material, rows, columns, point, closed_rows=False, closed_columns=False):
        """The surface point(i / rows, j / columns), seen from where i runs up and j to the right."""
        row_count, column_count = rows + (not closed_rows), columns + (not closed_columns)
        first = len(self.vertices) + 1
        for i in range(row_count):
            for j in range(column_count):
                self.vertex(*point(i / rows, j / columns))
        at = lambda i, j: first + i % row_count * column_count + j % column_count
        for i in range(rows):
            for j in range(columns):
                corners = at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)
                places = [self.vertices[c - 1] for c in corners]
                self.face(material, *(c for k, c in enumerate(corners) if places[k] != places[k - 1]))

    def lathe(self, material, profile, segments, turn=0.0):
        """Turns a profile of (radius, height), from bottom to top, around the y axis."""

        def point(v, u):
            (r, y), a = profile[round(v * (len(profile) - 1))], turn - tau * u
            return r * cos(a), y, r * sin(a)

        self.grid(material, len(profile) - 1, segments, point, closed_columns=True)

    def box(self, material, low, high):
        (x0, y0, z0), (x1, y1, z1) = low, high
        for ring in (
            [(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)],
            [(x1, y0, z0), (x0, y0, z0), (x0, y1, z0), (x1, y1, z0)],
            [(x1, y0, z1), (x1, y0, z0), (x1, y1, z0), (x1, y1, z1)],
            [(x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)],
            [(x0, y1, z1), (x1, y1, z1), (x1, y1, z0), (x0, y1, z0)],
            [(x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)],
        ):
            self.quad(material, *ring)

    def write(self, name, digits=4):
        def number(x):
            text = f"{x:.{digits}f}".rstrip("0").rstrip(".")
            return "0" if text == "-0" else text.replace("0.", ".", 1) if abs(x) < 1 else text

        lines = ["# Made by make_models.py.", "mtllib materials.mtl"]
        lines += ["v " + " ".join(map(number, v)) for v in self.vertices]
        for material, faces in self.faces.items():
            lines.append(f"usemtl {material}")
            lines += ["f " + " ".join(map(str, f)) for f in faces]
        (HERE / name).write_text("\n".join(lines) + "\n")


def arc(center, radius, start, end, steps):
    """Points of a circle in a profile, angles in quarter turns from outward (0) to up (1)."""
    (r, y), angles = center, [pi / 2 * (start + (end - start) * i / steps) for i in range(steps + 1)]
    return [(r + radius * cos(a), y + radius * sin(a)) for a in angles]


# Architecture


def column():
    """A fluted column with base and capital, SPRING high."""
    mesh = Mesh()
    mesh.box("marble", (-0.34, 0.0, -0.34), (0.34, 0.12, 0.34))
    base = [(0.33, 0.12)] + arc((0.27, 0.18), 0.06, -1, 1, 6) + [(0.265, 0.25)]
    base += arc((0.265, 0.285), 0.035, -1, 1, 4)[1:] + [(0.25, 0.33)]
    mesh.lathe("marble", base, 40)
    low, high = 0.33, SPRING - 0.42

    def shaft(v, u):
        flute = abs(sin(10 * pi * u)) ** 0.7
        end = min(1.0, 9.0 * min(v, 1.0 - v)) ** 0.5
        r = 0.235 - 0.035 * v * v - 0.02 * (1.0 - flute) * end
        return r * cos(-tau * u), low + (high - low) * v, r * sin(-tau * u)

    mesh.grid("marble", 10, 80, shaft, closed_columns=True)
    neck = [(0.2, high)] + arc((0.2, high + 0.03), 0.03, -1, 1, 4)[1:] + [(0.2, high + 0.12)]
    mesh.lathe("marble", neck + arc((0.2, high + 0.26), 0.14, -1, 0, 6)[1:], 40)
    mesh.box("marble", (-0.35, high + 0.26, -0.35), (0.35, SPRING, 0.35))
    return mesh


def arch():
    """The wall above a bay with its round arch, from y = 0 up to the roof."""
    mesh, r, steps, top = Mesh(), 0.375 * BAY, 40, ROOF - SPRING
    corner = math.atan2(top, BAY / 2)
    angles = sorted([pi * i / steps for i in range(steps + 1)] + [corner, pi - corner])

    def ring(radius, z):
        return [(radius * cos(a), radius * sin(a), z) for a in angles]

    def border(z):
        reach = [min(BAY / 2 / max(abs(cos(a)), 1e-9), top / max(sin(a), 1e-9)) for a in angles]
        return [(s * cos(a), s * sin(a), z) for s, a in zip(reach, angles)]

    def band(material, outer, inner):
        """Seen from where the outer line is above the inner one and both run to the left."""
        lines = inner, outer
        mesh.grid(material, 1, len(angles) - 1, lambda v, u: lines[round(v)][::-1][round(u * (len(angles) - 1))])

    front, back, trim, lip = WALL / 2, -WALL / 2, r + 0.17, 0.05
    band("plaster", border(front), ring(trim, front))
    band("plaster", ring(trim, back), border(back))
    band("marble", ring(r, front + lip), ring(r, back - lip))
    for z, sign in ((front, 1), (back, -1)):
        raised, flat = z + sign * lip, z
        band("marble", *(ring(trim, raised), ring(r, raised))[::sign])
        band("marble", *(ring(trim, flat), ring(trim, raised))[::sign])
    for x in (-BAY / 2, r):
        mesh.quad("plaster", (x, 0, back), (x + BAY / 2 - r, 0, back), (x + BAY / 2 - r, 0, front), (x, 0, front))
    return mesh


def vault():
    """A groin vault over a square bay, from y = 0: two round vaults that cross."""
    mesh, n, h = Mesh(), 28, BAY / 2
    at = [-h * cos(pi * i / n) for i in range(n + 1)]
    rise = [sqrt(max(0.0, h * h - x * x)) for x in at]
    for i in range(n + 1):
        for j in range(n + 1):
            mesh.vertex(at[i], max(rise[i], rise[j]), at[j])
    for i in range(n):
        for j in range(n):
            a, b, c, d = (1 + p * (n + 1) + q for p, q in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)))
            if i == j:
                mesh.face("plaster", a, b, c)
                mesh.face("plaster", a, c, d)
            elif i + j == n - 1:
                mesh.face("plaster", a, b, d)
                mesh.face("plaster", b, c, d)
            else:
                mesh.face("plaster", a, b, c, d)
    return mesh


def cornice():
    """A bay of molding, on the wall at z = 0 and from y = 0 up."""
    profile = [(0.0, 0.0), (0.06, 0.0), (0.06, 0.05)] + arc((0.24, 0.05), 0.16, 2, 1, 8)
    profile += [(0.26, 0.21), (0.26, 0.3), (0.3, 0.3), (0.3, 0.36), (-WALL / 2, 0.36)]
    mesh = Mesh()

    def point(v, u):
        z, y = profile[round(v * (len(profile) - 1))]
        return BAY * (u - 0.5), y, z

    mesh.grid("marble", len(profile) - 1, 1, point)
    return mesh


def walls():
    """What stands once: outer walls, roofs, corner piers, floors."""
    mesh, inner, outer = Mesh(), HALF + WALL / 2, HALF + WALL / 2 + BAY
    end = HALF + WALL / 2
    mesh.box("terracotta", (outer, 0, -outer - 0.4), (outer + 0.4, ROOF, end))
    mesh.box("terracotta", (-outer - 0.4, 0, -outer - 0.4), (outer, ROOF, -outer))
    mesh.box("plaster", (-outer - 0.4, ROOF, -outer - 0.5), (outer + 0.5, ROOF + 0.18, -inner + WALL))
    mesh.box("plaster", (inner - WALL, ROOF, -inner + WALL), (outer + 0.5, ROOF + 0.18, end))
    for x, z in ((-HALF, -HALF), (-HALF, HALF), (HALF, -HALF), (HALF, HALF), (-inner - BAY, -HALF)):
        mesh.box("plaster", (x - 0.36, 0.0, z - 0.36), (x + 0.36, ROOF + 0.1, z + 0.36))
    mesh.box("slate", (-inner, -0.4, -inner), (inner, -0.02, 40.0))
    for low, high in (
        ((-outer - 0.4, -outer), (outer, -inner)),
        ((-inner - 0.4, -inner), (-inner, end)),
        ((inner, -inner), (outer, end)),
    ):
        mesh.box("sandstone", (low[0], -0.4, low[1]), (high[0], 0.0, high[1]))
    mesh.box("sand", (-400.0, -1.0, -400.0), (400.0, -0.41, 400.0))
    return mesh


def paving():
    """Rings of beveled stones around the steps."""
    mesh, chance, r, k = Mesh(), random.Random(7), 3.15, 0
    while r < HALF - 0.75:
        width = 0.34 if k % 3 == 2 else 0.6
        count = round(tau * r / (0.42 if k % 3 == 2 else 0.95))
        for i in range(count):
            a0, a1 = tau * (i + 0.5 * (k % 2)) / count, tau * (i + 1 + 0.5 * (k % 2)) / count
            stone = "slate" if k % 3 == 2 and i % 2 else chance.choice(["sandstone", "sandstone", "limestone"])
            y = 0.012 * chance.random()
            rows = []
            for inset, height in ((0.012, -0.02), (0.012, y - 0.008), (0.022, y)):
                r0, r1, gap0, gap1 = r + inset, r + width - inset, inset / r, inset / (r + width)
                steps = (0.0, 0.5, 1.0)
                edge = [(r0, a0 + gap0 + (a1 - a0 - 2 * gap0) * s) for s in steps]
                edge += [(r1, a1 - gap1 - (a1 - a0 - 2 * gap1) * s) for s in steps]
                rows.append([mesh.vertex(q * cos(a), height, q * sin(a)) for q, a in edge])
            for low, high in zip(rows, rows[1:]):
                for j in range(6):
                    mesh.face(stone, low[j - 1], low[j], high[j], high[j - 1])
            top = rows[-1]
            for j in range(2):
                mesh.face(stone, top[j], top[j + 1], top[4 - j], top[5 - j])
        r, k = r + width, k + 1
    return mesh


def steps():
    """Round steps, and the pedestal on them."""
    mesh, profile = Mesh(), []
    for i, r in enumerate((3.05, 2.6, 2.15)):
        y = 0.17 * i
        profile += [(r, y - 0.05 * (i == 0)), (r, y + 0.12)] + arc((r, y + 0.145), 0.025, -1, 1, 4)[1:]
    mesh.lathe("limestone", profile + [(0.5, 0.51)], 96)
    foot = [(0.75, 0.51), (0.75, 0.63)] + arc((0.68, 0.69), 0.06, -1, 1, 5)[1:] + [(0.62, 0.75)]
    foot += arc((0.62, 0.95), 0.2, 3, 2, 6)[1:]
    foot += arc((0.62, 1.2), 0.2, 2, 1, 6) + [(0.66, 1.4), (0.66, 1.48), (0.0, 1.48)]
    mesh.lathe("marble", foot, 48)
    return mesh


def pedestal():
    """A square pedestal, 1.1 high."""
    profile = [(0.46, -0.02), (0.46, 0.14), (0.42, 0.14), (0.42, 0.2), (0.36, 0.24), (0.36, 0.9)]
    profile += [(0.4, 0.95), (0.4, 1.0), (0.45, 1.0), (0.45, 1.1), (0.0, 1.1)]
    mesh = Mesh()
    mesh.lathe("marble", [(r * sqrt(2), y) for r, y in profile], 4, turn=pi / 4)
    return mesh


def rotunda():
    """What lies below and above the eight columns on the roof; these are 0.75 * SPRING high."""
    mesh, top = Mesh(), 0.5 + 0.75 * SPRING
    mesh.lathe("plaster", [(2.5, 0.0), (2.5, 0.3), (2.25, 0.3), (2.25, 0.5), (0.0, 0.5)], 80)
    ring = [(1.45, top), (2.0, top), (2.0, top + 0.25), (2.06, top + 0.25)]
    ring += arc((2.26, top + 0.27), 0.2, 2, 1, 5) + [(2.3, top + 0.47), (2.3, top + 0.55), (1.85, top + 0.6)]
    mesh.lathe("marble", ring, 80)
    mesh.lathe("marble", [(1.45, top + 0.6), (1.45, top)], 80)
    rim = top + 0.6

    def dome(v, u):
        a = pi / 2 * v
        r = 0.0 if v == 1 else 1.85 * cos(a) * (1.0 + 0.025 * max(0.0, cos(16 * tau * u)) ** 6)
        return r * cos(-tau * u), rim + 1.95 * sin(a), r * sin(-tau * u)

    mesh.grid("copper", 20, 128, dome, closed_columns=True)
    knob = [(0.3, rim + 1.88), (0.3, rim + 2.0), (0.14, rim + 2.06)] + arc((0.0, rim + 2.24), 0.2, -0.8, 0.8, 10)
    mesh.lathe("gold", knob + [(0.03, rim + 2.5), (0.0, rim + 3.0)], 24)
    return mesh


# Sculptures, plants and lamps


def ring():
    """A flat ring of radius 1, for the armillary sphere."""
    mesh = Mesh()

    def point(v, u):
        a, b = tau * v, -tau * u
        square = max(abs(cos(a)), abs(sin(a))) ** -0.75
        r = 1.0 + 0.022 * cos(a) * square
        return r * cos(b), 0.06 * sin(a) * square, r * sin(b)

    mesh.grid("gold", 12, 112, point, closed_rows=True, closed_columns=True)
    return mesh


def globe():
    """A sphere of radius 1."""
    mesh = Mesh()
    mesh.lathe("lamp", [(0.0, -1.0)] + arc((0.0, 0.0), 1.0, -1, 1, 20)[1:-1] + [(0.0, 1.0)], 36)
    return mesh


def knot():
    """A trefoil knot, standing on y = 0."""
    mesh, p, q = Mesh(), 2, 3

    def line(t):
        r = 0.62 + 0.27 * cos(q * t)
        return r * cos(p * t), r * sin(p * t), 0.27 * 1.25 * sin(q * t)

    def unit(a):
        return [x / sqrt(sum(y * y for y in a)) for x in a]

    def cross(a, b):
        return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]

    def point(v, u):
        t, a = tau * u, tau * v
        here, ahead = line(t), line(t + 1e-4)
        tangent = unit([x - y for x, y in zip(ahead, here)])
        core = (0.62 * cos(p * t), 0.62 * sin(p * t), 0.0)
        side = unit(cross(tangent, [x - y for x, y in zip(here, core)]))
        out = cross(side, tangent)
        x, y, z = (c + 0.185 * (cos(a) * o - sin(a) * s) for c, o, s in zip(here, out, side))
        return x, y + 1.02, z

    mesh.grid("coral", 32, 230, point, closed_rows=True, closed_columns=True)
    return mesh


def turban():
    """A sphere with spiral waves, standing on y = 0."""
    mesh = Mesh()

    def point(v, u):
        if v in (0, 1):
            return 0.0, 1.44 * v, 0.0
        a, b = pi * (v - 0.5), -tau * u
        r = 0.72 * cos(a) * (1.0 + 0.085 * cos(a) ** 0.8 * sin(9 * b + 3.2 * sin(a)))
        return r * cos(b), 0.72 + 0.72 * sin(a), r * sin(b)

    mesh.grid("azure", 34, 153, point, closed_columns=True)
    return mesh


def slab():
    """A rounded square slab, 0.1 high, for the twisted tower."""
    mesh = Mesh()
    profile = [(0.0, 0.0), (0.94, 0.0)] + arc((0.96, 0.05), 0.045, -1, 1, 5) + [(0.94, 0.098), (0.0, 0.098)]

    def point(v, u):
        (s, y), a = profile[round(v * (len(profile) - 1))], -tau * u
        r = 0.5 * s * (abs(cos(a)) ** 5 + abs(sin(a)) ** 5) ** -0.2
        return r * cos(a), y, r * sin(a)

    mesh.grid("ivory", len(profile) - 1, 64, point, closed_columns=True)
    return mesh


def pot():
    """A pot of earth, 0.62 high."""
    mesh = Mesh()
    profile = [(0.24, 0.0), (0.26, 0.04), (0.3, 0.2), (0.36, 0.42), (0.38, 0.5)]
    profile += [(0.43, 0.5), (0.43, 0.62), (0.37, 0.62), (0.36, 0.55), (0.0, 0.55)]
    mesh.lathe("clay", profile, 48)
    return mesh


def tree():
    """A small round tree with a trunk of height 1.3, without its pot."""
    mesh, chance = Mesh(), random.Random(3)
    trunk = [(0.055 - 0.02 * i / 6, 0.5 + 1.0 * i / 6) for i in range(7)]
    mesh.lathe("bark", trunk, 10)

    def direction():
        y, a = chance.uniform(-1, 1), chance.uniform(0, tau)
        s = sqrt(1 - y * y)
        return s * cos(a), y, s * sin(a)

    for i in range(1700):
        out = direction()
        bulge = 1.0 + 0.14 * sin(5 * out[0] + 1) * sin(5 * out[1]) * sin(5 * out[2] + 2)
        r = 0.62 * bulge * chance.uniform(0.4, 1.0) ** 0.33
        x, y, z = r * out[0], 1.75 + r * out[1], r * out[2]
        (ax, ay, az), (bx, by, bz) = direction(), direction()
        long, wide = 0.065, 0.032
        mesh.quad(
            "leaf",
            (x + long * ax, y + long * ay, z + long * az),
            (x + wide * bx, y + wide * by, z + wide * bz),
            (x - long * ax, y - long * ay, z - long * az),
            (x - wide * bx, y - wide * by, z - wide * bz),
        )
    return mesh


# The scene file


def placements():
    """The lines of the list of models."""
    side, lines = HALF + WALL / 2 + BAY / 2, []

    def add(file, *translate, **more):
        entry = [f'file = "{file}.obj"']
        if any(translate):
            entry.append(f"translate = {list(round(x, 4) + 0.0 for x in translate)}")
        entry += [f"{key} = {value}" for key, value in more.items()]
        lines.append("    { " + ", ".join(entry) + " },")

    def title(text):
        lines.append(f"\n    # {text}")

    title("What stands once")
    for name in ("walls", "paving", "steps"):
        add(name)
    add("rotunda", 0.0, ROOF + 0.2, -side)

    title("Columns: north, west, east, and the rotunda")
    axes = [BAY * (i - 1.5) for i in range(4)]
    for x in axes:
        add("column", x, 0.0, -HALF)
    for x in (-HALF, HALF):
        for z in axes:
            add("column", x, 0.0, z)
    for i in range(8):
        a = tau * (i + 0.5) / 8
        place = 1.72 * cos(a), ROOF + 0.7, 1.72 * sin(a) - side
        add("column", *place, scale="[0.8, 0.75, 0.8]", rotate_degrees=f"[0, {-360 * (i + 0.5) / 8}, 0]")

    title("Arches, vaults and cornices, bay by bay; the west is an arcade without a gallery")
    bays = [BAY * (i - 2) for i in range(5)]
    for b in bays:
        add("arch", b, SPRING, -HALF)
        add("vault", b, SPRING, -side)
        add("cornice", b, ROOF - 0.16, -HALF + WALL / 2)
        for x, turn in ((-HALF, 90), (HALF, -90)):
            add("arch", x, SPRING, b, rotate_degrees=f"[0, {turn}, 0]")
            add("cornice", x - copysign(WALL / 2, x), ROOF - 0.16, b, rotate_degrees=f"[0, {turn}, 0]")
        add("vault", side, SPRING, b)
        add("cornice", -HALF - WALL / 2, ROOF - 0.16, b, rotate_degrees="[0, -90, 0]")
    wide = round((BAY + WALL / 2) / BAY, 4)
    for x in (-1, 1):
        add("vault", x * (side - 0.15), SPRING, -side + 0.15, scale=f"[{wide}, 1, {wide}]")
        add("arch", x * side, SPRING, -HALF)
        add("arch", x * HALF, SPRING, -side, rotate_degrees="[0, 90, 0]")
    add("arch", -HALF - WALL / 2 - BAY, SPRING, -side, rotate_degrees="[0, 90, 0]")

    title("The armillary sphere, its light, and the lamps of the galleries and of the rotunda")
    for scale, turn in (
        ("1.3", "[90, 20, 0]"),
        ("1.3", "[90, 110, 0]"),
        ("1.3", "[0, 0, 0]"),
        ("1.16", "[23, 0, 12]"),
        ("1.03", "[64, 35, 0]"),
        ("0.9", "[-38, 0, 30]"),
    ):
        add("ring", 0.0, 2.86, 0.0, scale=scale, rotate_degrees=turn)
    add("globe", 0.0, 2.86, 0.0, scale=0.36, material='"sun"')
    for b in bays:
        add("globe", b, 2.95, -side, scale=0.23)
    for b in bays[:3]:
        add("globe", side, 2.95, b, scale=0.23)
    add("globe", 0.0, 6.5, -side, scale=0.3)

    title("Sculptures on their pedestals")
    for x, z in ((-4.5, 2.4), (4.2, 2.4), (-3.2, -3.6), (4.6, -3.6)):
        add("pedestal", x, 0.0, z)
    add("knot", -4.5, 1.1, 2.4, rotate_degrees="[0, 25, 0]")
    add("turban", 4.2, 1.1, 2.4)
    for x in (-3.2, 4.6):
        for i in range(22):
            s = round(0.62 * (1.0 - 0.018 * i), 3)
            turn = round(copysign(7.5 * i, x), 1)
            add("slab", x, round(1.1 + 0.1 * i, 3), -3.6, scale=f"[{s}, 1, {s}]", rotate_degrees=f"[0, {turn}, 0]")

    title("Trees in pots")
    for i, (x, z) in enumerate(((-1.4, -5.9), (3.2, -5.9), (5.9, -2.8), (-5.9, 0.0), (5.9, 5.6), (-5.9, 5.6))):
        turn = f"[0, {75 * i}, 0]"
        add("pot", x, 0.0, z)
        add("tree", x, 0.0, z, rotate_degrees=turn)
    return lines


HEAD = """\
# A courtyard at sunset. Written by make_models.py, as all models of this folder are.

camera = { position = [-3.0, 3.9, 13.6], target = [0.35, 3.1, 0.0], vertical_fov_degrees = 44 }
sky = { zenith = [0.02, 0.2, 0.72], horizon = [0.72, 0.52, 0.36], ground = [0.30, 0.22, 0.16] }

# The sun, from the left and a little from the back of the court
light = [
    { type = "directional", direction = [0.74, -0.62, 0.2], intensity = [4.6, 3.3, 1.95] },
]

# Materials of the models are in materials.mtl. This one takes the place of the lamps' own.
material = [
    { name = "sun", base_color = [0.8, 0.8, 0.8], emission = [20.0, 11.0, 4.2] },
]

model = ["""


def main():
    models = (column, arch, vault, cornice, walls, paving, steps, pedestal, rotunda)
    sculptures = (ring, globe, knot, turban, slab, pot, tree)
    for make in models + sculptures:
        make().write(f"{make.__name__}.obj", digits=3 if make in (paving, steps, rotunda, tree) else 4)
    (HERE / "scene.toml").write_text("\n".join([HEAD, *placements(), "]\n"]))


if __name__ == "__main__":
    main()
