"""Meshes of any size: a closed, displaced sphere with details at three scales."""

import numpy as np

SIZES = (20_000, 82_000, 512_000, 1_300_000)


def displaced_sphere(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """(V, 3) float64 vertices and (F, 3) int32 faces, about ``triangles`` of them; the radius is 1 ± 0.2."""
    columns = round(np.sqrt(triangles))
    rows = columns // 2 + 1
    theta, phi = np.meshgrid(
        np.linspace(0, np.pi, rows + 1), np.linspace(0, 2 * np.pi, columns, endpoint=False), indexing="ij"
    )
    radius = 1 + 0.15 * np.sin(5 * theta) * np.cos(7 * phi)
    radius += 0.05 * np.sin(23 * theta) * np.cos(17 * phi) + 0.017 * np.sin(61 * theta) * np.cos(71 * phi)
    direction = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=-1)
    row, column = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    a, b = row * columns + column, row * columns + (column + 1) % columns
    c, d = a + columns, b + columns
    upper = np.stack([a, b, c], axis=-1)[1:].reshape(-1, 3)
    lower = np.stack([b, d, c], axis=-1)[:-1].reshape(-1, 3)
    vertices = (radius[..., None] * direction).reshape(-1, 3)
    return vertices, np.concatenate([upper, lower]).astype(np.int32)


def write_ply(path: str, vertices: np.ndarray, faces: np.ndarray) -> None:
    """A binary PLY file of a mesh, with vertices in f32."""
    rows = np.empty(len(faces), [("count", "u1"), ("ids", "<i4", 3)])
    rows["count"], rows["ids"] = 3, faces
    axes = "".join(f"property float {axis}\n" for axis in "xyz")
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{axes}"
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    with open(path, "wb") as file:
        file.write(head.encode())
        file.write(vertices.astype("<f4").tobytes())
        file.write(rows.tobytes())


def from_arguments(arguments: list[str]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Name → mesh for every argument: a number of triangles, or a file. Without arguments, the usual sizes."""
    meshes = {}
    for argument in arguments or [str(size) for size in SIZES]:
        if argument.replace("_", "").isdigit():
            vertices, faces = displaced_sphere(int(argument))
        else:
            from taichi_tracer.files import read

            mesh = read(argument)
            vertices, faces = mesh.vertices, mesh.faces
        meshes[f"{len(faces):,} triangles"] = vertices, faces
    return meshes
