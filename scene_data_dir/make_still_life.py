"""The scene of the first page: a lamp, a sphere of glass and a knot of gold in front of a picture on the wall.

``make_scenes.py`` writes it. Positions are as the eye sees them, x to the right; the camera of the course
shows right-handed data mirrored (A1-6), so ``seen`` changes the sign of x.
"""

import numpy as np
from make_gltf_scenes import png_bytes

WALL, ROOM = -1.7, (3.4, 3.0, 4.4)  # z of the wall with the picture; half width, height and depth of the room
FLOOR_TEXELS, PLANKS = 192, 6
PICTURE_TEXELS = (100, 160)

MATERIALS = {
    "parquet": {"Kd": (1, 1, 1), "alpha_x": 0.22, "alpha_y": 0.22, "F0": (0.04,) * 3, "layered": 1},
    "wall": {"Kd": (0.25, 0.34, 0.38), "Ns": 1},
    "room": {"Kd": (0.62, 0.56, 0.5), "Ns": 1},
    "skirting": {"Kd": (0.55, 0.52, 0.46), "Ns": 1},
    "frame": {"F0": (0.6, 0.42, 0.2), "alpha_x": 0.25, "alpha_y": 0.25},
    "painting": {"Kd": (1, 1, 1), "Ns": 1},
    "window": {"Kd": (0, 0, 0), "Ke": (4.2, 5.2, 6.6), "Ns": 1},
    "glass": {"Kd": (0.9, 0.9, 0.9), "Ks": (1, 1, 1), "Ns": 1000, "Ni": 1.5, "d": 1, "illum": 7},
    "gold": {"F0": (1.0, 0.71, 0.29), "alpha_x": 0.12, "alpha_y": 0.12},
    "brass": {"F0": (0.85, 0.62, 0.33), "alpha_x": 0.2, "alpha_y": 0.2},
    "bulb": {"Kd": (0.8, 0.8, 0.8), "Ke": (30, 19, 10), "Ns": 1},
    "book_red": {"Kd": (0.45, 0.07, 0.05), "Ns": 1},
    "book_cream": {"Kd": (0.72, 0.62, 0.45), "Ns": 1},
    "ceramic": {"Kd": (0.62, 0.14, 0.05), "alpha_x": 0.08, "alpha_y": 0.08, "F0": (0.05,) * 3, "layered": 1},
}
TEXTURES = {"parquet": "still_life_parquet.png", "painting": "still_life_painting.png"}


def seen(points):
    """Right of the eye -> x of the scene."""
    return np.asarray(points, dtype=np.float64) * [-1, 1, 1]


def parquet(hashed):
    """Planks of oak: each has its tone, and a grain along it."""
    row, column = np.indices((FLOOR_TEXELS, FLOOR_TEXELS))
    width = FLOOR_TEXELS // PLANKS
    plank = column // width
    along = (row + (hashed(plank, 11) * FLOOR_TEXELS).astype(int)) % FLOOR_TEXELS
    board = plank * 7 + along // (FLOOR_TEXELS // 2)
    line = hashed(column * 3 + board * 977, 12)  # a streak of the grain
    tone = 0.5 + 0.55 * (hashed(board, 13) - 0.5) + 0.3 * (line - 0.5)
    tone = tone + 0.12 * (hashed(column * 8192 + board * 31 + along // 19, 14) - 0.5)
    shade = np.clip(1 + 13 * tone, 1, 14).astype(int)
    shade[(column % width == 0) | (along % (FLOOR_TEXELS // 2) == 0)] = 0  # the joints
    steps = np.linspace(0, 1, 14)[:, None]
    browns = np.array([92, 54, 30]) * (1 - steps) + np.array([186, 130, 82]) * steps
    return png_bytes(shade, np.rint(np.concatenate([[[46, 27, 16]], browns])).astype(np.uint8))


def painting(cos_sin):
    """Hills below an evening sun."""
    height, width = PICTURE_TEXELS
    y, x = (np.indices(PICTURE_TEXELS) + 0.5) / [[[height]], [[width]]]
    skies, hills = 40, 5
    found = np.floor(skies * np.clip(y / 0.72, 0, 0.999)).astype(int)
    found[(x - 0.64) ** 2 * (width / height) ** 2 + (y - 0.47) ** 2 < 0.016] = skies
    for k in range(hills):
        _, wave = cos_sin((0.8 + 0.35 * k) * x + 0.37 * k + 0.05)
        _, ripple = cos_sin((2.3 + 0.4 * k) * x + 0.61 * k)
        found[y > 0.56 + 0.09 * k + (0.055 - 0.004 * k) * wave + 0.018 * ripple] = skies + 1 + k
    steps = np.linspace(0, 1, skies)[:, None]
    sky = np.array([38, 70, 112]) * (1 - steps) + np.array([250, 190, 120]) * steps
    land = [(206, 122, 96), (160, 84, 92), (108, 62, 88), (62, 48, 76), (30, 32, 54)]
    return png_bytes(found, np.rint(np.concatenate([sky, [[255, 236, 190]], land])).astype(np.uint8))


def quad(material, corners, uv=None):
    """Four corners, counter-clockwise as the eye sees the front, in positions as the eye sees them."""
    return material, seen(corners), None, [[0, 1, 2, 3]], uv


def box(material, low, high, turn=(1.0, 0.0)):
    """Five sides of a box, which stands on something; ``turn`` is cos and sin of its turn about y."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    sides = [
        [(x0, y0, z1), (x1, y0, z1), (x1, y1, z1), (x0, y1, z1)],
        [(x1, y0, z0), (x0, y0, z0), (x0, y1, z0), (x1, y1, z0)],
        [(x1, y0, z1), (x1, y0, z0), (x1, y1, z0), (x1, y1, z1)],
        [(x0, y0, z0), (x0, y0, z1), (x0, y1, z1), (x0, y1, z0)],
        [(x0, y1, z1), (x1, y1, z1), (x1, y1, z0), (x0, y1, z0)],
    ]
    c, s = turn
    cx, cz = (x0 + x1) / 2, (z0 + z1) / 2
    around = [[(cx + c * (x - cx) + s * (z - cz), y, cz - s * (x - cx) + c * (z - cz)) for x, y, z in p] for p in sides]
    return [quad(material, corners) for corners in around]


def turned(material, profile, centre, cos_sin, steps=24):
    """A surface of revolution about a vertical axis; profile: (radius, y), from the bottom to the top."""
    c, s = cos_sin(np.arange(steps) / steps)
    rings = [np.stack([r * c, np.full(steps, y), r * s], axis=-1) for r, y in profile]
    pieces = []
    for (r0, y0), (r1, y1), low, high in zip(profile[:-1], profile[1:], rings[:-1], rings[1:], strict=True):
        slope = np.sqrt((r1 - r0) ** 2 + (y1 - y0) ** 2)
        normal = np.stack([c * (y1 - y0), np.full(steps, r0 - r1), s * (y1 - y0)], axis=-1) / slope
        i, j = np.arange(steps), (np.arange(steps) + 1) % steps
        faces = np.stack([i, i + steps, j + steps, j], axis=-1)
        points = np.concatenate([low, high]) + seen(centre)
        pieces.append((material, points, np.concatenate([normal, normal]), faces, None))
    return pieces


def room():
    """The floor, the walls, the picture, and a window with four panes to the right of the eye."""
    w, h, d = ROOM
    tiles = [(0, 0), (5.1, 0), (5.1, 4.6), (0, 4.6)]
    pieces = [quad("parquet", [(-w, 0, d), (w, 0, d), (w, 0, WALL), (-w, 0, WALL)], tiles)]
    pieces.append(quad("wall", [(-w, 0, WALL), (w, 0, WALL), (w, h, WALL), (-w, h, WALL)]))
    pieces.append(quad("room", [(-w, h, WALL), (w, h, WALL), (w, h, d), (-w, h, d)]))
    pieces.append(quad("room", [(-w, 0, d), (-w, 0, WALL), (-w, h, WALL), (-w, h, d)]))
    pieces.append(quad("room", [(w, 0, WALL), (w, 0, d), (w, h, d), (w, h, WALL)]))
    pieces.append(quad("room", [(w, 0, d), (-w, 0, d), (-w, h, d), (w, h, d)]))
    pieces += box("skirting", (-w, 0, WALL), (w, 0.13, WALL + 0.05))
    for z in (-0.45, 0.5):
        for y in (0.75, 1.6):
            x = w - 0.02
            pieces.append(quad("window", [(x, y, z), (x, y, z + 0.85), (x, y + 0.75, z + 0.85), (x, y + 0.75, z)]))
    x0, x1, y0, y1, rim, front = -0.42, 1.22, 0.92, 1.94, 0.055, WALL + 0.06
    pieces.append(
        quad(
            "painting",
            [(x0, y0, front - 0.03), (x1, y0, front - 0.03), (x1, y1, front - 0.03), (x0, y1, front - 0.03)],
            [(0, 0), (1, 0), (1, 1), (0, 1)],
        )
    )
    for low, high in (
        ((x0 - rim, y0 - rim, WALL), (x1 + rim, y0, front)),
        ((x0 - rim, y1, WALL), (x1 + rim, y1 + rim, front)),
        ((x0 - rim, y0, WALL), (x0, y1, front)),
        ((x1, y0, WALL), (x1 + rim, y1, front)),
    ):
        pieces += box("frame", low, high)
    return pieces


def still_life(shapes, cos_sin, hashed, obj_rows, mtl_text):
    """-> the files. shapes: ``geodesic_sphere`` and ``torus_knot`` of ``make_scenes``."""
    geodesic_sphere, torus_knot = shapes
    pieces = room()

    fine, fine_faces = geodesic_sphere(8)
    coarse, coarse_faces = geodesic_sphere(5)
    pieces.append(("glass", 0.42 * fine + seen((-0.42, 0.42, 0.1)), fine, fine_faces, None))
    pieces.append(("ceramic", 0.15 * coarse + seen((0.34, 0.15, 0.5)), coarse, coarse_faces, None))

    lamp = (-1.45, 0.0, -0.75)
    profile = [(0.26, 0.0), (0.26, 0.03), (0.06, 0.06), (0.022, 0.1), (0.022, 0.7), (0.09, 0.74), (0.09, 0.8)]
    pieces += turned("brass", profile, lamp, cos_sin)
    pieces.append(("bulb", 0.2 * coarse + seen((lamp[0], 0.97, lamp[2])), coarse, coarse_faces, None))

    pieces += box("book_red", (0.55, 0, -0.72), (1.55, 0.13, 0.02), cos_sin(0.015))
    pieces += box("book_cream", (0.62, 0.13, -0.68), (1.45, 0.23, -0.05), cos_sin(-0.02))
    points, normals, quads = torus_knot(80, 14)
    c, s = cos_sin(0.055)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    scale = 0.47
    points, normals = points @ turn.T * scale, normals @ turn.T
    lowest = points[:, 1].min()
    pieces.append(("gold", points + seen((1.03, 0.23 - lowest, -0.36)), normals, quads, None))

    lines = [f"# {line}" for line in HEADER.strip().splitlines()] + ["mtllib still_life.mtl"]
    return {
        "still_life.obj": obj_of(lines, pieces, obj_rows),
        "still_life.mtl": with_textures(mtl_text(MATERIALS)),
        TEXTURES["parquet"]: parquet(hashed),
        TEXTURES["painting"]: painting(cos_sin),
    }


HEADER = """
A lamp, a sphere of glass, a knot of gold on two books, and a picture on the wall of a closed room with a window.
The eye of the course's camera at (0, 1, 3.5), looking at (0, 0.72, -0.5), with fov 33 sees it as it is composed.
"""


def obj_of(lines, pieces, obj_rows):
    """OBJ of (material, points, normals or None, faces, texture coordinates or None)."""
    vertices, normals, textures, faces = [], [], [], []
    for material, points, own, polygons, uv in pieces:
        first, first_normal, first_uv = len(vertices) + 1, len(normals) + 1, len(textures) + 1
        vertices += list(points)
        if own is None:
            a, b = points[1] - points[0], points[2] - points[0]
            normal = np.cross(b, a)  # the sign of x has turned the corners around
            own = [normal / np.sqrt((normal * normal).sum())]
            polygons = [polygon[::-1] for polygon in polygons]
        normals += list(own)
        textures += list(uv or [])
        faces += [f"g {material}", f"usemtl {material}"]
        for polygon in polygons:
            words = []
            for k in map(int, polygon):
                texture = "" if uv is None else str(first_uv + k)
                words.append(f"{first + k}/{texture}/{first_normal + (k if len(own) > 1 else 0)}")
            faces.append("f " + " ".join(words))
    rows = obj_rows("v", vertices, 4) + obj_rows("vt", textures, 4) + obj_rows("vn", normals, 3)
    return ("\n".join([*lines, *rows, *faces]) + "\n").encode("ascii")


def with_textures(mtl):
    """The line map_Kd below the materials that have a picture."""
    text = mtl.decode("ascii")
    for name, file in TEXTURES.items():
        text = text.replace(f"newmtl {name}\n", f"newmtl {name}\nmap_Kd {file}\n")
    return text.encode("ascii")
