"""RT3: the XML scenes of a course's ray tracer (RT-1 … RT-9). The reader is a state machine.

``world_begin`` and ``world_end`` are empty elements. The elements between them are the world; the elements before them
are the settings of the picture. ``world_end`` takes the picture. Each ``render_again`` takes another picture of the
same world, with the settings that were changed in between.
"""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from taichi_tracer.camera import check_view
from taichi_tracer.cameras.orthographic import OrthographicCamera
from taichi_tracer.formulas.view import DEFAULT_WINDOW, camera_frame
from taichi_tracer.geometry import Mesh
from taichi_tracer.integrators.rt3_blinn_phong import MOST_MIRRORS
from taichi_tracer.lights.base import Light
from taichi_tracer.options import BackgroundChoice
from taichi_tracer.picture.film import crop_pixels
from taichi_tracer.rt3.elements import FLAGS, LONGEST_SHOWN, Element, read_elements
from taichi_tracer.rt3.world import World
from taichi_tracer.system.errors import InputError, one_of
from taichi_tracer.system.parts import PARTS

MOST_PIXELS = 8192**2  # of a film; the fields of this number of pixels already take several gigabytes
LEAST_STRETCH = 1e-3  # relative; nobody sees whether a circle is stretched by less
IMAGE_TYPES = {"png": ".png", "ppm": ".ppm", "ppm3": ".ppm", "ppm6": ".ppm", "exr": ".exr"}
INTEGRATORS = {"flat": "flat", "normal_map": "normal_map", "normal": "normal_map", "depth_map": "depth_map"}
INTEGRATORS |= {"depth": "depth_map", "direct": "direct", "direct_illumination": "direct"}
INTEGRATORS |= {"blinn_phong": "blinn_phong", "blinn": "blinn_phong", "uv": "uv"}
BACKGROUNDS = {"colors": "colors", "color": "colors", "single_color": "colors", "4_colors": "colors"}
BACKGROUNDS |= {"image": "image", "spherical": "spherical"}
SYNONYMS = {
    "look_at": "lookat",
    "translation": "translate",
    "light": "light_source",
    "rotation": "rotate",
    "scaling": "scale",
}
SYNONYMS |= {"push_ctm": "push_CTM", "pop_ctm": "pop_CTM", "push_gs": "push_GS", "pop_gs": "pop_GS"}
AGGREGATORS = {"bvh": "bvh", "list": "brute_force"}
WORLD = {
    **dict.fromkeys(("translate", "scale", "rotate", "matrix", "identity"), World.transform),
    **dict.fromkeys(("push_CTM", "push_GS"), World.push),
    **dict.fromkeys(("pop_CTM", "pop_GS"), World.pop),
    "object": World.add_object,
    "light_source": World.add_light,
    "material": World.use_material,
    "make_named_material": World.make_named_material,
    "named_material": World.use_named_material,
    "save_coord_system": World.save_transform,
    "restore_coord_system": World.restore_transform,
    "object_instance_begin": World.begin_instance,
    "object_instance_end": World.end_instance,
    "object_instance_call": World.call_instance,
}
TAGS = (
    *("lookat", "camera", "film", "integrator", "background", "aggregator"),
    *("world_begin", "world_end", "render_again", "include", *WORLD),
)


@dataclass(frozen=True)
class FilmSettings:
    """The size of a picture, and how it is written (RT-6).

    Attributes:
        width, height: size of the whole frame in pixels.
        crop_window: (x0, x1, y0, y1) as fractions of the frame, with y from the bottom (C-12).
        filename: the name with the extension of the image type; None if the document has no name.
        gamma_corrected: whether 8-bit colours get the sRGB transfer function (C-14).
    """

    width: int = 512
    height: int = 512
    crop_window: tuple[float, float, float, float] = (0.0, 1.0, 0.0, 1.0)
    filename: str | None = None
    gamma_corrected: bool = True

    def crop(self, width: int | None = None, height: int | None = None) -> tuple[int, int, int, int]:
        """(x0, x1, y0, y1) in pixels, for a frame of this size or another size. Adjacent windows share no pixel."""
        return crop_pixels(self.crop_window, width or self.width, height or self.height)


@dataclass(frozen=True)
class IntegratorSettings:
    """What a picture shows.

    Attributes:
        name: of the view, of the estimator, or of RT3's integrator. spp: None if the document does not say it.
        values: what it says of the renderer's values, see ``RT3Renderer.values``.
    """

    name: str = "flat"
    spp: int | None = None
    values: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Shot:
    """One picture that a document asks for. ``view`` has the arguments of ``camera.make_camera`` but the size."""

    view: dict
    film: FilmSettings
    integrator: IntegratorSettings


@dataclass
class Document:
    """The content of a document.

    Attributes:
        mesh: triangles, spheres and materials. Its ``notes`` are what the user should know, one line each.
        lights: those of the world.
        intersector: its name; None if the document chooses none.
        shots: the pictures, at least one.
        background: an argument for ``environment.load_background``.
        environment, environment_options: arguments for ``environment.load_environment``.
    """

    mesh: Mesh
    shots: list[Shot]
    lights: list[Light] = field(default_factory=list)
    intersector: str | None = None
    background: BackgroundChoice = None
    environment: Path | None = None
    environment_options: dict = field(default_factory=dict)


def read_rt3(path: str | Path) -> Document:
    """Read a document.

    Raises:
        InputError: something cannot be used; the message has file, line and value.
    """
    path = Path(path)
    reader = _Reader(path)
    read_elements(path, reader.take, reader.notes.append)
    return reader.document()


class _Reader:
    """The state of the reader between two elements of a document."""

    def __init__(self, path: Path) -> None:
        self.path, self.notes = path, []
        self.world: World | None = None
        self.began_at = self.ended_at = ""
        self.lookat: tuple[dict, str] | None = None
        self.camera: tuple[dict, str] | None = None
        self.film: FilmSettings | None = None
        self.integrator = IntegratorSettings()
        self.result = Document(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)), [])

    def take(self, element: Element) -> None:
        """Handle one element according to its tag."""
        tag = element.tag = SYNONYMS.get(element.tag, element.tag)
        if tag not in TAGS:
            self.notes.append(f"{element.where}: {one_of('tag', tag[:LONGEST_SHOWN], TAGS)}")
            element.known |= dict.fromkeys(element.attributes)  # so that they give no further notes
        elif tag not in WORLD:
            getattr(self, f"take_{tag}")(element)
        elif not self.began_at or self.ended_at:
            edge = f"after world_end ({self.ended_at})" if self.ended_at else "before world_begin"
            raise element.error(f"belongs into the world, but stands {edge}")
        else:
            WORLD[tag](self.world, element)

    # --- settings -----------------------------------------------------------------------------------------------------

    def take_lookat(self, element: Element) -> None:
        """look_from, look_at, up (RT-8)."""
        eye = element.numbers(element.need("look_from", "from"))
        at = element.numbers(element.need("look_at", "at"))
        up = element.numbers("up", "vup", default=np.array([0.0, 1.0, 0.0]))
        try:
            camera_frame(eye, at, up)
        except InputError as error:
            message = str(error).removeprefix("camera: ").replace("eye and at", "look_from and look_at")
            raise element.error(message) from None
        self.lookat = {"eye": tuple(eye), "at": tuple(at), "up": tuple(up)}, element.where

    def take_camera(self, element: Element) -> None:
        """The projection and its window (RT-3 … RT-5)."""
        view: dict = {"projection": element.choice("type", of={name: name for name in PARTS.names("camera")})}
        window = element.numbers("screen_window", count=4)
        if window is not None:
            view["screen_window"] = tuple(float(edge) for edge in window)
        if not issubclass(PARTS.find("camera", view["projection"]), OrthographicCamera):
            fovy = element.number("fovy", "fov")
            if fovy is not None and window is not None:
                text = element.attributes["screen_window"]
                self.notes.append(f"{element.where}: fovy {fovy:g} does not count beside screen_window {text!r} (C-9)")
            elif fovy is not None:
                view["fov"] = fovy
        given = {
            "frame_aspect": element.number("frame_aspect", "frame_aspectratio", above=0.0),
            "focal_distance": element.number("focal_distance", above=0.0),
            "handedness": element.text("handedness"),
        }
        view |= {key: value for key, value in given.items() if value is not None}
        self.camera = view, element.where

    def take_film(self, element: Element) -> None:
        """The frame, and the part of it that is written (RT-6)."""
        element.choice("type", of={"image": "image"}, default="image")
        width = element.whole(element.need("x_res", "w_res"))
        height = element.whole(element.need("y_res", "h_res"))
        if width * height > MOST_PIXELS:
            raise element.error(f"{width} x {height} are more than {MOST_PIXELS:,} pixels")
        film = FilmSettings(width, height)
        window = element.numbers("crop_window", count=4)
        if window is not None:
            film = replace(film, crop_window=tuple(float(edge) for edge in window))
            try:
                film.crop()
            except InputError as error:
                raise element.error(f"crop_window: {error}") from None
        extension = element.choice("img_type", of=IMAGE_TYPES, default=".png")
        filename = element.text("filename")
        if filename is not None:
            name = Path(filename.replace("\\", "/"))
            has_ending = name.suffix.lower() in IMAGE_TYPES.values() and not element.find("img_type")
            filename = str(name if has_ending else name.with_suffix(extension))
        gamma = element.choice("gamma_corrected", of=FLAGS, default=True)
        self.film = replace(film, filename=filename, gamma_corrected=gamma)

    def take_integrator(self, element: Element) -> None:
        """What the picture shows."""
        name, spp, values = element.choice("type", of=INTEGRATORS), None, {}
        if name == "depth_map":
            values = dict(element.colors("near_color", "far_color"))
            values |= {k: v for k in ("zmin", "zmax") if (v := element.number(k)) is not None}
            if values.get("zmin", -math.inf) >= values.get("zmax", math.inf):
                raise element.error(f"zmin {values['zmin']:g} must be less than zmax {values['zmax']:g}")
        elif name == "direct":
            name, spp = element.text("estimator") or "mis", element.whole("spp", "samples", default=16)
        elif name == "blinn_phong":
            values = {"mirrors": element.whole("depth", default=5, least=0, most=MOST_MIRRORS)}
        self.integrator = IntegratorSettings(name, spp, values)

    def take_background(self, element: Element) -> None:
        """What stands behind the world (RT-7, C-13)."""
        kind = element.choice("type", of=BACKGROUNDS, default="colors")
        if kind == "colors":
            colors = element.colors("color", "bl", "tl", "tr", "br")
            if ("color" in colors) == (len(colors) > 1) or ("color" not in colors and len(colors) < 4):
                raise element.error("needs either color, or the four corners bl tl tr br")
            self.result.background = colors.get("color") or tuple(colors[c] for c in ("bl", "tl", "tr", "br"))
            return
        path = element.path("filename")
        mappings = {"screen": "image", "spherical": "spherical"}
        if kind == "image" and element.choice("mapping", of=mappings, default="image") == "image":
            self.result.background = path
            return
        self.result.environment = path
        options = {"intensity": element.number("intensity"), "rotation": element.number("rotation")}
        if options["intensity"] is not None and options["intensity"] < 0:
            raise element.wrong("intensity", "a number of at least 0")
        self.result.environment_options = {k: v for k, v in options.items() if v is not None}

    def take_aggregator(self, element: Element) -> None:
        """Which intersector finds what a ray hits (RT-12). The hierarchy of the package splits as it sees fit."""
        self.result.intersector = element.choice("type", of=AGGREGATORS)

    # --- the world and the pictures -----------------------------------------------------------------------------------

    def take_world_begin(self, element: Element) -> None:
        """The world begins here."""
        if self.began_at:
            raise element.error(f"is the second one: a document has one world (it began at {self.began_at})")
        self.began_at, self.world = element.where, World(self.path)

    def take_world_end(self, element: Element) -> None:
        """The world is complete; take the picture."""
        if not self.began_at or self.ended_at:
            raise element.error("has no world_begin before it")
        self.ended_at = element.where
        if self.world.current is not self.world.contents:
            name, where = self.world.current.name, self.world.current.where
            raise element.error(f"stands in the instance {name!r}, which began at {where} and has no end")
        self.shoot(element)

    def take_render_again(self, element: Element) -> None:
        """Take another picture of the same world with the present settings."""
        if not self.ended_at:
            raise element.error("stands before world_end: there is no world yet")
        self.shoot(element)

    def shoot(self, element: Element) -> None:
        """Add one picture with the present settings to the result."""
        for tag, value in (("lookat", self.lookat), ("camera", self.camera), ("film", self.film)):
            if value is None:
                raise InputError(f"{element.where}: the document has no <{tag}> before <{element.tag}>")
        view, where = self.camera
        view = {**view, **self.lookat[0]}
        if "fov" not in view:
            view.setdefault("screen_window", DEFAULT_WINDOW)
        try:
            stretch = check_view(self.film.width, self.film.height, **view)
        except InputError as error:
            raise InputError(f"{where}: <camera> {str(error).removeprefix('camera: ')}") from None
        if abs(math.log(stretch)) > LEAST_STRETCH:
            percent = 100 * (max(stretch, 1 / stretch) - 1)
            way = "in width" if stretch > 1 else "in height"
            self.notes.append(
                f"{where}: the window is not shaped as the {self.film.width}x{self.film.height} film: "
                f"objects are stretched by {percent:.0f} % {way} (C-11)"
            )
        self.result.shots.append(Shot(view, self.film, self.integrator))

    def document(self) -> Document:
        """The content of the document; an InputError if the document ended too early."""
        if not self.began_at:
            raise InputError(f"{self.path}: the document has no <world_begin/>")
        if not self.ended_at:
            raise InputError(f"{self.path}: the world that began at {self.began_at} has no <world_end/>")
        self.result.mesh = self.world.contents.mesh(list(self.world.material_ids))
        self.result.lights = self.world.lights
        if self.result.mesh.num_primitives == 0 and not self.result.mesh.instances:
            self.notes.append(f"{self.ended_at}: the world is empty, so that pictures of it show only the background")
        self.result.mesh.notes = [*self.notes, *self.world.notes]
        return self.result
