"""Measurements on the user's machine: what accuracy costs, what breaks, and what effects cost.

A file has one study, which returns numbers, or a part that studies share. Add a study as a new file and a command for
it; hard cases belong to the folder ``hard``.
"""

from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from taichi_tracer.options import EnvironmentChoice
    from taichi_tracer.scene_data import SceneData


def accuracy(
    scene: "str | Path | SceneData",
    environment: "EnvironmentChoice" = None,
    size: tuple[int, int] = (128, 128),
    budget: float = 60.0,
    seeds: int = 3,
    report: str | Path | None = None,
    *,
    estimators: Sequence[str] | None = None,
    samplers: Sequence[str] | None = None,
    precisions: Sequence[str] | None = None,
    triangle_tests: Sequence[str] | None = None,
    fast_math: Sequence[bool] | None = None,
    lookups: Sequence[str] | None = None,
    adaptive: Sequence[bool] | None = None,
    scales: Sequence[float] | None = None,
    intersectors: Sequence[str] | None = None,
    lamp_choices: Sequence[str] | None = None,
    max_bounces: Sequence[int] | None = None,
    roulettes: Sequence[str | float] | None = None,
    rr_start_bounce: int | None = None,
) -> tuple[dict[str, Any], Any]:
    """What does accuracy cost in time? Every way to render a scene, against a reference.

    A scene that is given by name or path is rendered in processes of its own: nothing of the caller's is touched, and
    Taichi need not run here. A ``SceneData`` is rendered here, in the running precision, as is a scene where the caller
    has registered parts or replaced methods, which other processes do not have.

    Args:
        scene: a name, a path, or a ``SceneData``.
        environment: what lights it, or "none"; None takes the scene's own light, or the studio if it has none.
        size: width and height.
        budget: seconds of measuring. Starting and compiling come before.
        seeds: pictures of every variant.
        report: a folder that exists, for ``accuracy.html`` and the numbers as files; None writes nothing.
        estimators, samplers, precisions, triangle_tests, fast_math, lookups, adaptive, scales, intersectors,
            lamp_choices, max_bounces, roulettes: what is compared. If several values of one are given, only what is
            given is compared; otherwise ``variants.USUAL``. A scene that is rendered here keeps the running precision
            and fast math.
        rr_start_bounce: after so many bounces, roulette may end a path.

    Returns:
        A table with a row per variant, name → array of each column, of which ``pandas.DataFrame(table)`` makes one of
        pandas; and the chart, a ``matplotlib`` figure.
    """
    given, start = locals(), perf_counter()  # the knobs have their names in ``variants``
    import numpy as np

    from taichi_tracer.files.disk import replace_file
    from taichi_tracer.studies import accuracy_report, variants
    from taichi_tracer.studies.study import Study
    from taichi_tracer.studies.variants import Bench
    from taichi_tracer.system import runtime
    from taichi_tracer.system.parts import PARTS, assigned

    knobs: dict[str, Any] = {name: given[name] for name in variants.USUAL}
    # Parts, or methods in place of the package's, that another process would not find.
    has_own = bool(assigned()) or not all(map(PARTS.comes_with_package, PARTS.everything()))
    bench = Bench(scene, environment, size, here=has_own)
    if bench.here:
        settings = runtime.ensure()
        running = {"precisions": (settings.precision,), "fast_math": (settings.fast_math,)}
        knobs |= {name: value for name, value in running.items() if knobs[name] is None}
    plan = variants.plan(3 if rr_start_bounce is None else rr_start_bounce, **knobs)
    study = Study(bench, plan, budget, seeds, started=start).run()
    if report is not None:
        for name, content in accuracy_report.contents(study).items():
            replace_file(Path(report) / name, content)
    table = {
        "variant": np.array([curve.label for curve in study.curves]),
        "samples": np.array([curve.samples for curve in study.curves]),
        "seconds": np.array([curve.rounds[-1][-1].seconds for curve in study.curves]),
        "error": np.array([curve.error.value for curve in study.curves]),
        "seconds per sample": np.array([curve.sample_seconds.value for curve in study.curves]),
        "compile seconds": np.array([curve.compile_seconds for curve in study.curves]),
    }
    return table, accuracy_report.draw(study)
