"""OBJ and MTL in the few lines that the shipped files need: an oracle that shares no code with the package."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass
class TinyObj:
    """Polygons with 0-based indices; normal_ids is empty for a polygon without normals."""

    vertices: np.ndarray  # (n, 3) float64
    normals: np.ndarray  # (m, 3) float64
    polygons: list[list[int]]
    normal_ids: list[list[int]]
    materials: list[str]  # one for each polygon
    mtllib: str

    def triangles(self, material=None):
        """Fans from each polygon's first corner. -> (t, 3) vertex indices"""
        chosen = [p for p, m in zip(self.polygons, self.materials, strict=True) if material in (None, m)]
        return np.array([[p[0], p[i], p[i + 1]] for p in chosen for i in range(1, len(p) - 1)])

    def triangle_materials(self):
        return [m for p, m in zip(self.polygons, self.materials, strict=True) for _ in range(len(p) - 2)]


def read_obj(path):
    vertices, normals, polygons, normal_ids, materials = [], [], [], [], []
    material = mtllib = ""
    for line in Path(path).read_text(encoding="ascii").splitlines():
        key, *words = line.split() or [""]
        if key == "v":
            vertices.append([float(w) for w in words])
        elif key == "vn":
            normals.append([float(w) for w in words])
        elif key == "f":
            corners = [w.split("/") for w in words]
            polygons.append([int(c[0]) - 1 for c in corners])
            normal_ids.append([int(c[2]) - 1 for c in corners if len(c) == 3])
            materials.append(material)
        elif key == "usemtl":
            material = words[0]
        elif key == "mtllib":
            mtllib = words[0]
        elif key not in ("", "#", "g"):
            raise ValueError(f"{path}: unexpected {key!r}")
    return TinyObj(np.array(vertices), np.array(normals), polygons, normal_ids, materials, mtllib)


def read_mtl(path):
    """Material name -> {key: list of numbers}."""
    materials = {}
    for line in Path(path).read_text(encoding="ascii").splitlines():
        key, *words = line.split() or [""]
        if key == "newmtl":
            materials[words[0]] = current = {}
        elif key:
            current[key] = [float(w) for w in words]
    return materials
