"""Which triangles need not be tried: one hierarchy a file. The interface is ``ray_intersector.RayIntersector``."""
