"""What is said about a study of accuracy: templates of ``str.format``, and how their numbers become words.

The numbers are those of ``accuracy_tables``.
"""

import math
from collections.abc import Iterable, Mapping
from string import Formatter
from typing import Any

from taichi_tracer.picture.error_estimate import percent
from taichi_tracer.system.digits import digits

IN_PERCENT = ("missing light", "standard error", "noise")  # beginnings of the names of columns

# A finding is a clause, or several, one after the other, and a point at the end.
CLAUSES = {
    "nobody": "No variant reached {target:percent} within the {budget:g} s of the study, in which the best one, "
    "{variant}, was rendered for {rendered s:.3g} s",
    "nearest": ": its best picture has {best error:percent} after {after s:.3g} s of rendering",
    "by luck": ", but others of its pictures with as many samples or more do not have that",
    "fastest": "To {target:percent} error, {variant} is fastest: {seconds:.3g} s of rendering",
    "hidden": "; light that no sample met may add {unseen:percent}",
    "alike": "; the time of {alike: and of } cannot be told from it",
    "slowest": "{variant} needs {seconds:.3g} s for it, {ratio:longer}",
    "missed": "Others did not reach {target:percent} in the time that they had: {missed:came to}",
    "came to": "{variant} came to {best error:percent} in {after s:.2g} s",
    "unmet": "{curve.variant.label} met the light in {curve.unmet[0]:,} of the {curve.unmet[1]:,} pixels where it is "
    "rare: its error is unknown",
    "unseen": "Light that no sample met may add {low:percent} to the error of {variants:; }",
    "unseen by more": "Light that no sample met may add {low:percent} to {high:percent} to the errors of {variants:; }",
    "biased": "{curve.variant.label} differs from the reference by {curve.shift:percent} of the light, {bias:.0f} "
    "standard errors: one of the two is biased",
    "sampler unknown": "What {to} numbers bring is unknown: light that no sample met may outweigh it",
    "samplers alike": "At equal samples, the errors of {from} and {to} numbers differ by no more than chance",
    "sampler": "At equal samples, {worse} numbers have {factor:.2g} times the error of {better} (median over "
    "estimators): with independent samples, that would cost {cost:.2g} times the time",
    "bounces": "Paths of at most {bounces:n bounce} miss {missing light:.2g %} of the light, with a standard error of "
    "{standard error:.1g %}, and take {time:.0f %} of the time of {most}",
    "enough bounces": "From {bounces} bounces on, what is missing cannot be told from its standard error",
    "efficient": "{setting:capital} is {efficiency:.3g} times as efficient as {first}",
    "best roulette": "No roulette is more efficient than {first}",
    "best lamp_choice": "No choice of lamps is more efficient than {first}",
    "time": "{subject} takes {time:.2f} times the time of a sample ({time low:.2f} to {time high:.2f})",
    "time is noise": "{subject}: no difference in time can be told from noise ({time low:.2f} to {time high:.2f} "
    "times)",
    "error": ", with {error:.2f} times the error at equal samples",
    "error is the same": ", with the same error",
    "error is noise": ", and the error differs by no more than chance ({error low:.2g} to {error high:.2g} times)",
    "error is unknown": ", and what it does to the error is unknown",
    "wait": "Before its first sample, {best.variant.label} takes {before:.1f} s: {study.start_seconds:.1f} s to start, "
    "{study.facts.read_seconds:.1f} s to read the scene, {best.compile_seconds:.1f} s to compile",
    "share": "; that is {share:.0f %} of the {whole:.1f} s to {target:percent}",
    "saved": ". A second run finds the compiled kernels and takes about {saved:.1f} s before its first sample",
    "saved before": ". It found its kernels as an earlier run had compiled them; a first run takes longer",
    "half": "Half of the squared error of {best.variant.label} lies in {count:,} of {pixels:,} pixels",
    "few": ": these decide the error of {best.shown.error:percent}, of which the others make {rest:percent}",
}

# What is turned, by its new setting or by the knob: as the subject of a sentence, and beside a chart.
SUBJECTS = {
    "f32": "Float32",
    "f64": "Float64",
    "moller_trumbore": "Möller–Trumbore",
    "watertight": "The watertight test",
    "resolution x 0.5": "Half of the resolution",
    "scale": "The {to}",
    "adaptive": "Adaptive sampling",
    "no adaptive": "No adaptive sampling",
    "fast math": "Fast math",
    "no fast math": "No fast math",
    "lookup": "The {to} look-up",
    "intersector": "The intersector {to}",
}
BESIDE_CHARTS = {
    "f64": "Float64",
    "moller_trumbore": "Möller–Trumbore",
    "resolution x 0.5": "half the resolution",
    "adaptive": "adaptive sampling",
    "no adaptive": "no adaptive sampling",
    "sampler": "{to} numbers",
    "lookup": "{to} look-up",
}

RATIOS = {
    "same": "1.00 (the same)",
    "hardly another": "{ratio:.2f} (hardly another)",
    "noise": "noise ({low:.2g} to {high:.2g})",
    "clear": "{ratio:.2f} ({low:.2f} to {high:.2f})",
}

# The page: the title of each part, and on the next line what stands below it.
EFFICIENCY = (
    "Time and variance, at equal samples, are multiples of those of the first row. Efficiency is 1/(variance × time): "
    "what has twice the efficiency reaches the same error in half of the time."
)
PICTURES = "Error in each pixel, on one scale for all maps:"
PAGE = {
    "curves": "Error against time\nLines are the mean over the random seeds, bands their spread; solid lines have the "
    "first sampler, dashed lines another one. Point at a dot for its numbers. The error is the root mean square "
    "difference of all pixels to the reference, as a fraction of its mean.",
    "knobs": "What each knob changes\nTimes those of {study.base.label}. Bars are 95 % intervals; what is pale is "
    "noise: it cannot be told from 1.",
    "wait": "What you wait for\nCompiling happens once for each picture that is rendered by a new process. ",
    "compiled": "Kernels that were compiled anew: {study.kernels_made}; a second run finds them, and is spared that. ",
    "kept": "An earlier run had compiled all kernels: the first run on a machine compiles for longer. ",
    "shared": "An estimator that was compiled after another one shares with it what both need.",
    "max_bounces": "What bounces bring\nMissing light is a bias: it does not become smaller with more samples, as "
    "noise does. Both are in percent of the mean of the reference. Time is a multiple of that of the most bounces.",
    "roulette": f"What roulette saves\n{EFFICIENCY}",
    "lamp_choice": f"Which lamp?\n{EFFICIENCY}",
    "pictures": "Pictures after the same {study.equal_seconds:.2g} s of rendering\n",
    "costs": "The numbers\nAll seconds are of rendering, and were measured; nothing is extrapolated. A bias z beyond "
    "±4 would mean that the variant or the reference is biased; “?” stands where a rare light was hardly met, so that "
    "nothing can be said.",
    "fewer bounces": " Paths with fewer bounces than the reference are biased: no further sample adds the light that "
    "they miss.",
    "changes": "\nBoth are multiples of those before the change, with 95 % intervals. Where error² × time is below 1, "
    "the change pays: it reaches the same error sooner.",
    "about": "\n{study.size[0]}×{study.size[1]} pixels, each variant rendered with {study.seeds:n random seed} or "
    "more, {study.seconds:.0f} s of a budget of {study.budget:g} s ({study.facts.machine}). The reference has "
    "{study.truth.samples} samples per pixel and a relative error of {study.truth.error} itself, which was taken off; "
    "where a picture is nearly as good as the reference, its error is what it tells of itself.",
    "most bounces": " In the reference, light bounces at most {study.reference_bounces} times.",
}


class Words(Formatter):
    """``str.format`` with more formats: "percent", ".2g %" of a fraction, "n bounce" of a number of them, "longer" of a
    ratio of times, and "capital" of what begins a sentence.

    The format of a list is the clause that tells each of its rows, or what stands between its words.
    """

    def format_field(self, value: Any, spec: str) -> str:
        """A value in words."""
        if isinstance(value, list):
            return "; ".join(told([spec], row) for row in value) if spec in CLAUSES else spec.join(value)
        if spec.startswith("n "):
            return f"{value}{spec[1:]}{'s' * (value != 1)}"
        if spec.endswith(" %"):
            return f"{100 * value:{spec[:-2]}} %"
        if spec == "capital":
            return value[0].upper() + value[1:]
        named = {"percent": percent, "longer": times_as_long}
        return named[spec](value) if spec in named else super().format_field(value, spec)


def told(names: Iterable[str], numbers: Mapping[str, Any], templates: Mapping[str, str] = CLAUSES) -> str:
    """Some templates, one after the other, with numbers."""
    return Words().vformat("".join(templates[name] for name in names), (), numbers)


def named(row: dict, names: dict[str, str]) -> str:
    """What a row of ``knob_table`` turns: the name of its new setting, or that of the knob."""
    return names.get(row["to"], names.get(row["knob"], "{to}")).format(**row)


def times_as_long(ratio: float) -> str:
    """A ratio of times in words: digits that can be told from 1, and no more than two."""
    if ratio < 1.05:
        return "about as long"
    return f"{ratio:,.0f} times as long" if ratio >= 10 else f"{ratio:.2g} times as long"


def show(value: Any, column: str = "") -> str:
    """A number with three digits, errors in percent, or "?" if it is not known; anything else as it is."""
    if column.startswith(IN_PERCENT):
        return f"{show(100 * value)} %"
    if not isinstance(value, float):
        return str(value)
    return "?" if math.isnan(value) else digits(value, ".3g")


def in_words(rows: list[dict]) -> list[dict]:
    """Rows whose numbers are words."""
    return [{column: show(value, column) for column, value in row.items()} for row in rows]
