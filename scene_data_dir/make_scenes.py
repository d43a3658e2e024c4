"""Make every file of this folder from formulas and published measurements.

    python scene_data_dir/make_scenes.py            write the scenes and the environments
    python scene_data_dir/make_scenes.py --check    compare with the files on disk; exit 1 on a difference

Needs numpy. The same bytes come out on every machine: coordinates are computed with + - * / and sqrt alone, which
IEEE 754 rounds alike everywhere, and are written with a fixed number of decimals. (The environments use numpy's sin and
exp: half floats are a thousand million times coarser than the last bit in which processors differ.)

Coordinates are right-handed, y up; fronts are counter-clockwise seen from the side that the normal points to.
Every scene is framed for the course's camera: eye (0, 1, 3), at (0, 1, 0), up (0, 1, 0), vertical fov 60 degrees. Only
veach_plates and many_lights have cameras of their own, which their headers state, and so have the two glTF files of
make_gltf_scenes.py.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from make_environments import environments
from make_forest import forest
from make_gltf_scenes import ggx_spheres, globe
from make_still_life import still_life

FOLDER = Path(__file__).resolve().parent
CENTRE = np.array([0.0, 1.0, 0.0])  # what the course's camera looks at


# --- arithmetic that rounds alike on every machine --------------------------------------------------------------------


def cos_sin(turns):
    """cos and sin of 2 pi turns, by Taylor's series around the nearest quarter turn.

    numpy's own differ in the last bit between processors, which can change a written digit.
    """
    turns = np.asarray(turns, dtype=np.float64)
    quarter = np.rint(4 * turns)
    x = 2 * np.pi * (turns - quarter / 4)  # |x| <= pi / 4: twelve factors leave an error below 1e-17
    c = np.ones_like(x)
    s = np.ones_like(x)
    for n in range(24, 0, -2):
        c = 1 - c * x * x / (n * (n - 1))
        s = 1 - s * x * x / (n * (n + 1))
    s = s * x
    quadrant = quarter.astype(int) % 4
    return np.choose(quadrant, [c, -s, -c, s]), np.choose(quadrant, [s, c, -s, -c])


def dot(a, b):
    """Row by row, in a fixed order of additions: (n, 3), (n, 3) -> (n, 1)."""
    return a[..., 0:1] * b[..., 0:1] + a[..., 1:2] * b[..., 1:2] + a[..., 2:3] * b[..., 2:3]


def unit(v):
    return v / np.sqrt(dot(v, v))


# --- surfaces ---------------------------------------------------------------------------------------------------------


def geodesic_sphere(frequency):
    """Unit sphere of 20 f^2 triangles: an icosahedron, each face cut into f^2 and pushed out. -> directions, faces"""
    g = (1 + np.sqrt(5.0)) / 2
    corners = np.array(
        [[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g]]
        + [[0, -1, -g], [0, 1, -g], [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]]
    )
    around_top = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11]]
    upper_belt = [[1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6], [7, 1, 8]]
    lower_belt = [[4, 9, 5], [2, 4, 11], [6, 2, 10], [8, 6, 7], [9, 8, 1]]
    around_bottom = [[3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9]]

    points, faces = [], []
    for a, b, c in corners[around_top + upper_belt + lower_belt + around_bottom]:
        first = len(points)
        row_start = [first + i * (i + 1) // 2 for i in range(frequency + 1)]
        for i in range(frequency + 1):
            for j in range(i + 1):
                points.append(((frequency - i) * a + (i - j) * b + j * c) / frequency)
        for i in range(frequency):
            for j in range(i + 1):
                here, below = row_start[i] + j, row_start[i + 1] + j
                faces.append([here, below, below + 1])
                if j < i:
                    faces.append([here, below + 1, here + 1])

    # Neighbouring faces make their common edge twice, an ulp apart: merge what agrees to nine decimals.
    _, keep, same = np.unique(np.round(points, 9) + 0.0, axis=0, return_index=True, return_inverse=True)
    return unit(np.array(points)[keep]), same.reshape(-1)[np.array(faces)]


def ring_sphere(rings):
    """Unit sphere of 8 r^2 triangles: r rings of 4, 8, 12... vertices from a pole to the equator. -> directions, faces

    The triangles are of nearly one size, without the slivers that meridians make at the poles.
    """
    sizes = [max(1, 4 * min(k, 2 * rings - k)) for k in range(2 * rings + 1)]
    starts = np.cumsum([0, *sizes])
    directions = []
    for k, size in enumerate(sizes):
        c, s = cos_sin(np.arange(size) / size)
        cos_polar, sin_polar = cos_sin(k / (4 * rings))
        directions.append(np.stack([sin_polar * c, np.full(size, cos_polar), sin_polar * s], axis=-1))

    faces = []
    for k in range(2 * rings):
        small, large = (k, k + 1) if k < rings else (k + 1, k)
        inner = sizes[small] // 4  # steps of the smaller ring in a quarter; the larger ring has one more

        def vertex(ring, quarter, step):
            per_quarter = sizes[ring] // 4
            return starts[ring] + (quarter * per_quarter + step) % sizes[ring]

        for quarter in range(4):
            for j in range(inner + 1):
                a, b, c = vertex(small, quarter, j), vertex(large, quarter, j), vertex(large, quarter, j + 1)
                faces.append([a, c, b] if small == k else [a, b, c])
                if j < inner:
                    d = vertex(small, quarter, j + 1)
                    faces.append([a, d, c] if small == k else [a, c, d])
    return np.concatenate(directions), np.array(faces)


# The blob's waves: wave vector, phase in turns, amplitude. Four broad ones for the shape, eight fine ones for detail.
BLOB_WAVES = np.array(
    [
        [0.31, 0.12, 0.20, 0.10, 0.100],
        [-0.18, 0.34, 0.11, 0.65, 0.090],
        [0.09, -0.21, 0.41, 0.30, 0.080],
        [0.44, 0.27, -0.32, 0.85, 0.070],
        [1.10, 0.60, -0.75, 0.20, 0.040],
        [-0.85, 1.15, 0.55, 0.55, 0.040],
        [0.50, -1.05, 1.10, 0.90, 0.035],
        [1.45, 0.35, 0.80, 0.40, 0.030],
        [2.70, -1.30, 0.90, 0.15, 0.009],
        [-1.20, 2.40, 1.70, 0.70, 0.009],
        [0.80, 1.60, -2.60, 0.35, 0.009],
        [-2.20, -0.90, -2.10, 0.05, 0.008],
    ]
)
BLOB_RADIUS = 1.1
BLOB_SHIFT = np.array([-0.065, -0.04, 0.0])  # brings it to the middle of the view


def blob(rings):
    """The star-shaped surface p = r(d) d,  r(d) = R (1 + sum_i a_i sin 2 pi (k_i . d + phase_i)),  with its normals.

    With g the gradient of r across the unit sphere, the normal is along r d - g.
    """
    d, faces = ring_sphere(rings)
    r = np.full((len(d), 1), BLOB_RADIUS)
    gradient = np.zeros_like(d)
    for kx, ky, kz, phase, amplitude in BLOB_WAVES:
        k = np.array([kx, ky, kz])
        c, s = cos_sin(dot(d, k) + phase)
        r = r + BLOB_RADIUS * amplitude * s
        gradient = gradient + BLOB_RADIUS * amplitude * c * 2 * np.pi * k
    gradient = gradient - dot(gradient, d) * d
    return r * d, unit(r * d - gradient), faces


def torus_knot(around, across, major=0.76, minor=0.34, tube=0.17):
    """Tube around the (2, 3) torus knot, the trefoil. -> points, normals, quads

    The knot winds twice about the z axis and three times through the torus' hole. The torus' own normal is
    perpendicular to the knot everywhere and returns to itself, so it serves as the tube's frame.
    """
    t = np.arange(around) / around
    c2, s2 = cos_sin(2 * t)
    c3, s3 = cos_sin(3 * t)

    rho = major + minor * c3
    centre = np.stack([rho * c2, rho * s2, minor * s3], axis=-1)
    drho = -3 * minor * s3
    tangent = unit(np.stack([drho * c2 - 2 * rho * s2, drho * s2 + 2 * rho * c2, 3 * minor * c3], axis=-1))
    outward = np.stack([c3 * c2, c3 * s2, s3], axis=-1)
    sideways = unit(np.cross(tangent, outward))

    c, s = cos_sin(np.arange(across) / across)
    normals = c[:, None] * outward[:, None] + s[:, None] * sideways[:, None]
    points = centre[:, None] + tube * normals

    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    i_next, j_next = (i + 1) % around, (j + 1) % across
    quads = np.stack([i * across + j, i * across + j_next, i_next * across + j_next, i_next * across + j], axis=-1)
    return points.reshape(-1, 3), normals.reshape(-1, 3), quads.reshape(-1, 4)


# --- file formats -----------------------------------------------------------------------------------------------------


def decimal(x, places=6):
    """Fixed-point text without trailing zeros and without a negative zero."""
    return f"{round(float(x), places) + 0.0:.{places}f}".rstrip("0").rstrip(".")


def obj_rows(key, rows, places):
    return [f"{key} " + " ".join(decimal(x, places) for x in row) for row in rows]


def obj_text(name, header, vertices, groups, normals=None, places=6):
    """OBJ. groups: (material, faces with 0-based indices); a vertex and its normal have the same index."""
    lines = [f"# {line}".rstrip() for line in header.strip().splitlines()]
    lines.append(f"mtllib {name}.mtl")
    lines += obj_rows("v", vertices, places)
    if normals is not None:
        lines += obj_rows("vn", normals, places)
    for material, faces in groups:
        lines += [f"g {material}", f"usemtl {material}"]
        for face in faces:
            ids = [int(i) + 1 for i in face]
            lines.append("f " + " ".join(str(i) if normals is None else f"{i}//{i}" for i in ids))
    return ("\n".join(lines) + "\n").encode("ascii")


def mtl_text(materials):
    """MTL. materials: name -> {key: number or triple}."""
    lines = []
    for name, entries in materials.items():
        lines.append(f"newmtl {name}")
        for key, value in entries.items():
            lines.append(f"{key} " + " ".join(f"{x:g}".replace("e+", "e") for x in np.atleast_1d(value)))
        lines.append("")
    return "\n".join(lines).encode("ascii")


def ply_bytes(comment, points, normals, faces):
    """Binary little-endian PLY with float32 positions and normals. 16-bit indices: up to 65,536 vertices."""
    if len(points) > 65536:
        raise ValueError(f"{len(points)} vertices do not fit 16-bit indices")
    header = ["ply", "format binary_little_endian 1.0", f"comment {comment}", f"element vertex {len(points)}"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    header += [f"element face {len(faces)}", "property list uchar ushort vertex_indices", "end_header"]
    vertex_data = np.round(np.hstack([points, normals]), 7) + 0.0
    face_data = np.empty(len(faces), dtype=[("count", "u1"), ("ids", "<u2", 3)])
    face_data["count"], face_data["ids"] = 3, faces
    return ("\n".join(header) + "\n").encode("ascii") + vertex_data.astype("<f4").tobytes() + face_data.tobytes()


# --- scenes -----------------------------------------------------------------------------------------------------------

# Cornell University Program of Computer Graphics, "Cornell Box Data"
# (www.graphics.cornell.edu/online/box/data.html): corners in millimetres, in the published order.
CORNELL_QUADS = [
    ("floor", [[552.8, 0, 0], [0, 0, 0], [0, 0, 559.2], [549.6, 0, 559.2]]),
    ("ceiling", [[556, 548.8, 0], [556, 548.8, 559.2], [0, 548.8, 559.2], [0, 548.8, 0]]),
    ("back_wall", [[549.6, 0, 559.2], [0, 0, 559.2], [0, 548.8, 559.2], [556, 548.8, 559.2]]),
    ("right_wall", [[0, 0, 559.2], [0, 0, 0], [0, 548.8, 0], [0, 548.8, 559.2]]),
    ("left_wall", [[552.8, 0, 0], [549.6, 0, 559.2], [556, 548.8, 559.2], [556, 548.8, 0]]),
    ("short_box", [[130, 165, 65], [82, 165, 225], [240, 165, 272], [290, 165, 114]]),
    ("short_box", [[290, 0, 114], [290, 165, 114], [240, 165, 272], [240, 0, 272]]),
    ("short_box", [[130, 0, 65], [130, 165, 65], [290, 165, 114], [290, 0, 114]]),
    ("short_box", [[82, 0, 225], [82, 165, 225], [130, 165, 65], [130, 0, 65]]),
    ("short_box", [[240, 0, 272], [240, 165, 272], [82, 165, 225], [82, 0, 225]]),
    ("tall_box", [[423, 330, 247], [265, 330, 296], [314, 330, 456], [472, 330, 406]]),
    ("tall_box", [[423, 0, 247], [423, 330, 247], [472, 330, 406], [472, 0, 406]]),
    ("tall_box", [[472, 0, 406], [472, 330, 406], [314, 330, 456], [314, 0, 456]]),
    ("tall_box", [[314, 0, 456], [314, 330, 456], [265, 330, 296], [265, 0, 296]]),
    ("tall_box", [[265, 0, 296], [265, 330, 296], [423, 330, 247], [423, 0, 247]]),
    ("lamp", [[343, 548.8, 227], [343, 548.8, 332], [213, 548.8, 332], [213, 548.8, 227]]),
]
CORNELL_SCALE = 2 / 548.8  # the room becomes 2 units high
CORNELL_OPENING = 1.15  # z of the open side: from z = 3, at fov 60, the opening fills 95 % of the picture's width

# Usual RGB approximations of the measured reflectance spectra and of the lamp's emission.
WHITE, RED, GREEN = (0.725, 0.71, 0.68), (0.63, 0.065, 0.05), (0.14, 0.45, 0.091)
CORNELL_MATERIALS = {
    "floor": {"Kd": WHITE, "Ns": 1},
    "ceiling": {"Kd": WHITE, "Ns": 1},
    "back_wall": {"Kd": WHITE, "Ns": 1},
    "right_wall": {"Kd": GREEN, "Ns": 1},
    "left_wall": {"Kd": RED, "Ns": 1},
    "short_box": {"Kd": WHITE, "Ns": 1},
    "tall_box": {"Kd": WHITE, "Ns": 1},
    "lamp": {"Kd": (0.78, 0.78, 0.78), "Ke": (17, 12, 4), "Ns": 1},
}
CORNELL_HEADER = """
The Cornell box, as measured: Cornell University Program of Computer Graphics, "Cornell Box Data",
www.graphics.cornell.edu/online/box/data.html

With X Y Z the published millimetres and s = 2 / 548.8:   x = s (278 - X)   y = s Y   z = 1.15 - s Z
a half turn about y, a uniform scale and a shift. The data stay right-handed, y up; the open side faces +z.
A right-handed camera at (0, 1, 3) looking along -z shows the published picture, red wall on the left.
A camera with x = up cross z (A1-6), the default of this renderer, shows it mirrored, red on the right;
handedness="right" shows it as published.

Differences from the published data:
- The published lamp lies in the plane of the ceiling. Here the ceiling is a frame of four quads around the
  lamp, sharing its corners, so that no ray meets two surfaces at one distance.
- As published, the blocks have no bottoms; the floor is whole below them.
The measured left wall is not quite flat: its two triangles meet at a small angle.
"""


def in_the_box(millimetres):
    """Published millimetres -> coordinates of the scene."""
    mm = np.array(millimetres, dtype=np.float64)
    return np.stack([278 - mm[:, 0], mm[:, 1], -mm[:, 2]], axis=-1) * CORNELL_SCALE + [0, 0, CORNELL_OPENING]


def cornell_box():
    quads = []
    corners = {name: quad for name, quad in CORNELL_QUADS if name in ("ceiling", "lamp")}
    for material, quad in CORNELL_QUADS:
        if material == "ceiling":
            outer, inner = quad, corners["lamp"]
            for k in range(4):
                quads.append((material, [outer[k], outer[(k + 1) % 4], inner[(k + 1) % 4], inner[k]]))
        else:
            quads.append((material, quad))

    index = {}
    groups = {name: [] for name in CORNELL_MATERIALS}
    for material, quad in quads:
        groups[material].append([index.setdefault(tuple(corner), len(index)) for corner in quad])

    vertices = in_the_box(list(index))
    return {
        "cornell_box.obj": obj_text("cornell_box", CORNELL_HEADER, vertices, groups.items()),
        "cornell_box.mtl": mtl_text(CORNELL_MATERIALS),
    }


def specular_spheres():
    """Three equal spheres that differ in the Phong exponent only."""
    exponents = {"diffuse": 1, "phong": 50, "mirror": 1e21}
    directions, faces = geodesic_sphere(7)
    vertices, groups = [], []
    for i, name in enumerate(exponents):
        vertices.append(0.48 * directions + CENTRE + [1.08 * (i - 1), 0, 0])
        groups.append((name, faces + i * len(directions)))
    header = f"""
Three spheres of radius 0.48 and {len(faces)} triangles, with exact normals: diffuse (Ns 1) at x = -1.08,
Phong (Ns 50) at x = 0, mirror (Ns 1e21) at x = 1.08. Kd, the reflectance, is 0.8 for all three.
"""
    normals = np.concatenate([directions] * 3)
    return {
        "specular_spheres.obj": obj_text("specular_spheres", header, np.concatenate(vertices), groups, normals),
        "specular_spheres.mtl": mtl_text({name: {"Kd": (0.8, 0.8, 0.8), "Ns": ns} for name, ns in exponents.items()}),
    }


def cube():
    """Edge 2, centred at (0, 1, 0), without normals. Vertex i is at x, y, z = low or high by bits 0, 1, 2 of i."""
    vertices = [[2 * (i & 1) - 1, 2 * (i >> 1 & 1), 2 * (i >> 2 & 1) - 1] for i in range(8)]
    quads = {
        "plus_x": [1, 3, 7, 5],
        "minus_x": [0, 4, 6, 2],
        "plus_y": [2, 6, 7, 3],
        "minus_y": [0, 1, 5, 4],
        "plus_z": [4, 5, 7, 6],
        "minus_z": [0, 2, 3, 1],
    }
    colours = {
        "plus_x": (0.8, 0.2, 0.2),
        "minus_x": (0.3, 0.1, 0.1),
        "plus_y": (0.2, 0.8, 0.2),
        "minus_y": (0.1, 0.3, 0.1),
        "plus_z": (0.2, 0.2, 0.8),
        "minus_z": (0.1, 0.1, 0.3),
    }
    header = """
Cube of edge 2 centred at (0, 1, 0): 12 triangles, no normals in the file, one material for each side.
"""
    groups = [(name, [[a, b, c], [a, c, d]]) for name, (a, b, c, d) in quads.items()]
    return {
        "cube.obj": obj_text("cube", header, vertices, groups),
        "cube.mtl": mtl_text({name: {"Kd": kd, "Ns": 1} for name, kd in colours.items()}),
    }


def sphere():
    directions, faces = geodesic_sphere(16)
    header = f"""
Sphere of radius 1 centred at (0, 1, 0): {len(faces)} triangles, exact normals, vertices on the sphere.
"""
    return {
        "sphere.obj": obj_text("sphere", header, directions + CENTRE, [("sphere", faces)], directions),
        "sphere.mtl": mtl_text({"sphere": {"Kd": (0.8, 0.8, 0.8), "Ns": 1}}),
    }


def knot():
    points, normals, quads = torus_knot(250, 40)
    header = f"""
Tube around the (2, 3) torus knot, the trefoil: {len(quads)} quads = {2 * len(quads)} triangles, exact normals.
"""
    return {
        "torus_knot.obj": obj_text("torus_knot", header, points + CENTRE, [("knot", quads)], normals, places=5),
        "torus_knot.mtl": mtl_text({"knot": {"Kd": (0.75, 0.55, 0.3), "Ns": 50}}),
    }


def blob_ply():
    points, normals, faces = blob(100)
    comment = f"star-shaped closed surface, {len(faces)} triangles, analytic normals"
    return {"blob.ply": ply_bytes(comment, points + CENTRE + BLOB_SHIFT, normals, faces)}


# --- scenes in which light bounces ------------------------------------------------------------------------------------


def joined(pieces):
    """(material, points, normals or None, faces) of each piece -> points, normals, groups as for ``obj_text``.

    Pieces without normals get those of their first three corners: they have to be flat.
    """
    points, normals, groups, first = [], [], [], 0
    for material, p, n, faces in pieces:
        p = np.asarray(p, dtype=np.float64)
        if n is None:
            n = np.tile(unit(np.cross(p[1] - p[0], p[2] - p[0])), (len(p), 1))
        points.append(p)
        normals.append(n)
        groups.append((material, np.asarray(faces) + first))
        first += len(p)
    return np.concatenate(points), np.concatenate(normals), groups


def flat(material, corners):
    """A polygon as a piece of ``joined``."""
    return material, corners, None, [list(range(len(corners)))]


# The plates of Veach and Guibas, "Optimally combining sampling techniques for Monte Carlo rendering", SIGGRAPH 1995,
# seen as in the course (A3-5): eye (0, 5.5, 4.5), at (0, 2, -1.5), 1024 x 512 pixels.
VEACH_EYE = np.array([0.0, 5.5, 4.5])
VEACH_LIGHTS = np.array([0.0, 3.0, -5.75])  # the middle of the row
VEACH_RADII = (0.04, 0.12, 0.36, 0.95)
VEACH_TINTS = ((0.9, 0.95, 1.25), (0.85, 1.06, 0.95), (1.15, 0.99, 0.62), (1.3, 0.9, 0.85))
VEACH_INTENSITY = 9.0  # pi r^2 Ke of every light
VEACH_PLATES = {  # exponent; y and z of the middle; half of the depth and of the width
    "plate_1e1": (10, 1.7, -4.7, 0.65, 6.4),
    "plate_1e3": (1e3, 1.5, -2.45, 0.55, 5.2),
    "plate_1e4": (1e4, 1.45, -0.95, 0.5, 4.4),
    "plate_1e6": (1e6, 1.45, 0.15, 0.45, 3.7),
}


def veach_plates():
    materials, pieces = {"room": {"Kd": (0.4, 0.4, 0.4), "Ns": 1}}, []
    pieces.append(flat("room", [[-20, -0.6, 6], [20, -0.6, 6], [20, -0.6, -9], [-20, -0.6, -9]]))
    pieces.append(flat("room", [[-20, -0.6, -9], [20, -0.6, -9], [20, 9, -9], [-20, 9, -9]]))
    for name, (exponent, y, z, half_depth, half_width) in VEACH_PLATES.items():
        centre = np.array([0, y, z])
        normal = unit(unit(VEACH_EYE - centre) + unit(VEACH_LIGHTS - centre))  # the middle mirrors the lights
        deep, wide = half_depth * np.array([0, -normal[2], normal[1]]), np.array([half_width, 0, 0])
        pieces.append(
            flat(name, [centre - wide + deep, centre + wide + deep, centre + wide - deep, centre - wide - deep])
        )
        materials[name] = {"Kd": (0.6, 0.6, 0.6), "Ns": exponent}
    directions, faces = geodesic_sphere(5)
    for i, (radius, tint) in enumerate(zip(VEACH_RADII, VEACH_TINTS, strict=True)):
        centre = VEACH_LIGHTS + [4.4 * i - 6.6, 0, 0]
        name = f"light_{i + 1}"
        pieces.append((name, radius * directions + centre, directions, faces))
        radiance = VEACH_INTENSITY / (np.pi * radius * radius)
        materials[name] = {"Kd": (0, 0, 0), "Ke": tuple(round(radiance * c, 3) for c in tint), "Ns": 1}
    header = f"""
Four glossy plates under four lights, after Veach and Guibas, "Optimally combining sampling techniques for Monte
Carlo rendering", SIGGRAPH 1995, seen as in the course: eye (0, 5.5, 4.5), at (0, 2, -1.5), 1024 x 512, with fov 45.
The Phong exponents of the plates are 10, 1e3, 1e4 and 1e6 from the back to the front. Each plate is tilted so that its
middle mirrors the row of lights to the eye. The lights are spheres of {len(faces)} triangles with the radii
{", ".join(f"{r:g}" for r in VEACH_RADII)}; all four have the same radiant intensity, so that the small ones are bright.
"""
    points, normals, groups = joined(pieces)
    return {
        "veach_plates.obj": obj_text("veach_plates", header, points, groups, normals, places=5),
        "veach_plates.mtl": mtl_text(materials),
    }


CAUSTIC_RADIUS, CAUSTIC_CENTRE = 0.42, np.array([0.0, 0.72, 0.05])


def caustic_sphere():
    """The room and the lamp of the Cornell box, and a sphere of glass in place of the blocks."""
    ceiling = np.array(dict(CORNELL_QUADS)["ceiling"])
    lamp = np.array(dict(CORNELL_QUADS)["lamp"])
    pieces, materials = [], {}
    for name, quad in CORNELL_QUADS:
        if name == "ceiling":
            for k in range(4):
                j = (k + 1) % 4
                pieces.append(flat(name, in_the_box([ceiling[k], ceiling[j], lamp[j], lamp[k]])))
        elif "box" not in name:
            pieces.append(flat(name, in_the_box(quad)))
    for name in dict.fromkeys(name for name, *_ in pieces):
        materials[name] = CORNELL_MATERIALS[name]
    directions, faces = geodesic_sphere(16)
    pieces.append(("glass", CAUSTIC_RADIUS * directions + CAUSTIC_CENTRE, directions, faces))
    materials["glass"] = {"Kd": (0.9, 0.9, 0.9), "Ks": (1, 1, 1), "Ns": 1000, "Ni": 1.4, "d": 1, "illum": 7}
    x, y, z = CAUSTIC_CENTRE
    header = f"""
The room and the lamp of cornell_box.obj, and a sphere of {len(faces)} triangles in place of the blocks: radius
{CAUSTIC_RADIUS}, centre ({x:g}, {y:g}, {z:g}), exact normals. Its material is a dielectric (illum 7) with the index of
refraction 1.4; a program that knows no dielectrics can show it as a Phong lobe with Ns 1000. The sphere gathers the
light of the lamp on the floor: a caustic. Source of the room: Cornell University Program of Computer Graphics,
"Cornell Box Data", www.graphics.cornell.edu/online/box/data.html
"""
    points, normals, groups = joined(pieces)
    return {
        "caustic_sphere.obj": obj_text("caustic_sphere", header, points, groups, normals),
        "caustic_sphere.mtl": mtl_text(materials),
    }


def hashed(indices, stream):
    """A number in [0, 1) for each index, by integer arithmetic; other streams give other numbers."""
    x = (np.asarray(indices, dtype=np.uint64) * np.uint64(2654435761) + np.uint64(stream * 40503 + 1)) & np.uint64(
        2**32 - 1
    )
    for multiplier in (0x7FEB352D, 0x846CA68B):
        x = ((x ^ (x >> np.uint64(16))) * np.uint64(multiplier)) & np.uint64(2**32 - 1)
    return (x ^ (x >> np.uint64(15))).astype(np.float64) / 2**32


MANY_LIGHTS = 10_000
MANY_COLOURS = {
    "amber": (1.0, 0.55, 0.12),
    "rose": (1.0, 0.25, 0.35),
    "violet": (0.55, 0.3, 1.0),
    "blue": (0.2, 0.45, 1.0),
    "teal": (0.1, 0.85, 0.75),
    "green": (0.35, 1.0, 0.25),
    "white": (0.9, 0.85, 0.8),
}
MANY_POWERS = (1, 4, 16, 64)  # radiance of a colour's materials, in relation to each other: from the most to the fewest


def many_lights():
    """Small triangles above a ground, each with one of 28 materials."""
    i = np.arange(MANY_LIGHTS)
    # The colours change from place to place, so that each part of the ground is lit by lamps of its own.
    x, z = 3.4 * hashed(i, 1) - 1.7, 3.6 * hashed(i, 2) - 2.6
    y = 0.03 + 0.6 * hashed(i, 3) * hashed(i, 4)
    half = 0.002 + 0.002 * hashed(i, 5)
    c, s = cos_sin(hashed(i, 6))
    across, along = (np.stack(v, axis=-1) * half[:, None] for v in ((c, 0 * c, -s), (s, 0 * c, c)))
    centre = np.stack([x, y, z], axis=-1)
    corners = [centre - across + along, centre + across + along, centre - 1.2 * along]
    corners = [corners[0], corners[2], corners[1]]  # the front looks down

    cx, cz = np.floor(x / 0.85 + 2).astype(int), np.floor((z + 2.6) / 0.9).astype(int)
    colour = (cx * 3 + cz * 5 + (hashed(i, 7) < 0.06) * 2) % len(MANY_COLOURS)
    power = np.floor(-np.log2(np.maximum(hashed(i, 8), 2.0**-11)) / 3).astype(int)  # 7/8 of them are the faintest
    power = np.minimum(power, len(MANY_POWERS) - 1)
    order = np.lexsort((i, power, colour))
    points = np.stack(corners, axis=1)[order].reshape(-1, 3)
    faces = np.arange(3 * MANY_LIGHTS).reshape(-1, 3)
    groups, materials = [], {}
    for a, (name, tint) in enumerate(MANY_COLOURS.items()):
        for b, relative in enumerate(MANY_POWERS):
            chosen = faces[(colour[order] == a) & (power[order] == b)]
            if len(chosen) > 0:
                groups.append((f"{name}_{relative}", chosen))
                ke = tuple(round(50 * relative * t, 3) for t in tint)
                materials[f"{name}_{relative}"] = {"Kd": (0, 0, 0), "Ke": ke, "Ns": 1}

    ground = [[-2.6, 0, 1.2], [2.6, 0, 1.2], [2.6, 0, -3.4], [-2.6, 0, -3.4]]
    points, first = np.concatenate([points, ground]), len(points)
    groups.append(("ground", [[first, first + 1, first + 2, first + 3]]))
    blocks = []
    for x0, z0, width, height, turn in (
        (-0.85, -0.3, 0.3, 0.2, 0.04),
        (0.75, -0.6, 0.34, 0.3, -0.06),
        (-0.05, -1.5, 0.4, 0.4, 0.1),
    ):
        c, s = cos_sin(turn)
        base = len(points)
        foot = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * width / 2
        foot = np.stack([x0 + c * foot[:, 0] - s * foot[:, 1], z0 + s * foot[:, 0] + c * foot[:, 1]], axis=-1)
        low, high = (np.stack([foot[:, 0], np.full(4, y0), foot[:, 1]], axis=-1) for y0 in (0.0, height))
        points = np.concatenate([points, low, high])
        sides = [[k, k + 4, (k + 1) % 4 + 4, (k + 1) % 4] for k in range(4)] + [[4, 7, 6, 5]]
        blocks += [[base + v for v in side] for side in sides]
    groups.append(("block", blocks))
    materials |= {"ground": {"Kd": (0.6, 0.6, 0.6), "Ns": 1}, "block": {"Kd": (0.7, 0.7, 0.7), "Ns": 1}}
    header = f"""
{MANY_LIGHTS} lamps, each a triangle with edges of 4 to 8 thousandths, above a ground with three blocks. They have
{len(MANY_COLOURS)} colours and {len(MANY_POWERS)} radiances; the largest is {MANY_POWERS[-1]} times the smallest.
All of them face the ground: the eye sees their dark backs, and pools of their light below them.
The camera is at (0, 2.4, 1.9) and looks at (0, 0, -0.8), with fov 45.
"""
    return {
        "many_lights.obj": obj_text("many_lights", header, points, groups, places=4),
        "many_lights.mtl": mtl_text(materials),
    }


def white_room():
    """A closed room and a block in it, all of one material: every ray that stays inside sees the same radiance."""
    low, high = np.array([-1.5, 0.0, -1.5]), np.array([1.5, 2.5, 4.0])
    box = np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)])
    outwards = [[1, 3, 7, 5], [0, 4, 6, 2], [2, 6, 7, 3], [0, 1, 5, 4], [4, 5, 7, 6], [0, 2, 3, 1]]
    c, s = cos_sin(0.09)
    block = 0.35 * np.array([[2 * (i >> k & 1) - 1 for k in range(3)] for i in range(8)])
    block = np.stack(
        [c * block[:, 0] + s * block[:, 2], 2 * block[:, 1] + 1.0, c * block[:, 2] - s * block[:, 0]], axis=-1
    )
    faces = [face[::-1] for face in outwards] + [[v + 8 for v in face] for face in outwards]
    header = """
A closed room around the eye of the course's camera, and a block that floats in it. All surfaces have the reflectance
Kd = 3/4 and emit Ke = 1/8. So after k bounces every ray sees the radiance 1/8 (1 + 3/4 + ... + (3/4)^k), which
tends to 1/2: a picture that is right shows one even grey. What is brighter or darker is a mistake.
"""
    return {
        "white_room.obj": obj_text("white_room", header, np.concatenate([box, block]), [("white", faces)]),
        "white_room.mtl": mtl_text({"white": {"Kd": (0.75,) * 3, "Ke": (0.125,) * 3, "Ns": 1}}),
    }


# --- program ----------------------------------------------------------------------------------------------------------


def contents():
    """Path below this folder -> bytes, for every file that is made here."""
    files = {}
    makers = (cornell_box, specular_spheres, cube, sphere, knot, blob_ply)
    makers += (veach_plates, caustic_sphere, many_lights, white_room, environments)
    for make in makers:
        files.update(make())
    files |= still_life((geodesic_sphere, torus_knot), cos_sin, hashed, obj_rows, mtl_text)
    return files | ggx_spheres(ring_sphere) | globe(cos_sin) | forest()


def differences(files):
    """One line for each file on disk that is missing, differs, or is of a made kind but not made here."""
    lines = []
    for name, data in files.items():
        path = FOLDER / name
        if not path.is_file():
            lines.append(f"{name}: missing")
        elif path.read_bytes() != data:
            lines.append(f"{name}: differs from what the script makes")
    for path in sorted(FOLDER.rglob("*")):
        name = path.relative_to(FOLDER).as_posix()
        if path.suffix in (".obj", ".mtl", ".ply", ".glb", ".npy") and name not in files:
            lines.append(f"{name}: not made by the script")
    return lines


def main():
    parser = argparse.ArgumentParser(description="Make the scenes and environments of this folder.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 if a file on disk differs")
    arguments = parser.parse_args()

    files = contents()
    if arguments.check:
        found = differences(files)
        print("\n".join(found) if found else f"{len(files)} files are as the script makes them")
        return 1 if found else 0
    for name, data in files.items():
        path = FOLDER / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(data)
        print(f"{len(data):9,d}  {name}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
