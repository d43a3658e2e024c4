"""What a study of accuracy found, as tables, as sentences, and as numbers for other programs."""

import csv
import io
import json
import math
import statistics
from dataclasses import asdict

import numpy as np

from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.studies.convergence import MIDDLE, TARGETS, Curve, Study, error_ratio, time_ratio
from taichi_tracer.studies.variants import OF_QUESTIONS, is_of_the_chart
from taichi_tracer.system.digits import digits

PERCENT = ("missing light", "standard error", "noise")  # beginnings of the columns that are shown in percent
CERTAIN = 1.5  # of the ends of an interval: a ratio that is known no better than within this factor is noise
SAME = 0.02  # as a fraction: what is no farther from 1 is the same
WORTH_TELLING = 0.3  # seconds that a second run is spared: less is not told
FEW_PIXELS = 0.001  # of the picture: where so few hold half of the squared error, that is told
NAMES = {"f32": "Float32", "f64": "Float64", "moller_trumbore": "Möller–Trumbore", "watertight": "The watertight test"}


def efficiency_table(study: Study) -> list[dict]:
    """A row for each variant: the seconds to each error, NaN where it was not reached; and whether it is biased."""
    whole = [c.seconds_to(MIDDLE) for c in study.curves if c.variant.scale == 1]
    best = min((seconds for seconds in whole if seconds > 0), default=math.nan)
    return [
        {
            "variant": curve.variant.label,
            **{f"s to {target:.0%}": curve.seconds_to(target) for target in TARGETS},
            "last error": curve.last[1],
            "after s": curve.last[0],
            f"ratio at {MIDDLE:.0%}": curve.seconds_to(MIDDLE) / best,
            "ms per sample": curve.milliseconds_per_sample,
            "time factor": curve.time_factor,
            "variance x time": curve.variance_times_time,
            "slope": curve.slope,
            "compile s": curve.compile_seconds,
            "bias z": curve.bias,
            "unseen": curve.unseen,
        }
        for curve in study.curves
    ]


def knob_table(study: Study) -> list[dict]:
    """What turning one knob alone does to the error, at equal samples, and to the time of one; with 95 % intervals."""
    rows = []
    for i, base in enumerate(study.curves):
        for other in study.curves[i + 1 :]:
            knob, *more = base.variant.differences(other.variant)
            if more or knob in OF_QUESTIONS:
                continue
            row = {
                "knob": knob.replace("_", " "),
                "from": base.variant.setting(knob),
                "to": other.variant.setting(knob),
                "with": base.variant.sampler if knob == "estimator" else base.variant.estimator,
            }
            for name, ratio in (("error", error_ratio), ("time", time_ratio)):
                row[name], row[f"{name} low"], row[f"{name} high"] = ratio(base, other)
            rows.append(row | {"error² x time": row["error"] ** 2 * row["time"]})
    return rows


def is_noise(ratio: float, low: float, high: float) -> bool:
    """Whether a ratio is only noise: it cannot be told from 1, and is not known well enough to say that it is 1."""
    return low < 1 < high and high / low > CERTAIN


def ratio_in_words(low: float, high: float, ratio: float) -> str:
    """ "1.31 (1.25 to 1.38)", or that it cannot be told from 1."""
    if low <= 1 <= high and high / low < 1 + 4 * SAME:
        return "1.00 (the same)" if abs(ratio - 1) <= SAME else f"{ratio:.2f} (hardly another)"
    if low <= 1 <= high:
        return f"noise ({low:.2g} to {high:.2g})"
    return f"{ratio:.2f} ({low:.2f} to {high:.2f})"


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
    """The curves in which nothing but a knob differs, from the first variant from which this knob is turned alone."""
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
    return samples, [float(np.sqrt(np.nanmean(np.square(column)))) for column in columns]


def summary(study: Study, target: float = MIDDLE) -> list[str]:
    """What the study found, a sentence for each finding, the most important first."""
    sentences = [*who_wins(study, target), *who_met_no_light(study), *who_is_biased(study)]
    sentences += [*what_samplers_bring(study), *told_of_paths(study), *what_knobs_bring(study)]
    sentences += [*what_the_wait_is(study, target), *where_the_error_is(study)]
    return [*sentences, *([study.others] if study.others else []), *study.notes]


def main_curves(study: Study) -> list[Curve]:
    """The curves that the chart compares: of whole pictures, in which no further knob is turned."""
    return [c for c in study.curves if is_of_the_chart(c.variant, study.base)]


def who_wins(study: Study, target: float) -> list[str]:
    """Which variant reaches an error first, and which of the others reach it, too."""
    main, words = main_curves(study), f"{100 * target:g} %"
    told = sorted((c for c in main if c.seconds_to(target) > 0), key=lambda c: c.seconds_to(target))
    if not told:
        best = min(main, key=lambda c: c.last[1])
        seconds, error = best.last
        nearest = f": {best.variant.label} came nearest, with {percent(error)} after {seconds:.3g} s of rendering"
        if any(c.is_unsure for c in main):
            nearest = ""  # an error that measures chance is no merit
        easier = [t for t in TARGETS if t > target and any(c.seconds_to(t) > 0 for c in main)]
        sentences = who_wins(study, easier[-1]) if easier else []
        return [f"No variant reached {words} within the {study.budget:g} s of the study{nearest}.", *sentences]
    best = told[0]
    alike = [c for c in told[1:] if cannot_be_told_apart(best, c, target)]
    least = best.seconds_to(target)
    sentence = f"To {words} error, {best.variant.label} is fastest: {show_seconds(least)} of rendering"
    if alike:
        sentence += f"; the time of {' and of '.join(c.variant.label for c in alike)} cannot be told from it"
    sentences = [f"{sentence}."]
    others = [c for c in told[1:] if c not in alike]
    if others:
        worst, most = others[-1], others[-1].seconds_to(target)
        sentences.append(f"{worst.variant.label} needs {show_seconds(most)} for it, {times_as_long(most / least)}.")
    return [*sentences, *who_missed([c for c in main if c not in told], study, words)]


def who_missed(missed: list[Curve], study: Study, words: str) -> list[str]:
    """How near those came that did not reach an error: all with the first sampler, and the best of each other one."""
    named = [c for c in missed if c.variant.sampler == study.base.sampler]
    for sampler in dict.fromkeys(c.variant.sampler for c in missed if c not in named):
        named.append(min((c for c in missed if c.variant.sampler == sampler), key=lambda c: c.last[1]))
    if not missed:
        return []
    near = [f"{c.variant.label} came to {percent(c.last[1])} in {c.last[0]:.2g} s" for c in named]
    return [f"Others did not reach {words} in the time that they had: {'; '.join(near)}."]


def cannot_be_told_apart(a: Curve, b: Curve, target: float) -> bool:
    """Whether the seconds to an error of two variants differ by less than they are uncertain."""
    ratio = b.seconds_to(target) / a.seconds_to(target)
    return max(ratio, 1 / ratio) < math.exp(math.hypot(*(math.log(f) for f in (a.time_factor, b.time_factor))))


def who_met_no_light(study: Study) -> list[str]:
    """Which variants hardly met what lights the scene, so that their errors say little; and what may hide elsewhere."""
    main = main_curves(study)
    sentences = [
        f"{c.variant.label} met the light in {c.unmet[0]:,} of the {c.unmet[1]:,} pixels where it is rare: "
        "its error is unknown."
        for c in main
        if c.unmet is not None
    ]
    hidden = [c for c in main if c.unmet is None and c.is_unsure]
    if hidden:
        low, high = (percent(f(c.unseen for c in hidden)) for f in (min, max))
        labels = "; ".join(c.variant.label for c in hidden)
        what = f"{low} to the error" if low == high else f"{low} to {high} to the errors"
        sentences.append(f"Light that no sample met may add {what} of {labels}.")
    return sentences


def who_is_biased(study: Study) -> list[str]:
    """Which variants differ from the reference by more than chance explains."""
    return [
        f"{c.variant.label} differs from the reference by {percent(c.shift)} of the light, {abs(c.bias):.0f} standard "
        "errors: one of the two is biased."
        for c in study.curves
        if abs(c.bias) > 4 and not c.is_biased
    ]


def what_samplers_bring(study: Study) -> list[str]:
    """How much smaller the error is with the better of two samplers, at equal samples, or that it is chance."""
    rows = [r for r in knob_table(study) if r["knob"] == "sampler"]
    sentences = []
    for first, second in dict.fromkeys((r["from"], r["to"]) for r in rows):
        own = [r for r in rows if (r["from"], r["to"]) == (first, second) and r["error"] > 0]
        if not own:
            if any(c.is_unsure for c in study.curves):
                sentences.append(f"What {second} numbers bring is unknown: light that no sample met may outweigh it.")
            continue
        low, gain, high = (statistics.median(r[name] for r in own) for name in ("error low", "error", "error high"))
        better, worse = (first, second) if gain > 1 else (second, first)
        factor = max(gain, 1 / gain)
        if low <= 1 <= high:
            told = f"the errors of {first} and {second} numbers differ by no more than chance"
        else:
            told = (
                f"{worse} numbers have {factor:.2g} times the error of {better} (median over estimators): with "
                f"independent samples, that would cost {factor**2:.2g} times the time"
            )
        sentences.append(f"At equal samples, {told}.")
    return sentences


SUBJECTS = {
    "fast math": lambda to: "No fast math" if "no" in to else "Fast math",
    "plain": lambda to: "The readable code (plain forms)",
    "lookup": lambda to: f"The {to} look-up",
    "adaptive": lambda to: "Adaptive sampling",
    "intersector": lambda to: f"The intersector {to}",
    "scale": lambda to: "Half of the resolution",
}


def what_knobs_bring(study: Study) -> list[str]:
    """A sentence for each knob beside estimator and sampler, with its uncertainty, or that it is noise."""
    sentences = []
    for r in knob_table(study):
        if r["knob"] in ("estimator", "sampler"):
            continue
        subject = SUBJECTS.get(r["knob"], lambda to: NAMES.get(to, to))(r["to"])
        time, low, high = r["time"], r["time low"], r["time high"]
        if low <= 1 <= high:
            told = f"{subject}: no difference in time can be told from noise ({low:.2f} to {high:.2f} times)"
        else:
            told = f"{subject} takes {time:.2f} times the time of a sample ({low:.2f} to {high:.2f})"
        sentences.append(f"{told}, {error_in_words(r)}.")
    return sentences


def error_in_words(row: dict) -> str:
    """How the error of a row changes, at equal samples."""
    low, high, ratio = row["error low"], row["error high"], row["error"]
    if math.isnan(ratio):
        return "and what it does to the error is unknown"
    if abs(ratio - 1) <= SAME and high / low < 1 + 4 * SAME:
        return "with the same error"
    if low <= 1 <= high:
        return f"and the error differs by no more than chance ({low:.2g} to {high:.2g} times)"
    return f"with {ratio:.2f} times the error at equal samples"


def what_the_wait_is(study: Study, target: float) -> list[str]:
    """What a user waits for a picture before its samples are even begun, and what a second run is spared."""
    told = [c for c in main_curves(study) if c.seconds_to(target) > 0] or main_curves(study)
    best = min(told, key=lambda c: c.seconds_to(target) if c.seconds_to(target) > 0 else math.inf)
    before = study.start_seconds + study.facts.read_seconds + best.compile_seconds
    if math.isnan(before):
        return []
    rendering = best.seconds_to(target)
    sentence = (
        f"Before its first sample, {best.variant.label} takes {before:.1f} s: {study.start_seconds:.1f} s to start, "
        f"{study.facts.read_seconds:.1f} s to read the scene, {best.compile_seconds:.1f} s to compile"
    )
    if rendering > 0:
        share, whole = 100 * before / (before + rendering), before + rendering
        sentence += f"; that is {share:.0f} % of the {whole:.1f} s to {100 * target:g} %"
    if best.seconds_to_save >= WORTH_TELLING:
        saved = max(0.0, before - best.seconds_to_save)
        sentence += f". A second run finds the compiled kernels and takes about {saved:.1f} s before its first sample"
    else:
        sentence += ". It found its kernels as an earlier run had compiled them; a first run takes longer"
    return [f"{sentence}."]


def told_of_paths(study: Study) -> list[str]:
    """Sentences on bounces, on roulette and on the choice of lamps, as far as they were compared."""
    sentences, bounces = [], bounce_table(study)
    if bounces:
        hidden = [r for r in bounces if abs(r["missing light"]) < 2 * r["standard error"]]
        clear = [r for r in bounces if r not in hidden]
        if clear:
            r, most = clear[-1], bounces[-1]["bounces"]
            few = "1 bounce" if r["bounces"] == 1 else f"{r['bounces']} bounces"
            sentences.append(
                f"Paths of at most {few} miss {100 * r['missing light']:.2g} % of the light, with a standard "
                f"error of {100 * r['standard error']:.1g} %, and take {100 * r['time']:.0f} % of the time of {most}."
            )
        if hidden and hidden[0] is not bounces[-1]:
            least = hidden[0]["bounces"]
            sentences.append(f"From {least} bounces on, what is missing cannot be told from its standard error.")
    for knob, what in (("roulette", "roulette"), ("lamp_choice", "choice of lamps")):
        rows = [r for r in efficiency_of(study, knob) if r["efficiency"] > 0]
        if rows:
            best = max(rows, key=lambda r: r["efficiency"])
            name, first = best[knob.replace("_", " ")], rows[0][knob.replace("_", " ")]
            told = f"{name[0].upper()}{name[1:]} is {best['efficiency']:.3g} times as efficient as {first}."
            sentences.append(f"No {what} is more efficient than {first}." if best is rows[0] else told)
    return sentences


def times_as_long(ratio: float) -> str:
    """A ratio of times in words: digits that can be told from 1, and no more than two."""
    if ratio < 1.05:
        return "about as long"
    return f"{ratio:,.0f} times as long" if ratio >= 10 else f"{ratio:.2g} times as long"


def where_the_error_is(study: Study) -> list[str]:
    """A sentence on how many pixels hold half of the squared error of the best picture at equal time."""
    shown = [c for c in study.curves if c.shown is not None]
    if not shown:
        return []
    best = min(shown, key=lambda c: c.shown.error)
    truth = study.truths[best.variant.lookup]
    squares = np.sort(((best.shown.image - truth.image) ** 2).sum(axis=2).ravel())[::-1]
    count = int(np.searchsorted(np.cumsum(squares), squares.sum() / 2)) + 1
    told = f"Half of the squared error of {best.variant.label} lies in {count:,} of {squares.size:,} pixels"
    if count <= FEW_PIXELS * squares.size:
        rest = math.sqrt(squares[count:].sum() / (3 * squares.size)) / truth.mean
        told += f": these decide the error of {percent(best.shown.error)}, of which the others make {percent(rest)}"
    return [f"{told}."]


def show_seconds(seconds: float) -> str:
    """ "1.23 s", or "not reached"."""
    return "not reached" if math.isnan(seconds) else f"{seconds:.3g} s"


def show(value: float) -> str:
    """Three digits, or "?"."""
    return "?" if math.isnan(value) else digits(value, ".3g")


def in_words(rows: list[dict]) -> list[dict]:
    """Rows whose numbers are words with three digits, errors in percent."""

    def in_word(name: str, value) -> str:
        if name.startswith(PERCENT):
            return f"{show(100 * value)} %"
        return show(value) if isinstance(value, float) else str(value)

    return [{name: in_word(name, value) for name, value in row.items()} for row in rows]


# ── as numbers ──


def table_rows(study: Study) -> list[dict]:
    """A row for every picture that was compared: variant, seed, samples, seconds, error."""
    return [
        {
            **asdict(curve.variant),
            "seed": seed + 1,
            "samples": int(samples),
            "seconds": float(seconds),
            "relative_rmse": float(errors[seed]),
            "noise": float(noise[seed]),
            "missing_light": -curve.shift,
            "missing_light_standard_error": curve.shift_error,
            "compile_seconds": curve.compile_seconds,
        }
        for curve in study.curves
        for seed in range(len(curve.found))
        for samples, seconds, errors, noise in zip(
            curve.samples, curve.mean_seconds, curve.errors.T, curve.noise.T, strict=True
        )
        if not math.isnan(errors[seed])
    ]


def as_csv(study: Study) -> str:
    """``table_rows`` as CSV; the first line names the columns."""
    buffer, rows = io.StringIO(), table_rows(study)
    writer = csv.DictWriter(buffer, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return buffer.getvalue()


def as_json(study: Study) -> str:
    """Everything but the pictures, as JSON; a number that is not known is null."""
    content = {
        "scene": study.facts.title,
        "size": list(study.size),
        "machine": study.facts.machine,
        "budget": study.budget,
        "seconds": study.seconds,
        "start_seconds": study.start_seconds,
        "read_seconds": study.facts.read_seconds,
        "kernels_compiled": study.kernels_made,
        "reference": {
            "samples": study.truth.samples,
            "relative_rmse": float(study.truth.error),
            "max_bounces": study.reference_bounces,
        },
        "summary": summary(study),
        "costs": efficiency_table(study),
        "knobs": knob_table(study),
        "bounces": bounce_table(study),
        "roulettes": efficiency_of(study, "roulette"),
        "lamp choices": efficiency_of(study, "lamp_choice"),
        "measurements": table_rows(study),
    }
    read_again = json.loads(json.dumps(content), parse_constant=lambda _: None)  # NaN is no JSON
    return json.dumps(read_again, indent=1)
