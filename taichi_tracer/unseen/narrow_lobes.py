"""Lobes that are so narrow that directions from another density hardly ever fall into them."""

from typing import Any

import taichi as ti

from taichi_tracer.materials import Material
from taichi_tracer.system.parts import PARTS, replaced

# From these on, a lobe has less than about 1/200 of all directions: for the power of a cosine, (1/4π) · 2π/(Ns + 1).
NARROW_FROM, NARROW_BELOW = 100, 0.1
LIKE_MIRROR_FROM = 1e5  # a lobe of a quarter of a degree, as wide as the sun


def may_be_narrow(brdf: Any, material: Material) -> bool:
    """Whether a BRDF may have a narrow lobe; of those that do not come with the package, nothing is known."""
    if brdf.is_delta:
        return False
    if material.map_layer or replaced(brdf) or not PARTS.comes_with_package(brdf):
        return True
    if material.is_rough:
        return min(material.alpha_x, material.alpha_y) < NARROW_BELOW
    return material.Ns >= NARROW_FROM


def has_narrow_lobes(scene: Any) -> bool:
    """Whether a material of a scene, a ``SceneInKernels``, may have a narrow lobe that is no mirror's."""
    library, microfacets = scene.material_library, scene.microfacets
    used = map(int, scene.geometry.mesh.used_materials())
    return any(
        may_be_narrow(library.brdfs[library.brdf_of[microfacets][i]], library.materials[i].modelled(microfacets))
        for i in used
    )


@ti.func
def is_like_mirror(material):
    """Whether the lobe is so much narrower than a small sun that only samples of the BRDF find what it reflects."""
    return material.Ns >= LIKE_MIRROR_FROM
