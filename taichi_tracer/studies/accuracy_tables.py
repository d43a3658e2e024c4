"""What a study of accuracy found: what an error costs, what each knob buys, what bounces bring, and some sentences."""

import math
import statistics

import numpy as np

from taichi_tracer.studies.convergence import GLARE, TARGETS, Curve, Study, without_glare

WITH_TABLES = ("max_bounces", "roulette", "lamp_choice")  # knobs that have tables of their own

MAIN = {"estimator", "sampler", *WITH_TABLES}  # knobs whose settings are compared in the chart and in the summary


def efficiency_table(study: Study) -> list[dict]:
    """A row for each variant: what it costs to reach an error, and whether it is biased."""
    rows, middle = [], TARGETS[2]
    whole = [c.seconds_to(middle)[0] for c in study.curves if c.variant.scale == 1]
    best = min((seconds for seconds in whole if seconds > 0), default=math.nan)
    for curve in study.curves:
        row = {"variant": curve.variant.label}
        for target in TARGETS:
            seconds, is_measured = curve.seconds_to(target)
            row[f"s to {target:.0%}"] = seconds
            row[f"measured {target:.0%}"] = is_measured
        row[f"ratio at {middle:.0%}"] = curve.seconds_to(middle)[0] / best
        row["ms per sample"] = curve.milliseconds_per_sample
        row["variance x time"] = curve.variance_times_time
        row["slope"] = curve.slope
        row["compile s"] = curve.compile_seconds
        row["bias z"] = curve.bias
        rows.append(row)
    return rows


def knob_table(study: Study) -> list[dict]:
    """What turning one knob alone does to the error, at equal samples, and to the time of one."""
    rows = []
    for base in study.curves:
        for other in study.curves:
            changed = base.variant.differences(other.variant)
            is_usual_first = study.curves.index(base) < study.curves.index(other)
            if len(changed) != 1 or changed[0] in WITH_TABLES or not is_usual_first:
                continue
            error = error_ratio(base, other)
            factor = other.milliseconds_per_sample / base.milliseconds_per_sample
            rows.append(
                {
                    "knob": changed[0].replace("_", " "),
                    "from": base.variant.setting(changed[0]),
                    "to": other.variant.setting(changed[0]),
                    "with": base.variant.sampler if changed[0] == "estimator" else base.variant.estimator,
                    "error": error,
                    "time": factor,
                    "error² x time": error**2 * factor,
                }
            )
    return rows


def bounce_table(study: Study) -> list[dict]:
    """A row for each number of bounces, the fewest first: its time, what light is missing, and the noise beside it.

    Light is missing as a fraction of the mean of the reference, which has the most bounces; it has the unit of the
    relative error, so that bias and noise can be compared. Noise is at the largest number of samples that all have.
    """
    curves = sorted(turned(study, "max_bounces"), key=lambda c: c.variant.max_bounces)
    if len(curves) < 2:
        return []
    samples, noise = noise_at_equal_samples(curves)
    return [
        {
            "bounces": c.variant.max_bounces,
            "ms per sample": c.milliseconds_per_sample,
            "time": c.milliseconds_per_sample / curves[-1].milliseconds_per_sample,
            "mean": c.reference_mean * (1 + c.shift),
            "missing light": -c.shift,
            "standard error": c.shift_error,
            f"noise at {samples} spp": e,
        }
        for c, e in zip(curves, noise, strict=True)
    ]


def efficiency_of(study: Study, knob: str) -> list[dict]:
    """A row for each setting of a knob: noise at equal samples, time, and efficiency relative to the first setting.

    Efficiency is 1/(variance × seconds): twice the efficiency reaches the same error in half of the time.
    """
    curves = turned(study, knob)
    if len(curves) < 2:
        return []
    samples, noise = noise_at_equal_samples(curves)
    first, rows = curves[0], []
    for c, e in zip(curves, noise, strict=True):
        time = c.milliseconds_per_sample / first.milliseconds_per_sample
        variance = (e / noise[0]) ** 2 if noise[0] > 0 else math.nan
        rows.append(
            {
                knob.replace("_", " "): c.variant.setting(knob),
                "ms per sample": c.milliseconds_per_sample,
                f"noise at {samples} spp": e,
                "time": time,
                "variance": variance,
                "efficiency": 1 / (variance * time) if variance > 0 else math.nan,
            }
        )
    return rows


def turned(study: Study, knob: str) -> list[Curve]:
    """The curves in which nothing but a knob differs, from the variant from which every knob is turned alone."""
    of_knob = [c for c in study.curves if c.variant.differences(study.curves[0].variant) == [knob]]
    if of_knob:
        return [study.curves[0], *of_knob]
    for base in study.curves:
        others = [c for c in study.curves if base.variant.differences(c.variant) == [knob]]
        if others:
            return [base, *others]
    return []


def noise_at_equal_samples(curves: list[Curve]) -> tuple[int, list[float]]:
    """(samples per pixel, root mean square over the seeds of what each curve's pictures tell of their error there)."""
    common = set.intersection(*(set(c.samples.tolist()) for c in curves))
    samples = max(common)
    columns = [c.noise[:, c.samples.tolist().index(samples)] for c in curves]
    return samples, [float(np.sqrt(np.square(column).mean())) for column in columns]


def error_ratio(base: Curve, other: Curve) -> float:
    """Error of one variant over that of another, at the most samples at which both are known."""
    _, i, j = np.intersect1d(base.samples, other.samples, return_indices=True)
    ratios = other.mean_errors[j] / base.mean_errors[i]
    known = ratios[np.isfinite(ratios)]
    return float(known[-1]) if known.size else math.nan


def summary(study: Study, target: float = TARGETS[2]) -> list[str]:
    """A few sentences on what the study found."""
    usual = study.curves[0].variant
    main = [c for c in study.curves if set(c.variant.differences(usual)) <= MAIN]
    told = sorted((c for c in main if c.seconds_to(target)[0] > 0), key=lambda c: c.seconds_to(target)[0])
    if not told:
        advice = f"No variant came near enough to {target:.0%} for its time to be told: give a larger budget."
        return [advice, *told_of_paths(study), where_the_error_is(study), *study.notes]
    best, worst = told[0], told[-1]
    sentences = [f"To {target:.0%} error, {best.variant.label} is cheapest: {show_seconds(best.seconds_to(target))}."]
    if worst is not best:
        ratio = worst.seconds_to(target)[0] / best.seconds_to(target)[0]
        seconds = show_seconds(worst.seconds_to(target))
        sentences.append(f"{worst.variant.label} needs {seconds}, {times_as_long(ratio)}.")
    rows = knob_table(study)
    samplers = [r["error"] for r in rows if r["knob"] == "sampler" and r["error"] > 0]
    if samplers:
        gain = statistics.median(max(r, 1 / r) for r in samplers)
        sentences.append(
            f"At equal samples, one sampler has {gain:.1f} times the error of the other (median over estimators)."
        )
    sentences += told_of_paths(study)
    knobs = [r for r in rows if r["knob"] in ("precision", "triangle test", "fast math", "plain")]
    if knobs:
        times = ", ".join(
            f"{r['to']} {r['time']:.2f} times the time at {r['error']:.3g} times the error" for r in knobs
        )
        sentences.append(f"How single rays are computed: {times}.")
    return [*sentences, where_the_error_is(study), *study.notes]


def told_of_paths(study: Study) -> list[str]:
    """Sentences on bounces, on roulette and on the choice of lamps, as far as they were compared."""
    sentences, bounces = [], bounce_table(study)
    if bounces:
        hidden = [r for r in bounces if abs(r["missing light"]) < 2 * r["standard error"]]
        clear = [r for r in bounces if r not in hidden]
        if clear:
            r, most = clear[-1], bounces[-1]["bounces"]
            bounces_of = "1 bounce" if r["bounces"] == 1 else f"{r['bounces']} bounces"
            sentences.append(
                f"Paths of at most {bounces_of} miss {100 * r['missing light']:.2g} % of the light, with a "
                f"standard error of {100 * r['standard error']:.1g} %, and take {r['time']:.0%} of the time of {most}."
            )
        if hidden and hidden[0] is not bounces[-1]:
            least = hidden[0]["bounces"]
            sentences.append(f"From {least} bounces on, what is missing cannot be told from its standard error.")
    for knob, what in (("roulette", "roulette"), ("lamp_choice", "choice of lamps")):
        rows = [r for r in efficiency_of(study, knob) if r["efficiency"] > 0]
        if rows:
            best = max(rows, key=lambda r: r["efficiency"])
            name, first = best[knob.replace("_", " ")], rows[0][knob.replace("_", " ")]
            if best is rows[0]:
                sentences.append(f"No {what} is more efficient than {first}.")
            else:
                sentences.append(
                    f"{name[0].upper()}{name[1:]} is {best['efficiency']:.3g} times as efficient as {first}."
                )
    return sentences


def times_as_long(ratio: float) -> str:
    """A ratio of times in words: digits that can be told from 1, and no more than two."""
    if ratio < 1.05:
        return "about as long"
    return f"{ratio:,.0f} times as long" if ratio >= 10 else f"{ratio:.2g} times as long"


def where_the_error_is(study: Study) -> str:
    """A sentence on how many pixels hold half of the squared error of the best picture at equal time."""
    best = min((c for c in study.curves if c.image is not None), key=lambda c: c.image_error)
    reference = study.references[best.variant.lookup]
    squares = np.sort(((best.image - reference) ** 2).sum(axis=2)[without_glare(reference)])[::-1]
    count = int(np.searchsorted(np.cumsum(squares), squares.sum() / 2)) + 1
    told = f"Half of the squared error of {best.variant.label} lies in {count} of {squares.size} pixels."
    if study.glaring == 0:
        return told
    return f"{told} {study.glaring} more are over {GLARE} times as bright as the picture, and left out of every error."


def show_seconds(value: tuple[float, bool]) -> str:
    """ "1.23 s", "about 45 s" where it was not measured, "?" where it cannot be told."""
    seconds, is_measured = value
    if math.isnan(seconds):
        return "?"
    return f"{'' if is_measured else 'about '}{seconds:.3g} s"
