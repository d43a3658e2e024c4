from abc import ABC, abstractmethod
from typing import List
import taichi as ti
import taichi.math as tm
import numpy as np

from .geometry import Geometry
from .ray import Ray, HitData


@ti.data_oriented
class RayIntersector(ABC):
    def __init__(self, geometry: Geometry) -> None:
        self.EPSILON = 1e-7
        self.geometry = geometry

    @abstractmethod
    @ti.func
    def query_ray(ray: Ray) -> HitData:
        pass

    @ti.func
    def intersect_triangle(self, ray: Ray, triangle_id: int) -> HitData:
        hit_data = HitData()

        # Grab Vertices
        vert_ids = self.geometry.triangle_vertex_ids[triangle_id-1] - 1 # Vertices are indexed from 1
        v0 = self.geometry.vertices[vert_ids[0]]
        v1 = self.geometry.vertices[vert_ids[1]]
        v2 = self.geometry.vertices[vert_ids[2]]

        # Normals at the Vertices
        normal_indices = self.geometry.triangle_normal_ids[triangle_id-1]-1 # Normals are indexed from 1
        n0 = self.geometry.normals[normal_indices[0]]
        n1 = self.geometry.normals[normal_indices[1]]
        n2 = self.geometry.normals[normal_indices[2]]

        # Material of the triangle
        material_id = self.geometry.triangle_material_ids[triangle_id-1]
        e1 = v1 - v0
        e2 = v2 - v0
        p = tm.cross(ray.direction, e2)
        det = e1.dot(p)
        if ti.abs(det) >= self.EPSILON:
            inv = 1.0 / det
            s = ray.origin - v0
            u = s.dot(p) * inv
            q = tm.cross(s, e1)
            v = ray.direction.dot(q) * inv
            t = e2.dot(q) * inv
            if 0 <= u <= 1 and v >= 0 and u + v <= 1 and t > self.EPSILON:
                w = 1 - u - v
                normal = tm.normalize(w * n0 + u * n1 + v * n2)
                is_back = det < 0
                if is_back:
                    normal = -normal
                hit_data.is_hit = True
                hit_data.is_backfacing = is_back
                hit_data.triangle_id = triangle_id
                hit_data.distance = t
                hit_data.barycentric_coords = tm.vec2(u, v)
                hit_data.normal = normal
                hit_data.material_id = material_id
        return hit_data


@ti.data_oriented
class BruteForceRayIntersector(RayIntersector):
    def __init__(self, geometry: Geometry) -> None:
        super().__init__(geometry)

    @ti.func
    def query_ray(self, ray: Ray) -> HitData:
        closest_hit = HitData()
        for triangle_id in range(1, self.geometry.n_triangles + 1):
            hit_data = self.intersect_triangle(ray, triangle_id)
            if hit_data.is_hit:
                if (hit_data.distance < closest_hit.distance) or (not closest_hit.is_hit):
                    closest_hit = hit_data
        return closest_hit
