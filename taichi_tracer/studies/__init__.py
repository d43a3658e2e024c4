"""What accuracy costs, what breaks, and what a scene needs: measured on the machine at hand."""

from typing import NamedTuple


class Accuracy(NamedTuple):
    """What ``accuracy`` found.

    Attributes:
        table: a row per variant: a ``pandas.DataFrame`` where pandas is installed, else name → array.
        figure: the chart, a ``matplotlib`` figure.
    """

    table: object
    figure: object


def accuracy(
    scene,
    environment=None,
    size: tuple[int, int] = (128, 128),
    budget: float = 60.0,
    seeds: int = 3,
    report=None,
    **knobs,
) -> Accuracy:
    """What does accuracy cost in time? Every way to render a scene, against a reference.

    Args:
        scene: a name, a path, or a ``SceneData``. Given by name, precision and fast math are compared too, which starts
            Taichi anew: scenes that were made before cannot be used afterwards.
        environment: what lights it; None takes the scene's own, or the studio.
        size: width and height.
        budget: seconds in all, compilation included.
        seeds: renderings of every variant.
        report: a folder that exists, for ``accuracy.html`` and the numbers as files; None writes nothing.
        knobs: what is compared: estimators, samplers, precisions, triangle_tests, fast_math, lookups, adaptive, scales,
            intersectors, forms; a tuple each. See ``variants.plan``.
    """
    from pathlib import Path

    import numpy as np

    from taichi_tracer.studies import accuracy_chart, accuracy_report, accuracy_tables, convergence, variants
    from taichi_tracer.system import runtime

    source = variants.Source(scene, environment)
    if source.is_loaded:
        settings = runtime.current()
        knobs = {"precisions": (settings.precision,), "fast_math": (settings.fast_math,)} | knobs
    study = convergence.measure(source, variants.plan(**knobs), size, budget, seeds)
    if report is not None:
        accuracy_report.write(study, Path(report))
    rows = accuracy_tables.efficiency_table(study)
    table = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    try:
        import pandas
    except ImportError:
        return Accuracy(table, accuracy_chart.draw(study))
    return Accuracy(pandas.DataFrame(table), accuracy_chart.draw(study))
