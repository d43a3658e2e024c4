"""What a study of accuracy found, as numbers: rows of tables, what is told of them, and files for other programs."""

import csv
import io
import json
import math
import statistics
from collections.abc import Iterator
from dataclasses import asdict
from itertools import combinations

import numpy as np

from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.studies import accuracy_sentences as sentences
from taichi_tracer.studies.convergence import MIDDLE, TARGETS, UNSEEN_SHARE, Curve, Study, error_ratio, time_ratio
from taichi_tracer.studies.variants import OF_QUESTIONS, is_of_the_chart

CERTAIN = 1.5  # of the ends of an interval: a ratio that is known no better than within this factor is noise
SAME = 0.02  # as a fraction: what is no farther from 1 is the same
SURE_BIAS = 4  # z-score: more is no chance
WORTH_TELLING = 0.3  # seconds that a second run is spared: less is not told
FEW_PIXELS = 0.001  # of the picture: where so few hold half of the squared error, that is told
COLUMNS = {  # of the knobs of which a study may ask
    "max_bounces": ("bounces", "ms per sample", "time", "mean", "missing light", "standard error", "noise"),
    "roulette": ("roulette", "ms per sample", "noise", "time", "variance", "efficiency"),
    "lamp_choice": ("lamp choice", "ms per sample", "noise", "time", "variance", "efficiency"),
}
Finding = tuple[list[str], dict]  # names of ``CLAUSES``, and the numbers in them


def efficiency_table(study: Study) -> list[dict]:
    """A row for each variant: the seconds to each error, NaN where it was not reached; and whether it is biased."""
    whole = [c.seconds_to(MIDDLE) for c in study.curves if c.variant.scale == 1]
    best = min((seconds for seconds in whole if seconds > 0), default=math.nan)
    return [
        {
            "variant": curve.variant.label,
            **{f"s to {target:.0%}": curve.seconds_to(target) for target in TARGETS},
            "best error": curve.best[1],
            "after s": curve.best[0],
            "rendered s": curve.rendered,
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
    for base, other in combinations(study.curves, 2):
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


def knob_rows(study: Study) -> list[dict]:
    """The rows of ``knob_table`` in which one knob is turned from the first variant, estimators left to the curves."""
    return [
        row
        for row in knob_table(study)
        if row["knob"] != "estimator"
        and row["with"] == study.base.estimator
        and row["from"] == study.base.setting(row["knob"].replace(" ", "_"))
    ]


def is_noise(ratio: float, low: float, high: float) -> bool:
    """Whether a ratio is only noise: it cannot be told from 1, and is not known well enough to say that it is 1."""
    return low < 1 < high and high / low > CERTAIN


def kind_of_ratio(ratio: float, low: float, high: float) -> str:
    """Which of ``RATIOS`` tells a ratio."""
    if not low <= 1 <= high:
        return "clear"
    if high / low < 1 + 4 * SAME:
        return "same" if abs(ratio - 1) <= SAME else "hardly another"
    return "noise"


def questions(study: Study) -> dict[str, list[dict]]:
    """Knob → a row for each of its settings, where nothing else differs; no rows if a study did not ask for it.

    Light is missing as a fraction of the mean of the reference, which has the most bounces; it has the unit of the
    relative error, so that bias and noise can be compared. Efficiency is 1/(variance × seconds): twice the efficiency
    reaches the same error in half of the time.
    """
    return {knob: rows_of_settings(turned(study, knob), knob) for knob in COLUMNS}


def turned(study: Study, knob: str) -> list[Curve]:
    """The curves in which nothing but a knob differs, from the first variant from which this knob is turned alone."""
    for base in study.curves:
        others = [c for c in study.curves if base.variant.differences(c.variant) == [knob]]
        if others:
            return sorted([base, *others], key=lambda c: c.variant.max_bounces)
    return []


def rows_of_settings(curves: list[Curve], knob: str) -> list[dict]:
    """``COLUMNS`` of a knob for each curve: times relative to the most bounces, or else to the first curve."""
    if not curves:
        return []
    samples = max(set.intersection(*(set(c.samples.tolist()) for c in curves)))
    noise = [float(np.sqrt(np.nanmean(np.square(c.noise[:, c.samples == samples])))) for c in curves]
    base, rows = curves[-1] if knob == "max_bounces" else curves[0], []
    for c, e in zip(curves, noise, strict=True):
        time = c.milliseconds_per_sample / base.milliseconds_per_sample
        variance = (e / noise[0]) ** 2 if noise[0] > 0 else math.nan
        row = {
            "bounces": c.variant.max_bounces,
            "roulette": c.variant.setting("roulette"),
            "lamp choice": c.variant.setting("lamp_choice"),
            "ms per sample": c.milliseconds_per_sample,
            "time": time,
            "mean": c.reference_mean * (1 + c.shift),
            "missing light": -c.shift,
            "standard error": c.shift_error,
            "noise": e,
            "variance": variance,
            "efficiency": 1 / (variance * time) if variance > 0 else math.nan,
        }
        names = {"noise": f"noise at {samples} spp"}
        rows.append({names.get(column, column): row[column] for column in COLUMNS[knob]})
    return rows


def main_curves(study: Study) -> list[Curve]:
    """The curves that the chart compares: of whole pictures, in which no further knob is turned."""
    return [c for c in study.curves if is_of_the_chart(c.variant, study.base)]


# ── findings ──


def who_wins(study: Study, target: float = MIDDLE) -> Iterator[Finding]:
    """Which variant reaches an error first, and which of the others reach it, too."""
    costs = dict(zip(study.curves, efficiency_table(study), strict=True))
    main, aim = main_curves(study), {"target": target, "budget": study.budget}
    reached = sorted((c for c in main if c.seconds_to(target) > 0), key=lambda c: c.seconds_to(target))
    if not reached:
        is_chance = any(c.is_unsure for c in main)  # an error that measures chance is no merit
        nearest = min(main, key=lambda c: c.best[1])
        rest = hidden_in(max(main, key=lambda c: c.unseen)) if is_chance else ["nearest"]
        rest += ["by luck"] if "nearest" in rest and nearest.best[1] <= target else []
        yield ["nobody", *rest], aim | costs[nearest] | {"unseen": max(c.unseen for c in main)}
        easier = [t for t in TARGETS if t > target and any(c.seconds_to(t) > 0 for c in main)]
        yield from who_wins(study, easier[-1]) if easier else ()
        return
    first, *others = reached
    least = first.seconds_to(target)
    alike = [c for c in others if cannot_be_told_apart(first, c, target)]
    numbers = aim | {"seconds": least, "alike": [c.variant.label for c in alike]}
    yield ["fastest", *hidden_in(first), *(["alike"] if alike else [])], costs[first] | numbers
    for slowest in [c for c in others if c not in alike][-1:]:
        most = slowest.seconds_to(target)
        yield ["slowest"], costs[slowest] | {"seconds": most, "ratio": most / least}
    missed = [c for c in main if c not in reached]
    named = [c for c in missed if c.variant.sampler == study.base.sampler]
    for sampler in dict.fromkeys(c.variant.sampler for c in missed if c not in named):  # the best of each other one
        named.append(min((c for c in missed if c.variant.sampler == sampler), key=lambda c: c.best[1]))
    if missed:
        yield ["missed"], aim | {"missed": [costs[c] for c in named]}


def hidden_in(curve: Curve) -> list[str]:
    """The clause that tells what light may be missing in a curve."""
    return ["hidden"] if curve.unseen > UNSEEN_SHARE * curve.last[1] else []


def cannot_be_told_apart(a: Curve, b: Curve, target: float) -> bool:
    """Whether the seconds to an error of two variants differ by less than they are uncertain."""
    ratio = b.seconds_to(target) / a.seconds_to(target)
    return max(ratio, 1 / ratio) < math.exp(math.hypot(*(math.log(f) for f in (a.time_factor, b.time_factor))))


def what_is_unsure(study: Study) -> Iterator[Finding]:
    """Which errors say little, as light was hardly met; what may hide elsewhere; what differs by more than chance."""
    main = main_curves(study)
    for c in main:
        if c.unmet is not None:
            yield ["unmet"], {"curve": c}
    hidden = [c for c in main if c.unmet is None and c.is_unsure]
    if hidden:
        low, high = (f(c.unseen for c in hidden) for f in (min, max))
        clause = "unseen" if percent(low) == percent(high) else "unseen by more"
        yield [clause], {"low": low, "high": high, "variants": [c.variant.label for c in hidden]}
    for c in study.curves:
        if abs(c.bias) > SURE_BIAS and not c.is_biased:
            yield ["biased"], {"curve": c, "bias": abs(c.bias)}


def what_samplers_bring(study: Study) -> Iterator[Finding]:
    """How much smaller the error is with the better of two samplers, at equal samples, or that it is chance."""
    rows = [row for row in knob_table(study) if row["knob"] == "sampler"]
    for first, second in dict.fromkeys((r["from"], r["to"]) for r in rows):
        own = [r for r in rows if (r["from"], r["to"]) == (first, second) and r["error"] > 0]
        numbers = {"from": first, "to": second}
        if own:
            low, gain, high = (statistics.median(r[name] for r in own) for name in ("error low", "error", "error high"))
            better, worse = (first, second) if gain > 1 else (second, first)
            factor = max(gain, 1 / gain)
            numbers |= {"better": better, "worse": worse, "factor": factor, "cost": factor**2}
            yield ["samplers alike" if low <= 1 <= high else "sampler"], numbers
        elif any(c.is_unsure for c in study.curves):
            yield ["sampler unknown"], numbers


def what_paths_bring(study: Study) -> Iterator[Finding]:
    """What bounces, roulette and the choice of lamps bring, as far as they were compared."""
    asked = questions(study)
    bounces = asked.pop("max_bounces")
    hidden = [r for r in bounces if abs(r["missing light"]) < 2 * r["standard error"]]
    for row in [r for r in bounces if r not in hidden][-1:]:
        yield ["bounces"], row | {"most": bounces[-1]["bounces"]}
    if hidden and hidden[0] is not bounces[-1]:
        yield ["enough bounces"], hidden[0]
    for knob, found in asked.items():
        rows = [r for r in found if r["efficiency"] > 0]
        if rows:
            best, name = max(rows, key=lambda r: r["efficiency"]), knob.replace("_", " ")
            numbers = {"efficiency": best["efficiency"], "setting": best[name], "first": rows[0][name]}
            yield [f"best {knob}" if best is rows[0] else "efficient"], numbers


def what_knobs_bring(study: Study) -> Iterator[Finding]:
    """What each knob beside estimator and sampler changes, with its uncertainty, or that it is noise."""
    for row in knob_table(study):
        if row["knob"] not in ("estimator", "sampler"):
            of_time = "time is noise" if row["time low"] <= 1 <= row["time high"] else "time"
            yield [of_time, clause_of_error(row)], row | {"subject": sentences.named(row, sentences.SUBJECTS)}


def clause_of_error(row: dict) -> str:
    """Which clause tells how the error of a row changes, at equal samples."""
    low, high, ratio = row["error low"], row["error high"], row["error"]
    if math.isnan(ratio):
        return "error is unknown"
    if abs(ratio - 1) <= SAME and high / low < 1 + 4 * SAME:
        return "error is the same"
    return "error is noise" if low <= 1 <= high else "error"


def what_the_wait_is(study: Study) -> Iterator[Finding]:
    """What a user waits for a picture before its samples are even begun, and what a second run is spared."""
    best = min(main_curves(study), key=lambda c: c.seconds_to(MIDDLE) if c.seconds_to(MIDDLE) > 0 else math.inf)
    before, rendering = study.start_seconds + study.facts.read_seconds + best.compile_seconds, best.seconds_to(MIDDLE)
    if math.isnan(before):
        return
    clauses = ["wait", "share", "saved" if best.seconds_to_save >= WORTH_TELLING else "saved before"]
    if not rendering > 0:
        clauses.remove("share")
    whole, saved = before + rendering, max(0.0, before - best.seconds_to_save)
    numbers = {"before": before, "whole": whole, "share": before / whole, "saved": saved, "target": MIDDLE}
    yield clauses, numbers | {"study": study, "best": best}


def where_the_error_is(study: Study) -> Iterator[Finding]:
    """How many pixels hold half of the squared error of the best picture at equal time."""
    shown = [c for c in study.curves if c.shown is not None]
    if not shown:
        return
    best = min(shown, key=lambda c: c.shown.error)
    truth = study.truths[best.variant.lookup]
    squares = np.sort(((best.shown.image - truth.image) ** 2).sum(axis=2).ravel())[::-1]
    count = int(np.searchsorted(np.cumsum(squares), squares.sum() / 2)) + 1
    rest = math.sqrt(squares[count:].sum() / (3 * squares.size)) / truth.mean
    clauses = ["half", "few"] if count <= FEW_PIXELS * squares.size else ["half"]
    yield clauses, {"best": best, "count": count, "pixels": squares.size, "rest": rest}


FINDERS = [who_wins, what_is_unsure, what_samplers_bring, what_paths_bring, what_knobs_bring]
FINDERS += [what_the_wait_is, where_the_error_is]


def summary(study: Study) -> list[str]:
    """What the study found, a sentence for each finding, the most important first."""
    told = [f"{sentences.told(*finding)}." for find in FINDERS for finding in find(study)]
    return [*told, *([study.others] if study.others else []), *study.notes]


# ── files ──


def table_rows(study: Study) -> list[dict]:
    """A row for every picture that was compared: variant, seed, samples, seconds, error."""
    return [
        {
            **asdict(curve.variant),
            "seed": seed + 1,
            "samples": int(n),
            "seconds": float(seconds),
            "relative_rmse": float(error),
            "noise": float(noise),
            "missing_light": -curve.shift,
            "missing_light_standard_error": curve.shift_error,
            "compile_seconds": curve.compile_seconds,
        }
        for curve in study.curves
        for seed, (errors, noises) in enumerate(zip(curve.errors, curve.noise, strict=True))
        for n, seconds, error, noise in zip(curve.samples, curve.mean_seconds, errors, noises, strict=True)
        if not math.isnan(error)
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
    bounces, roulettes, lamp_choices = questions(study).values()
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
            "relative_rmse": study.truth.error,
            "max_bounces": study.reference_bounces,
        },
        "summary": summary(study),
        "costs": efficiency_table(study),
        "knobs": knob_table(study),
        "bounces": bounces,
        "roulettes": roulettes,
        "lamp choices": lamp_choices,
        "measurements": table_rows(study),
    }
    read_again = json.loads(json.dumps(content), parse_constant=lambda _: None)  # NaN is no JSON
    return json.dumps(read_again, indent=1)
