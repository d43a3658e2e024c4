"""The pictures whose means are frozen in ``means.json``, how one is made, and how it is compared.

A case is "RENDERER SCENE SHOWS". A picture has 32 × 32 pixels; ``blocks`` takes the mean of each of 4 × 4 blocks.
The file holds these means and, for estimators of light, the standard deviation of one block's mean from picture to
picture, found from ``SEEDS`` pictures of ``SPP`` samples each. Another sequence of random numbers passes, too.
``python -m acceptance.make``, run in the folder ``tests``, makes the file anew.
"""

import json
from pathlib import Path

import numpy as np

import taichi_tracer as tt

FILE = Path(__file__).with_name("means.json")
SIZE, BLOCKS, SPP, SEEDS = 32, 4, 16, 24
LIGHT = {"A3": 256, "A4": 32}  # samples of a picture that is compared: more than of one that is frozen
# Of one block, in standard deviations. A t of 7 with 23 degrees of freedom has a probability of 4e-7; there are 49
# numbers in each of 200 cases: a right package with other random numbers fails with a probability of 0.4 %.
DEVIATIONS = 7.0
ROUNDING = 2e-3  # of a view, and of a mean beside its own size
EDGE = 2 / 64 + ROUNDING  # two pixels of a block may see another triangle
EDGES = 4  # so many of the 48 numbers may differ by an edge


# Every estimator and path is frozen on these scenes; the others have one of each, since each is a kernel of its own.
WHOLE = {"A3": ("cornell_box", "cube"), "A4": ("caustic_sphere", "white_room")}
FEW_TRIANGLES = "cube", "white_room", "cornell_box"
USUAL = {"A3": "mis", "A4": "path"}


def names() -> list[str]:
    """Every case: scene × view, scene of RT3 × integrator, and of light what ``WHOLE`` and ``USUAL`` say."""
    found = []
    for kind in ("A1", "RT3", "A3", "A4"):
        for scene in tt.scene_names():
            shown = [name for name in renderer_class(kind).names() if name != "microfacet"]  # see ``wrong``
            if kind in LIGHT and scene not in WHOLE[kind]:
                shown = [USUAL[kind]]
            if kind != "RT3" or scene.startswith("rt3/"):
                found += [f"{kind} {scene} {shows}" for shows in shown]
    return found


def quick() -> list[str]:
    """Every scene, view and estimator at least once, with few kernels."""
    found = [f"A1 {scene} normal" for scene in tt.scene_names()]
    found += [f"A1 cornell_box {view}" for view in tt.A1Renderer.names() if view != "normal"]
    found += [f"RT3 rt3/transforms {view}" for view in tt.RT3Renderer.names() if view != "blinn_phong"]
    found += ["RT3 rt3/all_lights blinn_phong", "A3 specular_spheres mis"]
    found += [f"A3 cube {estimator}" for estimator in tt.A3Renderer.names() if estimator != "mis"]
    return found + [f"A4 white_room {path}" for path in tt.A4Renderer.names()]


def renderer_class(kind: str) -> type:
    """``tt.A1Renderer`` of "A1"."""
    return getattr(tt, f"{kind}Renderer")


class Maker:
    """Makes pictures; a scene is loaded once.

    Args:
        is_quick: whether scenes of a few triangles are lit without a hierarchy, whose kernels take longer to compile.
        options: of every scene.
    """

    def __init__(self, is_quick: bool = False, **options) -> None:
        self.is_quick, self.options, self.scenes, self.known = is_quick, options, {}, {}

    def scene(self, name: str, is_lit: bool) -> tt.SceneData:
        """A shipped scene, under the environment "studio" if it is lit; the forest has light of its own."""
        if (name, is_lit) not in self.scenes:
            light = {"environment": "studio"} if is_lit and name != "rt3/forest" else {}
            if is_lit and self.is_quick and name in FEW_TRIANGLES:
                light |= {"intersector": "brute_force", "triangle_test": "moller_trumbore"}
            self.scenes[name, is_lit] = tt.load_scene_data(name, **light, **self.options)
        return self.scenes[name, is_lit]

    def picture(self, case: str, seed: int = 1, spp: int = 0) -> np.ndarray:
        """(32, 32, 3): a view with one sample, light with ``spp``, or as many as its kind has in ``LIGHT``."""
        kind, name, shows = case.split()
        scene = self.scene(name, kind in LIGHT)
        renderer = renderer_class(kind)(scene_data=scene, width=SIZE, height=SIZE, seed=seed)
        return np.asarray(renderer.use(shows).render(spp or LIGHT.get(kind, 1)).image())

    def blocks(self, case: str, seed: int = 1, spp: int = 0) -> np.ndarray:
        """The means of the blocks of one picture, which is made once."""
        if (case, seed, spp) not in self.known:
            self.known[case, seed, spp] = blocks(self.picture(case, seed, spp))
        return self.known[case, seed, spp]


def blocks(image: np.ndarray) -> np.ndarray:
    """(4, 4, 3): the mean of each block."""
    side = SIZE // BLOCKS
    return image.astype(float).reshape(BLOCKS, side, BLOCKS, side, 3).mean((1, 3))


def known() -> dict:
    """Case → {"mean": 48 numbers, "sd": 16 numbers, "sd_all": 1 number}; a view has means only."""
    return json.loads(FILE.read_text(encoding="utf-8"))


def wrong(case: str, found: np.ndarray) -> str:
    """What is wrong about the means of the blocks; empty where nothing is."""
    entry = known()[case.replace(" microfacet", " brdf")]
    right = np.reshape(entry["mean"], found.shape)
    off = abs(found - right)
    if "sd" not in entry:
        edges = off > ROUNDING
        if not np.all(off <= EDGE) or edges.sum() > EDGES:
            return f"{case}: {edges.sum()} of 48 numbers are off, by up to {off.max():.4f}"
        return ""
    spread = DEVIATIONS * np.sqrt(SPP / LIGHT[case.split()[0]] + 1 / SEEDS)
    allowed = spread * np.reshape(entry["sd"], (BLOCKS, BLOCKS, 1)) + ROUNDING * right + 1e-5
    whole = abs(found.mean() - right.mean())
    whole_allowed = spread * entry["sd_all"] + ROUNDING * right.mean() + 1e-5
    if not np.all(off <= allowed):
        return f"{case}: a block is off by {np.nanmax(off / allowed) * DEVIATIONS:.1f} standard deviations"
    if not whole <= whole_allowed:
        return f"{case}: the mean is {found.mean():.5f}, not {right.mean():.5f} ± {whole_allowed:.5f}"
    return ""
