"""While the camera moves: a picture of a half or a quarter of the width and height where the whole one is too slow."""

import copy

from taichi_tracer.apps.page.renderer_state import copy_values
from taichi_tracer.progressive import ProgressiveRenderer

WANTED = {False: 1 / 42, True: 1 / 25}  # seconds of a frame at most: of a view, and of random samples
COARSEST = 4  # pixels of the whole picture that one of the coarse picture stands for, along each side
ROOM = 1.5  # how much faster a finer picture must be than what is wanted, before it is tried
SMALLEST = 64  # pixels of a side: no coarse picture is smaller


class Preview:
    """What is rendered of a renderer's picture while the camera moves. It learns from how long frames take."""

    def __init__(self) -> None:
        self._steps: dict[tuple, int] = {}  # the renderer and what it shows → pixels of the whole picture for one
        self._made: dict[tuple, ProgressiveRenderer] = {}
        self._is_new = False  # whether the next frame compiles something

    def of(self, renderer: ProgressiveRenderer) -> ProgressiveRenderer:
        """The renderer whose picture is to be shown now: the given one, or a coarse one that shows the same."""
        step = self._steps.get(key_of(renderer), 1)
        return renderer if step == 1 else self._coarse(renderer, step)

    def took(self, renderer: ProgressiveRenderer, seconds: float) -> None:
        """Note how long the last frame of a moving camera took, to render and to be made into bytes."""
        if self._is_new:
            self._is_new = False
            return
        key, wanted = key_of(renderer), WANTED[renderer.is_random]
        step = self._steps.get(key, 1)
        if seconds > wanted and may_be_coarse(renderer, 2 * step):
            self._steps[key] = 2 * step
        elif step > 1 and 4 * ROOM * seconds < wanted:
            self._steps[key] = step // 2

    def _coarse(self, renderer: ProgressiveRenderer, step: int) -> ProgressiveRenderer:
        view = {name: value for name, value in vars(renderer.camera.view).items() if value is not None}
        made = self._made.get((renderer, step))
        if made is None:
            camera = type(renderer.camera)(renderer.width // step, renderer.height // step, **view)
            options = {"sampler": renderer.sampler, "seed": renderer.seed}
            made = self._made[renderer, step] = type(renderer)(renderer.scene_data, camera=camera, **options)
        made.camera.set_camera_parameters(**view)
        if made.active.name != renderer.active.name or made.values() != renderer.values():
            made.use(copy.copy(renderer.active))
            copy_values(renderer, made)
            self._is_new = True
        return made.set_display(renderer.display.exposure, renderer.display.tone)


def key_of(renderer: ProgressiveRenderer) -> tuple:
    """What the time of a frame depends on most."""
    return renderer, renderer.active.name


def may_be_coarse(renderer: ProgressiveRenderer, step: int) -> bool:
    """Whether a coarse picture can be made: with a camera of the package, of a whole picture that is large enough."""
    is_whole = renderer.film.crop == (0, renderer.width, 0, renderer.height)
    is_own = not type(renderer.camera).__module__.startswith("taichi_tracer.")
    side = min(renderer.width, renderer.height) // step
    return step <= COARSEST and side >= SMALLEST and is_whole and not is_own and not renderer.has_own_display


def current(renderer: ProgressiveRenderer) -> ProgressiveRenderer:
    """A renderer that has a picture of what its camera sees now, which may be one sample."""
    return renderer if renderer.is_current() and renderer.film.samples > 0 else renderer.render()
