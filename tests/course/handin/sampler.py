import taichi as ti
import taichi.math as tm
from .materials import Material
from taichi_tracer.geometry import Geometry

@ti.data_oriented
class UniformSampler:
    def __init__(self):
        pass

    @staticmethod
    @ti.func
    def sample_direction() -> tm.vec3:
        z = 2 * ti.random() - 1
        r = ti.sqrt(ti.max(0., 1 - z * z))
        phi = 2 * tm.pi * ti.random()
        return tm.vec3(r * ti.cos(phi), r * ti.sin(phi), z)

    @staticmethod
    @ti.func
    def evaluate_probability() -> float:
        return 1. / (4. * tm.pi)

@ti.data_oriented
class BRDF:
    def __init__(self):
        pass

    @staticmethod
    @ti.func
    def sample_direction(material: Material, w_o: tm.vec3, normal: tm.vec3) -> tm.vec3:
        alpha = 1.0
        axis = normal
        if material.Ns > 1:
            alpha = material.Ns
            axis = reflect(w_o, normal)
        z = ti.pow(ti.random(), 1. / (alpha + 1))
        r = ti.sqrt(ti.max(0., 1 - z * z))
        phi = 2 * tm.pi * ti.random()
        w = tm.vec3(r * ti.cos(phi), r * ti.sin(phi), z)
        return tm.normalize(ortho_frames(axis) @ w)

    @staticmethod
    @ti.func
    def evaluate_probability(material: Material, w_o: tm.vec3, w_i: tm.vec3, normal: tm.vec3) -> float:
        p = 0.0
        if material.Ns <= 1:
            p = ti.max(0., normal.dot(w_i)) / tm.pi
        else:
            p = (material.Ns + 1) / (2 * tm.pi) * ti.pow(ti.max(0., reflect(w_o, normal).dot(w_i)), material.Ns)
        return p

    @staticmethod
    @ti.func
    def evaluate_brdf(material: Material, w_o: tm.vec3, w_i: tm.vec3, normal: tm.vec3) -> tm.vec3:
        f = material.Kd / tm.pi
        if material.Ns > 1:
            f = material.Kd * (material.Ns + 1) / (2 * tm.pi) * ti.pow(ti.max(0., reflect(w_o, normal).dot(w_i)), material.Ns)
        return f

    @staticmethod
    @ti.func
    def evaluate_brdf_factor(material: Material, w_i: tm.vec3, normal: tm.vec3) -> tm.vec3:
        f = material.Kd
        if material.Ns > 1:
            f = material.Kd * ti.max(0., normal.dot(w_i))
        return f

@ti.func
def ortho_frames(v_z: tm.vec3) -> tm.mat3:
    a = tm.vec3(0., 1., 0.)
    if ti.abs(v_z.y) > 0.9:
        a = tm.vec3(1., 0., 0.)
    v_x = tm.normalize(tm.cross(a, v_z))
    v_y = tm.cross(v_z, v_x)
    return tm.mat3([v_x.x, v_y.x, v_z.x], [v_x.y, v_y.y, v_z.y], [v_x.z, v_y.z, v_z.z])

@ti.func
def reflect(ray_direction: tm.vec3, normal: tm.vec3) -> tm.vec3:
    return 2 * normal.dot(ray_direction) * normal - ray_direction

@ti.data_oriented
class MeshLightSampler:
    def __init__(self, geometry, material_library) -> None:
        self.geometry = geometry
        self.material_library = material_library

    @ti.func
    def compute_triangle_area(self, v0: tm.vec3, v1: tm.vec3, v2: tm.vec3) -> float:
        return 0.5 * tm.length(tm.cross(v1 - v0, v2 - v0))

    def compute_cdf(self):
        self.fill_cdf()

    @ti.kernel
    def fill_cdf(self):
        total = 0.0
        ti.loop_config(serialize=True)
        for i in range(self.n_emissive_triangles):
            triangle_id = self.emissive_triangle_ids[i]
            ids = self.geometry.triangle_vertex_ids[triangle_id - 1] - 1
            total += self.compute_triangle_area(self.geometry.vertices[ids[0]], self.geometry.vertices[ids[1]], self.geometry.vertices[ids[2]])
            self.cdf[i] = total
        for i in range(self.n_emissive_triangles):
            self.cdf[i] = self.cdf[i] / total

    @ti.func
    def sample_emissive_triangle(self) -> int:
        xi = ti.random()
        lo = 0
        hi = self.n_emissive_triangles - 1
        while lo < hi:
            mid = (lo + hi) // 2
            if self.cdf[mid] <= xi:
                lo = mid + 1
            else:
                hi = mid
        return lo

    @ti.func
    def evaluate_probability(self) -> float:
        return 1.0 / self.total_emissive_area[None]

    @ti.func
    def sample_mesh_lights(self, hit_point: tm.vec3):
        i = self.sample_emissive_triangle()
        triangle_id = self.emissive_triangle_ids[i]
        ids = self.geometry.triangle_vertex_ids[triangle_id - 1] - 1
        v0 = self.geometry.vertices[ids[0]]
        v1 = self.geometry.vertices[ids[1]]
        v2 = self.geometry.vertices[ids[2]]
        x0 = ti.random()
        x1 = ti.random()
        b0 = 0.0
        b1 = 0.0
        if x0 < x1:
            b0 = x0 / 2
            b1 = x1 - b0
        else:
            b1 = x1 / 2
            b0 = x0 - b1
        y = b0 * v0 + b1 * v1 + (1 - b0 - b1) * v2
        return tm.normalize(y - hit_point), triangle_id


@ti.data_oriented
class MicrofacetBRDF:
    # 546 part
    @staticmethod
    @ti.func
    def Lambda(material: Material, w: tm.vec3) -> float:
        a2 = (material.alpha_x * w.x)**2 + (material.alpha_y * w.y)**2
        return (-1. + tm.sqrt(1. + a2 / (w.z * w.z))) / 2.

    @staticmethod
    @ti.func
    def D(material: Material, h: tm.vec3) -> float:
        e = (h.x / material.alpha_x)**2 + (h.y / material.alpha_y)**2
        e = e + h.z * h.z
        return 1. / (tm.pi * material.alpha_x * material.alpha_y * e * e)

    @staticmethod
    @ti.func
    def fresnel(material: Material, c: float) -> tm.vec3:
        return material.F0 + (tm.vec3(1.) - material.F0) * tm.pow(1. - c, 5.)

    @staticmethod
    @ti.func
    def sample_direction(material: Material, w_o: tm.vec3, normal: tm.vec3) -> tm.vec3:
        # Heitz 2018
        M = ortho_frames(normal)
        o = M.transpose() @ w_o
        vh = tm.normalize(tm.vec3(material.alpha_x * o.x, material.alpha_y * o.y, o.z))
        l2 = vh.x * vh.x + vh.y * vh.y
        t1 = tm.vec3(1., 0., 0.)
        if l2 > 0:
            t1 = tm.vec3(-vh.y, vh.x, 0.) / tm.sqrt(l2)
        t2 = tm.cross(vh, t1)
        r = tm.sqrt(ti.random())
        phi = 2. * tm.pi * ti.random()
        p1 = r * tm.cos(phi)
        p2 = r * tm.sin(phi)
        s = 0.5 * (1. + vh.z)
        p2 = (1. - s) * tm.sqrt(1. - p1 * p1) + s * p2
        nh = p1 * t1 + p2 * t2 + tm.sqrt(tm.max(0., 1. - p1 * p1 - p2 * p2)) * vh
        h = tm.normalize(tm.vec3(material.alpha_x * nh.x, material.alpha_y * nh.y, tm.max(0., nh.z)))
        return M @ reflect(o, h)

    @staticmethod
    @ti.func
    def evaluate_probability(material: Material, w_o: tm.vec3, w_i: tm.vec3, normal: tm.vec3) -> float:
        M = ortho_frames(normal).transpose()
        o = M @ w_o
        h = tm.normalize(o + M @ w_i)
        return MicrofacetBRDF.D(material, h) / (1. + MicrofacetBRDF.Lambda(material, o)) / (4. * o.z)

    @staticmethod
    @ti.func
    def evaluate_brdf(material: Material, w_o: tm.vec3, w_i: tm.vec3, normal: tm.vec3) -> tm.vec3:
        M = ortho_frames(normal).transpose()
        o = M @ w_o
        i = M @ w_i
        h = tm.normalize(o + i)
        G = 1. / (1. + MicrofacetBRDF.Lambda(material, o) + MicrofacetBRDF.Lambda(material, i))
        return MicrofacetBRDF.D(material, h) * G * MicrofacetBRDF.fresnel(material, o.dot(h)) / (4. * o.z * i.z)

    @staticmethod
    @ti.func
    def evaluate_brdf_factor(material: Material, w_o: tm.vec3, w_i: tm.vec3, normal: tm.vec3) -> tm.vec3:
        M = ortho_frames(normal).transpose()
        o = M @ w_o
        i = M @ w_i
        h = tm.normalize(o + i)
        lo = MicrofacetBRDF.Lambda(material, o)
        return MicrofacetBRDF.fresnel(material, o.dot(h)) * (1. + lo) / (1. + lo + MicrofacetBRDF.Lambda(material, i))
