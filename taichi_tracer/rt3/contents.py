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
        calls: other contents, with the (4, 4) transform of each place.
    """

    name: str
    where: str = ""
    parts: list[Mesh] = field(default_factory=list)
    calls: list[tuple["Contents", np.ndarray]] = field(default_factory=list)

    def mesh(self, materials: list[Material], known: dict[int, Mesh] | None = None) -> Mesh:
        """Everything as one mesh; what is called several times is one mesh in several places.

        Args:
            materials: of the document. known: the meshes of contents, by their identity, as far as they are made.
        """
        known = {} if known is None else known
        if id(self) not in known:
            whole = joined(self.parts, materials, self.name)
            places: dict[int, list[np.ndarray]] = {}
            of = {id(called): called for called, _ in self.calls}
            for called, matrix in self.calls:
                places.setdefault(id(called), []).append(matrix)
            whole.instances = [
                Instances(of[key].mesh(materials, known), np.array(matrices)) for key, matrices in places.items()
            ]
            known[id(self)] = whole
        return known[id(self)]
