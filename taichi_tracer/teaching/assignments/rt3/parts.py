"""What is checked in RT3's phase 2: the frame, the map from pixels to the screen window, the rays of two cameras."""

import numpy as np
import taichi as ti

import taichi_tracer as tt
from taichi_tracer.teaching import fixtures
from taichi_tracer.teaching.base import Arrays, Numbers, method, picture

FRAME, SCREEN, RAYS = "camera frames", "raster images", "projections"


def pixels(rng: np.random.Generator) -> Arrays:
    """Pixels and points between pixels, of a picture that is not square, with a window that is not centred."""
    size = fixtures.picture_size(rng)
    counts = [size["width"], size["height"]]
    pixel = rng.uniform(-0.5, 1, (300, 2)) + rng.integers(0, counts, (300, 2))
    pixel[::2] = pixel[::2].round()
    view = {name: array[0] for name, array in fixtures.views(rng, 1).items() if name != "fov"}
    window = np.array([-1, 1, -1, 1]) * rng.uniform(0.4, 2, 4)
    return {"pixel": pixel.astype(np.float32), "screen_window": window, **size, **view}


@ti.func
def screen(camera: ti.template(), pixel):
    """The point of the window of a pixel."""
    return camera.pixel_to_screen(pixel.x, pixel.y)


def cornell_view(rng: np.random.Generator) -> Arrays:
    """A camera in front of the Cornell box, whose angle of view the window says."""
    return {name: array for name, array in fixtures.front_view(rng).items() if name != "fov"}


def run_picture(classes, inputs: Arrays) -> Arrays:
    """The Cornell box through both cameras, side by side."""
    scene = tt.load_scene_data("cornell_box")
    view = fixtures.view_of(inputs)
    cameras = [
        classes.PerspectiveCamera(48, 48, fov=60.0, **view),
        classes.OrthographicCamera(48, 48, screen_window=(-1.2, 1.2, -1.2, 1.2), **view),
    ]
    pictures = [np.asarray(tt.A1Renderer(scene, camera=camera).use("normal").image()) for camera in cameras]
    scene.destroy()
    return {"picture": np.concatenate(pictures, axis=1)}


SAME, CAMERAS = Numbers(1e-4, called="pixels"), Numbers(1e-4, called="cameras")
RUN_SCREEN = fixtures.on_rows(screen, ["pixel"], {"screen": 2}, fixtures.camera_of)
PARTS = (
    method("PerspectiveCamera.compute_matrix", 3, FRAME, fixtures.places, fixtures.run_matrix, CAMERAS),
    method("PerspectiveCamera.pixel_to_screen", 3, SCREEN, pixels, RUN_SCREEN, SAME),
    method("PerspectiveCamera.generate_ray", 3, RAYS, pixels, fixtures.RUN_EYE_RAYS, SAME),
    method("OrthographicCamera.generate_ray", 3, RAYS, pixels, fixtures.RUN_EYE_RAYS, SAME),
    picture("two cameras", 1, cornell_view, run_picture),
)
