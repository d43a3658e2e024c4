"""The six views of A1-15, in float64, from what the rays hit."""

import numpy as np


def colors(directions, ids, t, u, v, vertices, faces, normals, face_normals, face_materials):
    """View name → (N, 3) colours."""
    hit = ids >= 0
    face = np.asarray(faces)[ids]
    v0, v1, v2 = (np.asarray(vertices, np.float64)[face[:, k]] for k in range(3))
    geometric = np.cross(v1 - v0, v2 - v0)
    geometric /= np.linalg.norm(geometric, axis=1, keepdims=True)
    back = (directions * geometric).sum(1) > 0
    n = geometric
    if len(face_normals) > 0:
        corner = np.asarray(face_normals)[ids]
        n0, n1, n2 = (np.asarray(normals, np.float64)[corner[:, k]] for k in range(3))
        smooth = (1 - u - v)[:, None] * n0 + u[:, None] * n1 + v[:, None] * n2
        smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
        n = np.where((corner >= 0).all(1)[:, None], smooth, geometric)
    n = np.where(back[:, None], -n, n)

    def id_color(i):
        return ((i + 1)[:, None] * np.array([3.14159265, 6.62607015, 2.71828182])) % 1

    pictures = {
        "hit": np.where(back[:, None], [0.5, 0, 0], [1.0, 1, 1]),
        "triangle_id": id_color(ids),
        "distance": np.repeat(np.clip(t / 10, 0, 1)[:, None], 3, axis=1),
        "barycentric": np.stack([u, v, 1 - u - v], axis=1),
        "normal": (n + 1) / 2,
        "material_id": id_color(np.asarray(face_materials)[ids]),
    }
    return {name: np.where(hit[:, None], picture, 0) for name, picture in pictures.items()}
