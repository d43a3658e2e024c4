"""What is checked in RT3's phase 2: the frame, the map from pixels to the screen window, the rays of two cameras."""

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.teaching import stand_ins
from taichi_tracer.teaching.base import Arrays, Part
from taichi_tracer.teaching.judges import Numbers, Pictures

FRAME, SCREEN, RAYS = "camera frames", "raster images", "projections"


def places(rng: np.random.Generator) -> Arrays:
    """Cameras at 40 places."""
    return {name: array for name, array in stand_ins.views(rng, 40).items() if name != "fov"}


def run_matrix(camera_class: type, inputs: Arrays) -> Arrays:
    """The matrix of each camera."""
    camera, matrices = camera_class(8, 8), []
    for eye, at, up in zip(inputs["eye"], inputs["at"], inputs["up"], strict=True):
        camera.set_camera_parameters(eye=eye, at=at, up=up)
        matrices.append(camera.camera_to_world.to_numpy())
    return {"matrix": np.stack(matrices)}


def pixels(rng: np.random.Generator) -> Arrays:
    """Pixels and points between pixels, of a picture that is not square, with a window that is not centred."""
    size = stand_ins.picture_size(rng)
    counts = [size["width"], size["height"]]
    pixel = rng.uniform(-0.5, 1, (300, 2)) + rng.integers(0, counts, (300, 2))
    pixel[::2] = pixel[::2].round()
    view = {name: array[0] for name, array in stand_ins.views(rng, 1).items() if name != "fov"}
    window = np.array([-1, 1, -1, 1]) * rng.uniform(0.4, 2, 4)
    return {"pixel": pixel.astype(np.float32), "screen_window": window, **size, **view}


def camera_of(camera_class: type, inputs: Arrays):
    """The camera of the inputs."""
    kind = tt.OrthographicCamera if issubclass(camera_class, tt.OrthographicCamera) else tt.Camera
    view = {name: inputs[name].tolist() for name in ("eye", "at", "up", "screen_window")}
    return stand_ins.camera(camera_class, inputs["width"], inputs["height"], kind, **view)


@ti.kernel
def screen_kernel(camera: ti.template(), pixel: ti.types.ndarray(ndim=2), screen: ti.types.ndarray(ndim=2)):
    """The point of the window of each pixel."""
    for i in range(pixel.shape[0]):
        point = camera.pixel_to_screen(pixel[i, 0], pixel[i, 1])
        screen[i, 0], screen[i, 1] = point.x, point.y


def run_screen(camera_class: type, inputs: Arrays) -> Arrays:
    """The point of the window of each pixel."""
    screen = np.zeros(inputs["pixel"].shape, np.float32)
    screen_kernel(camera_of(camera_class, inputs), inputs["pixel"], screen)
    return {"screen": screen}


@ti.kernel
def ray_kernel(
    camera: ti.template(),
    pixel: ti.types.ndarray(ndim=2),
    origin: ti.types.ndarray(ndim=2),
    direction: ti.types.ndarray(ndim=2),
):
    """The ray of each pixel."""
    for i in range(pixel.shape[0]):
        ray = camera.generate_ray(pixel[i, 0], pixel[i, 1])
        stand_ins.write(origin, i, ray.origin)
        stand_ins.write(direction, i, ray.direction)


def run_ray(camera_class: type, inputs: Arrays) -> Arrays:
    """The ray of each pixel."""
    origin, direction = (np.zeros((len(inputs["pixel"]), 3), np.float32) for _ in range(2))
    ray_kernel(camera_of(camera_class, inputs), inputs["pixel"], origin, direction)
    return {"origin": origin, "direction": direction}


def cornell_view(rng: np.random.Generator) -> Arrays:
    """A camera in front of the Cornell box."""
    eye = np.array([0, 1, 3]) + rng.uniform(-0.15, 0.15, 3)
    return {"eye": eye, "at": np.array([0.0, 1, 0]), "up": np.array([0.0, 1, 0])}


def run_picture(classes, inputs: Arrays) -> Arrays:
    """The Cornell box through both cameras, side by side."""
    scene = tt.load_scene_data("cornell_box", fast=False)
    view = {name: array.tolist() for name, array in inputs.items()}
    cameras = [classes.PerspectiveCamera(48, 48, fov=60.0, **view)]
    cameras.append(classes.OrthographicCamera(48, 48, screen_window=(-1.2, 1.2, -1.2, 1.2), **view))
    pictures = [np.asarray(tt.A1Renderer(scene, camera=camera).use("normal").image()) for camera in cameras]
    scene.destroy()
    return {"picture": np.concatenate(pictures, axis=1)}


SAME = Numbers(1e-4, called="pixels")
PARTS = (
    Part(
        "PerspectiveCamera.compute_matrix",
        3,
        FRAME,
        "PerspectiveCamera",
        places,
        run_matrix,
        Numbers(1e-4, called="cameras"),
    ),
    Part("PerspectiveCamera.pixel_to_screen", 3, SCREEN, "PerspectiveCamera", pixels, run_screen, SAME),
    Part("PerspectiveCamera.generate_ray", 3, RAYS, "PerspectiveCamera", pixels, run_ray, SAME),
    Part("OrthographicCamera.generate_ray", 3, RAYS, "OrthographicCamera", pixels, run_ray, SAME),
    Part("picture: two cameras", 1, "the whole pipeline", "", cornell_view, run_picture, Pictures()),
)
