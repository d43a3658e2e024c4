"""Classes of this package that run what a student of the course has written, each an adapter to its conventions.

A camera, an environment, a sampler and a BRDF take over the student's methods. An intersector, a renderer and a sampler
of lights hold an object of the student's own class, for which triangles are counted from 1 (``course.geometry``).
"""

import ast
import contextlib
import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import taichi as ti
from taichi.lang.kernel_impl import _BoundedDifferentiableMethod

import taichi_tracer as tt
from taichi_tracer.course.files import bare
from taichi_tracer.course.geometry import CourseGeometry, CourseLights, CourseScene, OfPackage, shifted
from taichi_tracer.system.compile_time import compile_time
from taichi_tracer.system.errors import InputError, OwnCodeError
from taichi_tracer.system.own_code.checks import check_method, check_parameters, fault, is_empty, tree_of, unwrap
from taichi_tracer.system.parts import Unfinished, call_with_known_args, gives_of, written

# The handout's methods of each class: where one of them is judged alone, the others are the package's.
HANDOUT = {
    "Camera": ("generate_ray", "generate_ndc_coords", "generate_camera_coords", "compute_matrix"),
    "Environment": ("query_ray",),
    "UniformSampler": ("sample_direction", "evaluate_probability"),
    "BRDF": ("sample_direction", "evaluate_probability", "evaluate_brdf", "evaluate_brdf_factor"),
    "MicrofacetBRDF": ("sample_direction", "evaluate_probability", "evaluate_brdf", "evaluate_brdf_factor"),
    "RayIntersector": ("intersect_triangle", "query_ray"),
    "MeshLightSampler": (
        *("compute_triangle_area", "compute_cdf", "sample_emissive_triangle"),
        *("evaluate_probability", "sample_mesh_lights"),
    ),
}
# The class of this package whose methods an adapter of the same name has.
CLASSES: dict[str, Any] = {name: getattr(tt, name) for name in (*HANDOUT, "A2Renderer", "A3Renderer", "A4Renderer")}
WRITTEN = {"shade_ray", *(method for methods in HANDOUT.values() for method in methods)}
OF_BRDF = ("material", "w_o", "w_i", "normal")  # the parameters of the handout, in their order
BIND = tt.RayIntersector.bind  # kept, because ``course.use`` assigns another
MODES_OF_A2 = {mode.name.lower() for mode in tt.A2Renderer.SampleMode}
NOT_TAKEN = ("__init__", "set_camera_parameters", "set_intensity")  # what the package's objects do themselves


def adapters_of(classes: dict[str, type]) -> dict[str, type]:
    """The package's classes for a student's classes, by the names of the handout; names that it lacks are left out."""
    made: dict[str, type] = {}
    for name, student in ((name, classes[name]) for name in CLASSES if name in classes):
        if name == "RayIntersector":
            made[name] = intersector_of(student)
        elif name == "MeshLightSampler":
            made[name] = light_sampler_of(student)
        elif name in HANDOUT:
            made[name] = adapted(student, CLASSES[name])
        else:
            made[name] = renderer_of(student, CLASSES[name], classes)
    return made


def without(cls: type, *methods: str) -> type:
    """A class of ``adapters_of`` with the package's methods in place of some of the student's.

    Without the student's test of a triangle, the search is the package's, too.
    """
    base = CLASSES[cls.__name__]
    if "intersect_triangle" in methods:
        methods = HANDOUT["RayIntersector"]
    packages = {name: inspect.getattr_static(base, name) for name in methods if hasattr(base, name)}
    return type(cls.__name__, (cls,), packages | {"__module__": cls.__module__})


def alone(cls: type, method: str) -> type:
    """A class of ``adapters_of`` in which only one of the handout's methods is the student's."""
    return without(cls, *(name for name in HANDOUT.get(cls.__name__, ()) if name != method))


def own_members(student: type) -> dict[str, Any]:
    """What a student's class and its own bases define: methods, functions and constants."""
    found: dict[str, Any] = {}
    for base in reversed(student.__mro__):
        if base.__module__ == student.__module__ or base.__module__.startswith("student_files_"):
            found |= {k: v for k, v in vars(base).items() if not k.startswith(("__", "_abc"))}
    return {k: v for k, v in found.items() if k not in NOT_TAKEN and not getattr(v, "__isabstractmethod__", False)}


def other_arguments(student: type, base: type) -> dict[str, OwnCodeError]:
    """The handout's methods of a student's class that cannot be called as the handout calls them: name → why.

    They are those of the package: only the student's own code calls the student's.
    """
    found, members = {}, own_members(student)
    for method in HANDOUT[base.__name__]:
        shipped = written(base, method) if hasattr(base, method) else None
        if method in members and callable(shipped) and fitted(members[method]) is members[method]:
            try:
                check_parameters(f"{student.__name__}.{method}", members[method], shipped)
            except OwnCodeError as error:
                message = f"{student.__name__}.{method} cannot be called as the handout calls it: {error.text}"
                found[method] = fault(members[method], message)
    return found


def if_written(student: type, name: str, method: Any) -> Any:
    """A method; if its body is empty, what ends a picture that uses it."""
    if callable(method) and is_empty(method):
        return Unfinished(method, fault(method, f"{student.__name__}.{name} is not written yet"))
    return method


def finished(student: type, base: type, method: str, of_adapter: Any) -> Any:
    """The adapter's method, which asks the student's; what ends a picture that uses it if the student's cannot run."""
    function = own_members(student)[method]
    if isinstance(unwritten := if_written(student, method, function), Unfinished):
        return unwritten
    try:
        check_method(student, method, function, written(base, method), gives_of(base).get(method, ""))
    except OwnCodeError as error:
        return Unfinished(function, error)
    return of_adapter


class StudentKernel:
    """A kernel that is assigned to a class: an object that is asked for it gets the kernel with this object."""

    def __init__(self, kernel: Any) -> None:
        self.written = kernel
        kernel._is_staticmethod = False  # as Taichi notes at each access

    def __get__(self, owner: Any, cls: type | None = None) -> Any:
        return self.written if owner is None else _BoundedDifferentiableMethod(owner, self.written)


def adapted(student: type, base: type) -> type:
    """A class of the package's kind with the student's methods."""
    name, others = base.__name__, other_arguments(student, base)
    members = {k: if_written(student, k, v) for k, v in own_members(student).items() if k not in others}
    if "BRDF" in name:
        members = {k: fitted(v) if k in HANDOUT[name] else v for k, v in members.items()}
    members = {k: StudentKernel(v) if getattr(v, "_is_wrapped_kernel", False) else v for k, v in members.items()}
    if name in CONSTRUCTED and names_read(student) - set(members) - set(dir(base)):
        initialise = base.__init__  # type: ignore[misc]

        def begin(self: Any, *arguments: Any, **options: Any) -> None:
            initialise(self, *arguments, **options)
            complete(self, student, CONSTRUCTED[name](self))

        members["__init__"] = begin
    members |= {"__module__": student.__module__, "__doc__": student.__doc__, "other_arguments": others}
    return type(name, (base,), members)


# What the constructor of a student's class gets, from the package's object.
CONSTRUCTED: dict[str, Callable[[Any], dict[str, Any]]] = {
    "Camera": lambda camera: {"width": int(camera.width), "height": int(camera.height)},
    "Environment": lambda environment: {"image": np.ascontiguousarray(environment.image)},
    "MeshLightSampler": lambda sampler: {"geometry": sampler.geometry, "material_library": sampler.material_library},
    "RayIntersector": lambda intersector: {"geometry": intersector.geometry},
}


def names_read(student: type) -> set[str]:
    """The attributes of ``self`` that the methods of a class read, but its constructor."""
    trees = [tree_of(value) for value in own_members(student).values() if hasattr(unwrap(value), "__code__")]
    read = (node for tree in trees if tree is not None for node in ast.walk(tree) if isinstance(node, ast.Attribute))
    return {node.attr for node in read if isinstance(node.ctx, ast.Load) and ast.unparse(node.value) == "self"}


def complete(made: Any, student: type, given: dict[str, Any]) -> None:
    """Give an object the attributes that the methods of a student's class read, and that only its constructor makes.

    Args:
        given: the arguments of the constructor, which is run as far as it comes: it may ask for more.
    """
    lacking = {name for name in names_read(student) if not hasattr(made, name)}
    if lacking:
        constructed: Any = bare(student)
        with contextlib.suppress(Exception):
            constructed.__init__(**given)
        vars(made).update({k: v for k, v in vars(constructed).items() if k in lacking})


def fitted(method: Any) -> Any:
    """A function of a BRDF that may lack some of the handout's parameters, such as ``w_o``."""
    if isinstance(method, Unfinished):
        return method
    function = method.__func__ if isinstance(method, staticmethod) else method
    names = [name for name in inspect.signature(function).parameters if name != "self"]
    missing = [name for name in OF_BRDF if name not in names]
    if not set(names) < set(OF_BRDF) or missing == ["w_i"]:  # it has all of them, or others' names in their order
        return method

    @compile_time
    def call(material, w_o, *directions):
        taken_here = OF_BRDF if len(directions) == 2 else ("material", "w_o", "normal")
        given = dict(zip(taken_here, (material, w_o, *directions), strict=True))
        return function(*(given[name] for name in names))

    return staticmethod(call)


# ── objects of the student's own class ──


def intersector_of(student: type) -> type:
    """An intersector that asks an object of the student's class."""

    def bind(self: Any, geometry: Any, triangle_test: Any = "watertight") -> None:
        BIND(self, geometry, triangle_test)
        self.theirs = bare(student, geometry=CourseGeometry(geometry))
        complete(self.theirs, student, CONSTRUCTED["RayIntersector"](self.theirs))

    own, others = own_members(student), other_arguments(student, tt.RayIntersector)
    members = {"bind": bind, "__module__": student.__module__, "name": "student's", "other_arguments": others}
    for method, of_adapter in (("intersect_triangle", intersect_triangle), ("query_ray", query_ray)):
        if method in own and method not in others:
            members[method] = finished(student, tt.RayIntersector, method, of_adapter)
    return type("RayIntersector", (tt.RayIntersector,), members)


@ti.func
def intersect_triangle(self, ray, triangle_id):
    """The student's answer for one triangle."""
    return shifted(self.theirs.intersect_triangle(ray, triangle_id + 1), -1, tt.no_hit())


@ti.func
def query_ray(self, ray):
    """The student's nearest hit."""
    return shifted(self.theirs.query_ray(ray), -1, tt.no_hit())


def renderer_of(student: type, base: type, classes: dict[str, type]) -> type:
    """A renderer whose ``shade_ray`` is the student's; A4's may be two methods, for implicit and explicit paths.

    Args:
        classes: of the student, by name: the scene that the renderer sees has their further methods and attributes.
    """
    members = own_members(student)
    ways = [name for name in ("shade_implicit", "shade_explicit") if name in members]
    second = classes.get("A2Renderer") if base is tt.A3Renderer else None  # A3 of the course knows lamps alone
    initialise = base.__init__  # type: ignore[misc]

    def begin(self: Any, *arguments: Any, **options: Any) -> None:
        initialise(self, *arguments, **options)
        vars(self)["_theirs"] = shading_object(self, student, classes)
        if second is not None and self.scene_data.lamps.count == 0:
            vars(self)["_without_lamps"] = shading_object(self, second, classes)
        if hasattr(self, "_one_sample"):
            self._one_sample.prepare(self.scene_data, self.camera)  # the weights, which kernels read

    @compile_time
    def shade_ray(self: Any, ray: Any) -> Any:
        name = f"shade_{self.active.name}" if ways else "shade_ray"
        if name not in members:
            raise InputError(f"{student.__name__} has no {name}, which the mode {self.active.name!r} needs")
        theirs = vars(self)["_theirs"]
        if self.active.name in MODES_OF_A2:
            theirs = vars(self).get("_without_lamps", theirs)
        return call_with_known_args(if_written(type(theirs), name, getattr(theirs, name)), ray)

    made: dict[str, Any] = {"__init__": begin, "__module__": student.__module__, "other_arguments": {}}
    if ways or "shade_ray" in members:
        made["shade_ray"] = shade_ray if ways else finished(student, base, "shade_ray", shade_ray)
    return type(base.__name__, (base,), made)


def shading_object(renderer: Any, student: type, classes: dict[str, type]) -> Any:
    """An object of a student's renderer class, whose ``shade_ray`` a renderer asks."""
    kind = type(student.__name__, (student, OfPackage), {})
    theirs = bare(kind, package=renderer, scene_data=scene_of(renderer.scene_data, classes))
    given = {"width": int(renderer.width), "height": int(renderer.height), "scene_data": theirs.scene_data}
    complete(theirs, student, given)
    return theirs


def scene_of(scene: Any, classes: dict[str, type]) -> CourseScene:
    """A scene as a student's renderer sees it: its parts also have what only the student's classes have."""
    made = CourseScene(scene)
    for part, name in PARTS_OF_SCENE.items():
        own = getattr(made, part)
        student = classes.get(name)
        if student is None or not (set(own_members(student)) | names_read(student)) - set(dir(own)):
            continue
        kind = type(student.__name__, (type(own), student), {"__module__": student.__module__})
        beside = bare(kind, **vars(own))
        complete(beside, student, CONSTRUCTED[name](beside))
        setattr(made, part, beside)
    return made


# What a student's renderer reads of a scene → the student's class for it.
PARTS_OF_SCENE = {
    "mesh_light_sampler": "MeshLightSampler",
    "ray_intersector": "RayIntersector",
    "environment": "Environment",
}


def light_sampler_of(student: type) -> type:
    """A sampler of lamps that asks an object of the student's class; what this lacks, it has from the package's."""
    kind = type(student.__name__, (student, CourseLights), {})

    def theirs_of(self: Any) -> Any:
        return vars(self).get("_theirs", bare(kind, package=self))

    def set_geometry(self: Any, geometry: Any) -> None:
        library = getattr(self, "material_library", None)
        theirs = bare(kind, package=self, geometry=CourseGeometry(geometry), material_library=library)
        complete(theirs, student, CONSTRUCTED["MeshLightSampler"](theirs))
        vars(self).update(_geometry=geometry, _theirs=theirs)

    def asked(name: str) -> Callable:
        @compile_time
        def method(self: Any, *arguments: Any) -> Any:
            return call_with_known_args(getattr(theirs_of(self), name), *arguments)

        return method

    @compile_time
    def sample_mesh_lights(self: Any, hit_point: Any) -> Any:
        w_i, triangle_id = call_with_known_args(theirs_of(self).sample_mesh_lights, hit_point)
        return w_i, triangle_id - 1

    own, others = own_members(student), other_arguments(student, tt.MeshLightSampler)
    adapters = {name: asked(name) for name in HANDOUT["MeshLightSampler"]} | {"sample_mesh_lights": sample_mesh_lights}
    members: dict[str, Any] = {
        name: finished(student, tt.MeshLightSampler, name, method)
        for name, method in adapters.items()
        if name in own and name not in others
    }
    members["geometry"] = property(lambda self: vars(self)["_geometry"], set_geometry)
    members |= {"__module__": student.__module__, "other_arguments": others}
    return type("MeshLightSampler", (tt.MeshLightSampler,), members)
