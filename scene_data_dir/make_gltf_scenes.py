"""The two scenes of this folder that are glTF files: what their format says of surfaces, roughness and pictures.

``make_scenes.py`` writes them. Their bytes are the same on every machine: numbers are computed as there, and the
pictures in the files are not compressed, because compressors differ.
"""

import json
import struct
import zlib

import numpy as np

FLOAT, SHORT, BYTES = 5126, 5123, 4  # glTF's numbers of component types; parts of a file begin at multiples of 4

# --- file formats -----------------------------------------------------------------------------------------------------


def png_bytes(indices, palette):
    """PNG of (h, w) indices into a palette of (n, 3) sRGB bytes, whose rows are stored as they are."""
    height, width = indices.shape
    rows = b"".join(b"\0" + row.tobytes() for row in indices.astype(np.uint8))  # 0: no filter
    stored = b"\x78\x01\x01" + struct.pack("<HH", len(rows), len(rows) ^ 0xFFFF) + rows
    data = stored + struct.pack(">I", zlib.adler32(rows))
    chunks = {b"IHDR": struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)}
    chunks |= {b"PLTE": np.asarray(palette, np.uint8).tobytes(), b"IDAT": data, b"IEND": b""}
    parts = [struct.pack(">I", len(c)) + k + c + struct.pack(">I", zlib.crc32(k + c)) for k, c in chunks.items()]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


class Glb:
    """The arrays and pictures of a GLB file, which its JSON names by their numbers."""

    def __init__(self):
        self.views, self.accessors, self.images = [], [], []

    def array(self, rows, is_position=False):
        """-> the number of an array: float32 vectors, or 16-bit indices."""
        rows = np.asarray(rows)
        is_index = rows.ndim == 1
        data = rows.astype("<u2" if is_index else "<f4")
        kind = "SCALAR" if is_index else f"VEC{rows.shape[1]}"
        entry = {"bufferView": len(self.views), "componentType": SHORT if is_index else FLOAT, "count": len(rows)}
        if is_position:
            entry |= {"min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist()}
        self.views.append(data.tobytes())
        self.accessors.append(entry | {"type": kind})
        return len(self.accessors) - 1

    def picture(self, png):
        """-> the number of a picture, which is also that of a texture that repeats it."""
        self.images.append({"bufferView": len(self.views), "mimeType": "image/png"})
        self.views.append(png)
        return len(self.images) - 1

    def shape(self, points, normals, faces, uv=None):
        """-> the attributes and the indices of triangles, as a primitive has them."""
        attributes = {"POSITION": self.array(points, is_position=True), "NORMAL": self.array(normals)}
        if uv is not None:
            attributes["TEXCOORD_0"] = self.array(uv)
        return {"attributes": attributes, "indices": self.array(np.ravel(faces))}

    def to_bytes(self, comment, parts, materials):
        """parts: (name, primitive, number of its material, node) -> the file, with one mesh and one node for each."""
        data, places = b"", []
        for view in self.views:
            places.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(view)})
            data += view + b"\0" * (-len(view) % BYTES)
        content = {
            "asset": {"version": "2.0", "generator": "make_scenes.py", "extras": {"comment": comment}},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(parts)))}],
            "nodes": [{"mesh": i, **node} for i, (_, _, _, node) in enumerate(parts)],
            "meshes": [{"name": name, "primitives": [{**shape, "material": m}]} for name, shape, m, _ in parts],
            "materials": materials,
            "accessors": self.accessors,
            "bufferViews": places,
            "buffers": [{"byteLength": len(data)}],
        }
        if self.images:
            content |= {"images": self.images, "textures": [{"source": i} for i in range(len(self.images))]}
        text = json.dumps(content, separators=(",", ":")).encode("ascii")
        text += b" " * (-len(text) % BYTES)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


# --- scenes -----------------------------------------------------------------------------------------------------------

ROUGHNESS, METALNESS = (0.1, 0.2, 0.4, 0.6, 0.8, 1.0), (1.0, 0.5, 0.0)  # columns, and rows from the top
SPHERE_COLOUR = (0.95, 0.62, 0.25)
SPHERE_RADIUS, SPHERE_STEP = 0.22, 0.5


def ggx_spheres(ring_sphere):
    """Equal spheres; the roughness grows from column to column, and the metalness from row to row."""
    directions, faces = ring_sphere(8)
    glb, parts, materials = Glb(), [], []
    shape = glb.shape(SPHERE_RADIUS * directions, directions, faces)
    for j, metal in enumerate(METALNESS):
        for i, rough in enumerate(ROUGHNESS):
            name = f"roughness {rough:g}, metalness {metal:g}"
            look = {"baseColorFactor": [*SPHERE_COLOUR, 1], "metallicFactor": metal, "roughnessFactor": rough}
            place = [SPHERE_STEP * (2.5 - i), 1 + SPHERE_STEP * (1 - j), 0]  # the camera mirrors x (A1-6)
            parts.append((name, shape, len(materials), {"translation": place}))
            materials.append({"name": name, "pbrMetallicRoughness": look})
    comment = "Spheres of one colour: roughness 0.1 to 1 towards -x, metalness 0 to 1 towards +y."
    return {"ggx_spheres.glb": glb.to_bytes(comment, parts, materials)}


# Height of the globe's ground: wave vector, phase in turns, amplitude. Above LAND, there is land.
GROUND_WAVES = np.array(
    [
        [0.27, 0.15, 0.32, 0.12, 1.0],
        [-0.38, 0.28, 0.21, 0.71, 0.8],
        [0.52, -0.47, 0.58, 0.34, 0.5],
        [-0.75, 0.66, -0.72, 0.93, 0.35],
        [1.35, 1.10, -0.95, 0.22, 0.2],
        [-1.60, 1.25, 1.45, 0.58, 0.15],
    ]
)
LAND, ICE = 0.25, 0.87  # ICE: of |y|
LEVELS = (-0.7, -0.1, LAND, 0.4, 0.95, 1.55)  # deep sea, sea, shallows, beach, meadow, forest, rock; and ice
COLOURS = [(12, 38, 92), (20, 66, 134), (56, 124, 168), (214, 196, 142)]
COLOURS += [(112, 152, 70), (52, 102, 52), (128, 112, 96), (236, 240, 244)]
ROUGH = (0.35, 0.35, 0.4, 0.9, 0.9, 1.0, 0.8, 0.6)  # of each of them
TEXELS = (48, 96)
CHECKS, TILES = [(196, 188, 176), (92, 84, 80)], 8  # of the floor: two colours, and pairs of tiles in each direction


def globe(cos_sin):
    """A globe above a floor: one picture has its colours, another one its roughness, and a third one is repeated."""
    (height, width), (rows, columns) = TEXELS, (12, 24)

    def on_sphere(down, along):
        """Directions at fractions of the way from the north pole to the south pole, and around eastwards."""
        (c, s), (polar, ring) = cos_sin(along), cos_sin(down / 2)
        return np.stack(np.broadcast_arrays(ring * c, polar, -ring * s), axis=-1)

    down, along = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width, indexing="ij")
    d, ground = on_sphere(down, along), np.zeros(TEXELS)
    for kx, ky, kz, phase, amplitude in GROUND_WAVES:
        _, s = cos_sin(kx * d[..., 0] + ky * d[..., 1] + kz * d[..., 2] + phase)
        ground = ground + amplitude * s
    kinds = np.searchsorted(LEVELS, ground)
    kinds[np.abs(d[..., 1]) + 0.03 * ground > ICE] = len(COLOURS) - 1

    glb = Glb()
    colours = glb.picture(png_bytes(kinds, COLOURS))
    layer = glb.picture(png_bytes(kinds, [(0, round(255 * rough), 0) for rough in ROUGH]))
    checks = glb.picture(png_bytes((np.indices((8, 8)) // 4).sum(axis=0) % 2, CHECKS))

    v, u = np.meshgrid(np.arange(rows + 1) / rows, np.arange(columns + 1) / columns, indexing="ij")
    directions, uv = on_sphere(v, u).reshape(-1, 3), np.stack([u, v], axis=-1).reshape(-1, 2)
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    a = i * (columns + 1) + j
    upper, lower = np.stack([a, a + columns + 1, a + columns + 2], -1), np.stack([a, a + columns + 2, a + 1], -1)
    faces = np.concatenate([upper[:-1].reshape(-1, 3), lower[1:].reshape(-1, 3)])
    half = 2.5
    floor = [[-half, 0, half], [half, 0, half], [half, 0, -half], [-half, 0, -half]]
    corners = np.array([[0, 1], [1, 1], [1, 0], [0, 0]]) * TILES
    parts = [
        ("globe", glb.shape(0.9 * directions, directions, faces, uv), 0, {"translation": [0, 1, 0]}),
        ("floor", glb.shape(floor, [[0, 1, 0]] * 4, [[0, 1, 2], [0, 2, 3]], corners), 1, {}),
    ]
    look = {"baseColorTexture": {"index": colours}, "metallicRoughnessTexture": {"index": layer}, "metallicFactor": 0}
    tiles = {"baseColorTexture": {"index": checks}, "metallicFactor": 0, "roughnessFactor": 0.6}
    materials = [{"name": "globe", "pbrMetallicRoughness": look}, {"name": "floor", "pbrMetallicRoughness": tiles}]
    comment = "A globe of radius 0.9 above a floor of tiles; its picture of roughness makes the sea shine."
    return {"globe.glb": glb.to_bytes(comment, parts, materials)}
