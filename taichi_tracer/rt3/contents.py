"""What stands in the world of an RT3 document, or between ``object_instance_begin`` and ``_end`` (RT-12)."""

from dataclasses import dataclass, field

import numpy as np

from taichi_tracer.geometry import Mesh
from taichi_tracer.instances import Instances
from taichi_tracer.materials import Material
from taichi_tracer.meshes.parts import joined


@dataclass
class Contents:
    """The objects of the world, or those of an instance, which is called in several places.

    Attributes:
        name: of the instance, or of the document. where: the line in which it began.
        parts: triangles and spheres, moved into their places.
        calls: meshes of instances, each with the (4, 4) transform of its place.
    """

    name: str
    where: str = ""
    parts: list[Mesh] = field(default_factory=list)
    calls: list[tuple[Mesh, np.ndarray]] = field(default_factory=list)

    def mesh(self, materials: list[Material]) -> Mesh:
        """Everything as one mesh; what is called several times is one mesh in several places.

        Args:
            materials: of the document.
        """
        whole = joined(self.parts, materials, self.name)
        places: dict[int, tuple[Mesh, list[np.ndarray]]] = {}
        for called, matrix in self.calls:
            places.setdefault(id(called), (called, []))[1].append(matrix)
        whole.instances = [Instances(called, np.array(matrices)) for called, matrices in places.values()]
        return whole
