"""Do hard cases stay numerically stable, in which mode, and what does that cost in time?

Every triangle test × precision × fast_math × intersector is sent the rays of a catalogue of hard cases, and judged by
oracles that compute in integers, or in float64 with a bound. Every mode has promises (``hard.case.promises_of``); what
a mode does not promise is counted all the same. Registered parts of your own are modes and cases like the others.
"""

import gc
import json
import math
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial

import numpy as np

from taichi_tracer.files import page
from taichi_tracer.formulas.view import box_of
from taichi_tracer.options import brdfs_of
from taichi_tracer.renderer import A2Renderer
from taichi_tracer.studies.hard import light_cases, view_cases  # noqa: F401 (their cases)
from taichi_tracer.studies.hard.case import (
    COUNTS,
    DEFAULT,
    EVERYWHERE,
    LARGE,
    OWN_TEST,
    QUICK,
    REFERENCE,
    RENDERER_CASES,
    USUAL,
    Case,
    CaseInScene,
    CaseRays,
    CaseTally,
    RayMode,
    RendererCase,
    SharedScene,
    promises_of,
    seconds_of,
)
from taichi_tracer.studies.hard.light_cases import OF_BRDFS, furnace, own_brdf
from taichi_tracer.studies.hard.triangle_cases import (
    AxisParallel,
    ClosedSphere,
    Damaged,
    DirectionLengths,
    Duplicates,
    FarOrigins,
    Grazing,
    IllegalRays,
    InThePlane,
    Lattice,
    LeavingSurfaces,
    NestedSpheres,
    OneCentroid,
    Slivers,
    UnitTriangles,
    Windows,
)
from taichi_tracer.studies.tables import describe_machine, in_columns
from taichi_tracer.system import runtime
from taichi_tracer.system.parts import PARTS, replaced


@dataclass(frozen=True)
class Level:
    """How much is tried.

    Attributes:
        rays: of a case, with an accelerator.
        tests: ray-triangle tests of a scene that brute force may take, from which its number of rays follows.
        edge_rays: of the long run, at edges only, with accelerators and without fast_math.
        is_whole: whether every mode goes through every scene and every estimator; compiling that takes minutes.
        has_plain: whether the plain hierarchy is tried too; building it takes a minute for the largest scene.
    """

    rays: int
    tests: int
    edge_rays: int
    is_whole: bool = True
    has_plain: bool = False

    def covers(self, stage: str, mode: RayMode) -> bool:
        """Whether a mode goes through a scene. In part, each scene meets the modes that most depend on it."""
        if self.is_whole:
            return True
        if mode.tries_everything:  # single triangles are asked in the same way by every intersector
            return stage != "crowd"
        return stage in ("unit", "sizes") or (stage == "crowd" and mode.precision == "f32" and mode.is_watertight)


LEVELS = {
    "quick": Level(40_000, 6_000_000, 0, is_whole=False),
    "default": Level(400_000, 60_000_000, 4_000_000),
    "full": Level(2_000_000, 300_000_000, 100_000_000, has_plain=True),
}


def all_cases() -> list[Case]:
    """A new one of every case."""
    return [
        ClosedSphere("closed sphere at 0", "unit", 8.0, (0, 0, 0)),
        ClosedSphere("closed sphere at 1e2", "unit", 4.0, (100, -33, 14)),
        ClosedSphere("closed sphere at 1e4", "sizes", 4.0, (1e4, -3333, 1429)),
        ClosedSphere("closed sphere at 1e6", "sizes", 4.0, (1e6, -333333, 142857)),
        # The sphere of Embree's watertightness test (kernels/verify), far away from the origin.
        ClosedSphere("159,200 triangles at (148376, 1234, -223423)", "crowd", 200.0, (148376, 1234, -223423), 400, 200),
        NestedSpheres(),
        LeavingSurfaces(),
        Lattice(),
        AxisParallel(),
        InThePlane(),
        UnitTriangles(),
        Slivers(),
        Grazing(),
        FarOrigins(),
        DirectionLengths(),
        Windows(),
        IllegalRays(),
        Damaged(),
        Duplicates(),
        OneCentroid(),
    ]


def renderer_cases(level: str, precision: str) -> list[RendererCase]:
    """The cases of the rest of the renderer that a level tries in a precision; one for each BRDF of your own.

    The furnace is tried with every estimator of direct light; in the quick level, with one, and in f32 only.
    """
    most = {"quick": QUICK if precision == "f32" else EVERYWHERE, "default": USUAL, "full": LARGE}[level]
    own = [brdf for brdf in brdfs_of(()) if not PARTS.comes_with_package(brdf)]
    estimators = [e.name for e in A2Renderer.offered() if most >= USUAL or e.name == "brdf"]
    cases = [case for case in RENDERER_CASES if case.cost <= most]
    cases += [RendererCase(f"BRDF {brdf.name}: {OF_BRDFS}", partial(own_brdf, brdf)) for brdf in own]
    if most > EVERYWHERE:
        cases += [RendererCase(f"furnace: {name}", partial(furnace, name)) for name in estimators]
    return cases


# ── all cases ──


PLAIN = "bvh"  # a hierarchy that is built in Python, triangle by triangle
CHUNK = 1_000_000  # rays of the long run at a time
TIMED_RAYS = 100_000  # a run of so many takes about 10 ms
FEWEST_RAYS = 40  # of a case: fewer would say nothing of it
TIMED_CASE = "closed sphere at 1e2"
LONG_CASE = "closed sphere at 0"
RENDERER = "renderer f32"  # the mode of cases of the rest of the renderer, with the default start of Taichi
MOST_NAMED = 3  # cases of another mode that are named


@dataclass
class CaseVerdict:
    """One case in one mode.

    Attributes:
        mode: as it is written in tables. case: its name.
        rays: how many were sent.
        findings: see ``Case.judge``.
        limits: see ``promises_of``, of the findings.
        broken: findings that a promise excludes. weak: findings that are not 0, and that nothing was promised of.
    """

    mode: str
    case: str
    rays: int
    findings: dict[str, float]
    limits: dict[str, float]
    broken: list[str]
    weak: list[str]

    @property
    def word(self) -> str:
        """PASS, FAIL, or "weak": not right, and not promised."""
        return "FAIL" if self.broken else "weak" if self.weak else "PASS"


@dataclass
class Row:
    """One mode in the table.

    Attributes:
        findings: of all cases together: counts added, errors at their largest.
        ns_per_ray: nanoseconds per ray of ``scene.intersect``, of the best run; NaN where none was timed.
    """

    mode: RayMode
    findings: dict[str, float]
    ns_per_ray: float

    def leaks(self, kind: str) -> float | None:
        """Of 1e6 rays that are aimed at each "edge", or "vertex"; None where there were none."""
        rays = self.findings.get(f"{kind}_rays", 0)
        return 1e6 * self.findings[f"{kind}_leaks"] / rays if rays else None


@dataclass
class SuiteResult:
    """What the suite found, and the machine on which it ran."""

    level: str
    machine: str
    rows: list[Row]
    verdicts: list[CaseVerdict]

    @property
    def passed(self) -> bool:
        """Whether every mode kept its promises."""
        return not any(verdict.broken for verdict in self.verdicts)

    @property
    def of_default(self) -> list[CaseVerdict]:
        """The verdicts on what runs if nobody chooses anything."""
        return [verdict for verdict in self.verdicts if verdict.mode in (str(DEFAULT), RENDERER)]


def modes_of(level: str, arch: str = "auto") -> list[RayMode]:
    """The modes of a level, in the precisions that a backend has.

    Those of one start of Taichi stand together, and brute force is the first of them, which the others must equal. In
    part, there is no fast_math, and no brute force in f64.
    """
    size = LEVELS[level]
    known = [part for part in PARTS.all("intersector") if size.has_plain or part.name != PLAIN]
    intersectors = sorted(known, key=lambda part: part.name != REFERENCE)
    # These decide by themselves what a hit on a triangle is, so that no triangle test is asked.
    own = [part.name for part in intersectors if "intersect_triangle" in replaced(part)]
    tests = PARTS.names("triangle test")
    ways = [(test, part.name) for test in tests for part in intersectors if part.name not in own]
    modes = [
        RayMode(test, precision, fast_math, intersector)
        for fast_math in ((False, True) if size.is_whole else (False,))
        for precision in runtime.PRECISIONS
        if precision == "f32" or arch in ("auto", *runtime.F64_ARCHS)
        for test, intersector in [*ways, *((OWN_TEST, name) for name in own)]
    ]
    return [mode for mode in modes if size.is_whole or mode.precision == "f32" or not mode.tries_everything]


def run(level: str = "default", progress: Callable[[str], None] = lambda what: None, arch: str = "auto") -> SuiteResult:
    """Run the suite. Starts Taichi several times: scenes made before become unusable.

    Args:
        level: "quick", "default" or "full".
        progress: called with what is done next.
        arch: which backend, as for ``runtime.init``.
    """
    size, cases = LEVELS[level], all_cases()
    stages = [
        SharedScene(name, [c for c in cases if c.stage == name]) for name in dict.fromkeys(c.stage for c in cases)
    ]
    rays = {case.name: case.gathered(max(FEWEST_RAYS, int(size.rays * case.rays_wanted))) for case in cases}
    before = runtime.current()
    rows, verdicts, started = [], [], None
    references: dict[tuple, list] = {}
    machine = ""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of what cannot be hit, and of lamps that do not shine
        for mode in modes_of(level, arch):
            start = (mode.precision, mode.fast_math)
            if start != started:
                gc.collect()  # while the Taichi that made them still runs
                runtime.init(arch, mode.precision, mode.fast_math, force=True)
                # The first start is in f32: a GPU without f64 leaves that to the CPU.
                started, machine = start, machine or describe_machine()
                progress("renderer")
                verdicts += renderer_verdicts(mode, level)
            progress(str(mode))
            row, found = run_mode(mode, size, stages, rays, references)
            rows.append(row)
            gc.collect()
            verdicts += found
    if before is not None:
        runtime.init(before.arch, before.precision, before.fast_math, force=True)
    return SuiteResult(level, machine, rows, verdicts)


def run_mode(
    mode: RayMode, size: Level, stages: list[SharedScene], rays: dict[str, CaseRays], references: dict
) -> tuple[Row, list[CaseVerdict]]:
    """All cases in one mode; ``references`` keeps the answers of brute force, which the others must equal."""
    promises, verdicts, ns_per_ray = promises_of(mode), [], math.nan
    for stage in stages:
        if not size.covers(stage.name, mode):
            continue
        placed = stage.build(mode)
        few = max(FEWEST_RAYS, size.tests // len(stage.cases) // stage.num_triangles)  # of each case
        most = few if mode.tries_everything else None
        for case in stage.cases:
            on, sent = placed[case.name], rays[case.name][:most]
            findings = case.judge(on, sent, mode.epsilon)
            findings |= difference_from_brute_force(mode, case, on, references)
            if case.name == LONG_CASE and not mode.tries_everything and not mode.fast_math:
                long_run(case, on, size.edge_rays, findings)
            verdicts.append(verdict_of(str(mode), promises, case.name, len(sent), findings))
        if TIMED_CASE in placed:
            ns_per_ray = time_per_ray(placed[TIMED_CASE], most or TIMED_RAYS)
    return Row(mode, totals(verdicts), ns_per_ray), verdicts


def difference_from_brute_force(mode: RayMode, case: Case, on: CaseInScene, references: dict) -> dict[str, int]:
    """How many of the answers that brute force gave are others here."""
    key = (mode.triangle_test, mode.precision, mode.fast_math, case.name)
    answers = [np.column_stack([h.triangle_id, h.distance, h.barycentric_coords]) for h in on.intersected]
    on.intersected = []
    if mode.intersector == REFERENCE:
        references[key] = answers
    wrong = 0
    for mine, truth in zip(answers, references.get(key, ()), strict=False):
        n = min(len(mine), len(truth))
        same = (mine[:n] == truth[:n]) | (np.isnan(mine[:n]) & np.isnan(truth[:n]))
        wrong += int((~same).any(axis=1).sum())
    return {"differs": wrong} if key in references else {}


def long_run(case: Case, on: CaseInScene, count: int, findings: dict[str, float]) -> None:
    """Send many more rays to edges, in pieces, and add what they find to the findings."""
    for chunk in range(-(-count // CHUNK)):
        rays = case.from_inside(case.rng(2 + chunk), min(CHUNK, count - chunk * CHUNK), vertices=False)
        hits = on.scene.intersect(rays.origins, rays.directions)
        findings["edge_leaks"] += int(case.leaks(on, rays, hits).sum())
        findings["edge_rays"] += len(rays)


def time_per_ray(on: CaseInScene, count: int) -> float:
    """Nanoseconds of ``scene.intersect`` per ray, of the best run: random rays from inside a closed mesh."""
    rng, dtype = np.random.default_rng(5), runtime.dtype()
    low, high = box_of(on.vertices)
    origins = (low + (high - low) * rng.uniform(0.3, 0.7, (count, 3))).astype(dtype)
    directions = rng.normal(size=(count, 3)).astype(dtype)
    return 1e9 * seconds_of(lambda: on.scene.intersect(origins, directions)) / count


def verdict_of(mode: str, promises: dict[str, float], case: str, rays: int, findings: dict[str, float]) -> CaseVerdict:
    """What of the findings the promises exclude, and what is merely not right."""
    limits = {name: promises[name] for name in findings if name in promises}
    broken = [name for name, limit in limits.items() if not findings[name] <= limit]
    weak = [name for name, value in findings.items() if name not in limits and name in COUNTS and value > 0]
    return CaseVerdict(mode, case, rays, findings, limits, broken, weak)


def totals(verdicts: list[CaseVerdict]) -> dict[str, float]:
    """Counts of all cases added, errors at their largest."""
    every: dict[str, list[float]] = {}
    for name, value in (item for verdict in verdicts for item in verdict.findings.items()):
        every.setdefault(name, []).append(value)
    return {name: max(values) if name.startswith("t_") else sum(values) for name, values in every.items()}


def renderer_verdicts(mode: RayMode, level: str) -> list[CaseVerdict]:
    """The cases of the rest of the renderer; without fast_math each promises that nothing is wrong."""
    name = f"renderer {mode.precision}{' fast_math' if mode.fast_math else ''}"
    promises = {} if mode.fast_math else dict.fromkeys(COUNTS, 0.0)
    verdicts = []
    for case in renderer_cases(level, mode.precision):
        tally = CaseTally()
        case.check(tally, mode.epsilon)
        findings = {"wrong": tally.wrong, "nan": tally.nan}
        verdicts.append(verdict_of(name, promises, case.name, tally.tried, findings))
    return verdicts


def as_json(result: SuiteResult) -> dict:
    """The result as strings, lists, dictionaries and finite numbers: None is one that is not finite."""
    content = {
        "suite": "hardcases",
        "level": result.level,
        "passed": result.passed,
        "machine": result.machine,
        "modes": [
            asdict(row.mode)
            | {"name": str(row.mode), "ns_per_ray": row.ns_per_ray}
            | {f"{kind}_leaks_per_million": row.leaks(kind) for kind in ("edge", "vertex")}
            | {"findings": row.findings}
            for row in result.rows
        ],
        "cases": [asdict(verdict) | {"verdict": verdict.word} for verdict in result.verdicts],
    }
    return json.loads(json.dumps(content), parse_constant=lambda _: None)


def default_line(result: SuiteResult) -> str:
    """The verdict on what runs if nobody chooses anything."""
    own = result.of_default
    passed = sum(verdict.word == "PASS" for verdict in own)
    others = "" if result.passed else ", and a mode breaks a promise" if passed == len(own) else ""
    return f"The default ({DEFAULT}) passes {passed} of {len(own)} cases{others}; other modes show what they lose."


def mode_rows(result: SuiteResult) -> list[dict[str, str]]:
    """A row for every mode: how many cases it passes, what it loses, and what a ray costs."""
    rows = []
    for row in result.rows:
        words = [v.word for v in result.verdicts if v.mode == str(row.mode)]
        errors = [value for name, value in row.findings.items() if name.startswith("t_")]
        counts = {name: row.findings.get(name) for name in ("false_hits", "self_hits", "nan")}
        rates = {kind: row.leaks(kind) for kind in ("edge", "vertex")}
        rows.append(
            {
                "mode": str(row.mode),
                "cases": f"{words.count('PASS')} of {len(words)}",
                **{f"{kind} leaks": "–" if rate is None else f"{rate:,.0f}" for kind, rate in rates.items()},
                **{name.replace("_", " "): "–" if n is None else f"{n:,.0f}" for name, n in counts.items()},
                "error of t": f"{max(errors):.0e}" if errors else "–",
                "ns/ray": f"{row.ns_per_ray:,.0f}",
            }
        )
    return rows


def case_rows(result: SuiteResult) -> list[dict[str, str]]:
    """A row for every case in the default mode: what could break, and what happened."""
    known: dict[str, str | None] = {case.name: type(case).__doc__ for case in all_cases()}
    for one in renderer_cases("full", "f32"):
        known[one.name] = getattr(one.check, "func", one.check).__doc__
    return [
        {
            "case": verdict.case,
            "what could break": " ".join((known.get(verdict.case) or "").split("\n\n")[0].split()),
            "": verdict.word,
            "found": found_in_words(verdict),
        }
        for verdict in result.of_default
    ]


def found_in_words(verdict: CaseVerdict) -> str:
    """What is wrong; or the number nearest to its bound."""
    wrong = [*verdict.broken, *verdict.weak]
    if wrong:
        return ", ".join(f"{name.replace('_', ' ')} {verdict.findings[name]:,.3g}" for name in wrong) + (
            f" of {verdict.rays:,}"
        )
    shares = {name: verdict.findings[name] / limit for name, limit in verdict.limits.items() if limit > 0}
    if shares:
        name = max(shares, key=shares.get)
        allowed = f"at most {verdict.limits[name]:.1e} is allowed"
        return f"t is off by {verdict.findings[name]:.1e}, {allowed}, {verdict.rays:,} rays"
    return f"0 of {verdict.rays:,} wrong, 0 are allowed"


def losses(result: SuiteResult) -> list[str]:
    """A line for each other mode that is not right everywhere: what it loses, the largest first."""
    lines = []
    for mode in dict.fromkeys(v.mode for v in result.verdicts if v not in result.of_default):
        wrong = [v for v in result.verdicts if v.mode == mode and v.word != "PASS"]
        wrong.sort(key=lambda v: (v.word != "FAIL", -max(v.findings[name] for name in [*v.broken, *v.weak])))
        named = [f"{'FAIL ' * bool(v.broken)}{v.case}: {found_in_words(v)}" for v in wrong[:MOST_NAMED]]
        more = f"; and {len(wrong) - MOST_NAMED} more" if len(wrong) > MOST_NAMED else ""
        lines += [f"{mode}: {'; '.join(named)}{more}"] if wrong else []
    return lines


def table(result: SuiteResult) -> list[str]:
    """Lines of text: the verdict on the default, first and last; every mode, every case, what other modes lose."""
    verdict = default_line(result)
    failed = [f"FAIL  {v.case}: {found_in_words(v)}" for v in result.of_default if v.word == "FAIL"]
    modes, cases = (in_columns(rows) for rows in (mode_rows(result), case_rows(result)))
    last = f"Measured with {result.machine}.", *failed, verdict
    return [verdict, "", *modes, *LEGEND, "", *cases, "", *losses(result), "", *last]


def as_page(result: SuiteResult) -> str:
    """The same as an HTML page that needs no other file."""
    parts = [page.paragraph(f"Level {result.level}; {result.machine}.", "note")]
    tables = {"Every mode": mode_rows(result), "Every case in the default mode": case_rows(result)}
    for title, rows in tables.items():
        parts += [f"<h2>{title}</h2>", page.table(rows) if rows else ""]
    parts += [page.paragraph(line, "note") for line in LEGEND]
    parts += ["<h2>What other modes lose</h2>", *map(page.paragraph, losses(result))]
    return page.page(default_line(result), parts, "td { white-space: normal; }")


LEGEND = (
    "leaks: of 1e6 rays that are aimed at edges or vertices of closed surfaces. false hits: rounding does not explain "
    "them.",
    "self hits: rays that hit the triangle that they leave. error of t: relative, the largest. ns/ray: the best run.",
)
