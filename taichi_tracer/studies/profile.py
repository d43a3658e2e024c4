"""Where the time of a picture goes: the parts of a stopwatch, kernel by kernel, and rays per second."""

import html
from collections.abc import Sequence
from dataclasses import dataclass

from taichi_tracer.files import page
from taichi_tracer.progressive import ProgressiveRenderer
from taichi_tracer.studies.machine import describe_machine
from taichi_tracer.studies.sample_times import Anatomy, SampleTimes
from taichi_tracer.system import compiling
from taichi_tracer.system.compiling import LOADED, LOADED_SHARE, Kernel
from taichi_tracer.system.seams import why_replaced
from taichi_tracer.system.stopwatch import SAMPLES, STAGES, Stopwatch

EYE_RAYS = "samples: eye rays are traced"
SHADING = "samples: hits are shaded"
RAYS = "samples: shadow and further rays"
FILM_TAKES = "samples: the film takes values"
TOTAL = "total"
BUDGET, LEAST_BUDGET = 0.1, 0.5  # for taking samples apart: a fraction of the samples' time, and seconds at least
STYLE = """
td.bar { text-align: left; --longest: 260px; } td.bar i { display: inline-block; height: 0.8em; background: #4a7fb5; }
td:nth-child(3) { white-space: nowrap; }
tr.total td { font-weight: 600; }
@media screen and (max-width: 700px) { td.bar { --longest: 70px; } }
"""
SWITCHED = (
    "The samples' parts run in one kernel, where no clock can see them apart. They were measured after the picture, on "
    "one more sample: the same kernel ran with and without the film, and with the answers of its rays found or read "
    "from a list of the same answers. The differences, in seconds of the processor, are the shares into which the "
    "measured time of all samples is divided. It took {seconds:.1f} s, its own kernel's compilation included, which "
    "are not in the table; {share}."
)
NOT_SWITCHED = (
    "The samples' parts were not taken apart: {why}. The kernel's time stands in one row, as the clock measured it."
)


@dataclass(frozen=True)
class Profile:
    """What was measured.

    Attributes:
        title: of what, in words.
        stopwatch: one that was stopped when the picture was written.
        kernels: those that the command used until then.
        parts: how the time of the samples is divided; None if it is not, and then ``why_not`` says why.
        passes: how many samples were taken of every pixel.
    """

    title: str
    stopwatch: Stopwatch
    kernels: Sequence[Kernel]
    parts: SampleTimes | None
    passes: int
    why_not: str = ""

    def rows(self) -> list[tuple[str, float]]:
        """(part, seconds); they add up to ``total``."""
        seconds = self.stopwatch.seconds
        found: list[tuple[str, float]] = []
        for name in STAGES:
            if name != SAMPLES or self.parts is None:
                found.append((name, seconds[name]))
            else:
                shares = {
                    EYE_RAYS: self.parts.eye,
                    SHADING: self.parts.shading,
                    RAYS: self.parts.rays,
                    FILM_TAKES: self.parts.film,
                }
                if self.asked == 0:
                    del shares[RAYS]
                found += [(part, self.within_samples(share)) for part, share in shares.items()]
        return found

    def within_samples(self, own: float) -> float:
        """The seconds of the picture's samples that belong to a part, which took ``own`` when they were taken apart."""
        parts = self.parts
        whole = 0.0 if parts is None else parts.shading + parts.rays + parts.film + parts.eye
        return self.stopwatch.seconds[SAMPLES] * own / whole if whole > 0 else 0.0

    @property
    def asked(self) -> int:
        """How many rays of the picture were no eye rays, as far as they were counted."""
        counted = None if self.parts is None else self.parts.rays_counted
        return 0 if counted is None else (counted.shadow + counted.others) * self.passes

    @property
    def total(self) -> float:
        """Seconds from the key press until the picture was written."""
        return self.stopwatch.total

    def rays(self) -> list[tuple[str, int, float]]:
        """(kind, number, seconds) of the rays of the picture; empty if they were not counted."""
        if self.parts is None:
            return []
        counted, seconds = self.parts.rays_counted, dict(self.rows())
        found = [("eye rays", counted.eye * self.passes, seconds[EYE_RAYS])]
        if self.asked > 0:
            names = {"shadow rays": counted.shadow, "further rays": counted.others}
            kinds = " and ".join(name for name, number in names.items() if number > 0)
            found.append((kinds, self.asked, seconds[RAYS]))
        return found

    def how(self) -> str:
        """How the parts of the samples were measured, in words."""
        if self.parts is None:
            return NOT_SWITCHED.format(why=self.why_not)
        pixels = (
            "all pixels took it" if self.parts.share == 1 else f"{100 * self.parts.share:.0f} % of the pixels took it"
        )
        return SWITCHED.format(seconds=self.parts.seconds, share=pixels)

    def made_anew(self) -> str:
        """How many kernels were there, and how many of them were translated."""
        anew = [kernel for kernel in self.kernels if kernel.is_new]
        seconds = sum(kernel.translating for kernel in anew)
        return f"{len(self.kernels)} kernels, {len(anew)} of them translated anew ({seconds:.2f} s)"


def rate(number: int, seconds: float) -> str:
    """Rays per second, in words."""
    return f"{number / seconds / 1e6:.3g} million/s" if seconds > 0 else "too short to measure"


def described(profile: Profile) -> str:
    """The table as text, for a terminal."""
    rows = [*profile.rows(), (TOTAL, profile.total)]
    wide = max(len(name) for name, _ in rows)
    lines = [f"{name:<{wide}}  {seconds:8.3f} s  {percent_of(seconds, profile.total):>6}" for name, seconds in rows]
    lines.append(profile.made_anew())
    lines += [f"{kind}: {number:,}, {rate(number, seconds)}" for kind, number, seconds in profile.rays()]
    return "\n".join(lines)


def percent_of(seconds: float, total: float) -> str:
    """A share in percent."""
    return f"{100 * seconds / total:.1f} %"


def as_page(profile: Profile) -> str:
    """The page, which needs no other file."""
    return page.page(
        f"Where the time went: {profile.title}",
        [
            page.paragraph(
                f"{profile.total:.2f} s from the key press until the picture was written. Each moment is in one row."
            ),
            parts_table(profile),
            page.paragraph(profile.how(), "note"),
            "<h2>Rays</h2>" if profile.parts is not None else "",
            rays_table(profile),
            "<h2>Kernels</h2>",
            page.paragraph(profile.made_anew() + ", in the order of their first calls:"),
            kernels_table(profile.kernels),
            page.paragraph(
                "Python reads a kernel in every process. Taichi then translates it into machine code, or finds it in "
                f"the folder where an earlier process has kept it; what took less than {LOADED:g} s of the processor, "
                f"or less than {LOADED_SHARE:g} of the time in which Python read it, counts as found.",
                "note",
            ),
            page.paragraph(describe_machine(), "note"),
        ],
        STYLE,
    )


def parts_table(profile: Profile) -> str:
    """Every part with its seconds, its share and a bar."""
    body = ""
    for name, seconds in profile.rows():
        bar = f"<i style='width: calc({seconds / profile.total:.4f} * var(--longest))'></i>"
        cells = f"<td>{html.escape(name)}</td><td>{seconds:.3f}</td><td>{percent_of(seconds, profile.total)}</td>"
        body += f"<tr>{cells}<td class='bar'>{bar}</td></tr>"
    body += f"<tr class='total'><td>{TOTAL}</td><td>{profile.total:.3f}</td><td>100 %</td><td></td></tr>"
    head = "<tr><th>part</th><th>seconds</th><th>share</th><th></th></tr>"
    return f"<div class='wide'><table><thead>{head}</thead><tbody>{body}</tbody></table></div>"


def rays_table(profile: Profile) -> str:
    """Rays and rays per second; nothing if they were not counted."""
    rows = [
        {"rays": kind, "number": f"{number:,}", "seconds": f"{seconds:.3f}", "speed": rate(number, seconds)}
        for kind, number, seconds in profile.rays()
    ]
    if not rows:
        return ""
    note = (
        "Rays of each sample: as many as one sample has, which was counted after the picture. Seconds: the table above."
    )
    return page.table(rows, ["rays", "number", "seconds", "speed"]) + page.paragraph(note, "note")


def kernels_table(kernels: Sequence[Kernel]) -> str:
    """Every kernel with its seconds."""
    rows = [
        {
            "kernel": kernel.name,
            "read, s": f"{kernel.reading:.3f}",
            "translated or loaded, s": f"{kernel.translating:.3f}",
            "machine code": "translated anew" if kernel.is_new else "found",
        }
        for kernel in kernels
    ]
    return page.table(rows, ["kernel", "read, s", "translated or loaded, s", "machine code"])


def profile_of(renderer: ProgressiveRenderer, stopwatch: Stopwatch, title: str) -> Profile:
    """The profile of a picture that was just rendered and written, while a stopwatch ran.

    Its samples are then taken apart, and the renderer forgets the picture.
    """
    kernels, passes = compiling.kernels(stopwatch.started), stopwatch.times[SAMPLES]
    anatomy = Anatomy(renderer)
    parts = anatomy.measure(max(LEAST_BUDGET, BUDGET * stopwatch.seconds[SAMPLES]))
    why = "" if parts is not None else why_replaced(renderer)
    size = f"{renderer.width}×{renderer.height}, {passes} samples per pixel"
    return Profile(f"{title}, {size}", stopwatch, kernels, parts, passes, why)
