"""How often verdicts hold: campaigns of benches, units, effects and faults from plain NumPy.

They come from tests/diagnose/labs. Families: effects of the library at whitened strength 6 and 12, younger
effects, shapes that no effect has, nothing hidden (normal, heavy-tailed, struck rows), faults of bench and
records. Figures are pooled over each family, with exact (Clopper-Pearson) 95 % intervals. The strength is
what the known noise gives on average; `own t` is the largest coefficient over its error in the campaign's own
fit of the hidden effect beside the declared ones, with all variances estimated.

Run: OMP_NUM_THREADS=1 python benchmarks/study_verdicts.py [--first 0] [--count 30] [--family NAME]
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from planner import catalog
from planner.calibrate.dwells_to_fit import fit_sensor
from planner.diagnose.dwells_to_diagnosis import diagnose
from planner.diagnose.findings.assumptions import exceeded
from planner.dwells.table_rows import by_run
from planner.nouns.diagnosis import UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor
from planner.solvers.distributions import binomial_interval
from planner.spec.load import load_spec
from tests.diagnose.labs.shapes import FAULTS, LIBRARY, MORE, NAMELESS, Hidden
from tests.diagnose.labs.unit import campaign, noise_of

SPEC = load_spec(Path(__file__).parents[1] / "requirements_specs" / "small_uav.yaml").spec
CLEAN = {
    "normal": {},
    "tails": {"tails": 2.5},
    "struck": {"struck": 0.007},
    "no centrifuge": {"centrifuge": False},
}


# shapes without an equation in the library that a table of it holds, over their own variable
TABLES = {"ramp size": ("temperature_rate_table",), "resonance": ("scale_factor_curve",)}


@dataclass(frozen=True)
class Case:
    """One campaign of a family."""

    family: str
    seed: int
    name: str
    channel: str = ""
    t: float = 0.0


@dataclass(frozen=True)
class Scored:
    """right: as the family asks; near: or a rival, or without a name; wrong: something false is said

    extra: an effect or a fault of the bench is claimed beside the truth, which has none
    inside: whether each interval of a coefficient holds its truth
    over: whether a spread is said to exceed its budget where that budget is the truth
    """

    case: Case
    right: bool
    near: bool
    wrong: bool
    extra: bool
    inside: tuple[bool, ...]
    said: str
    seconds: float
    over: bool
    own_t: float


def cases(family: str, first: int, count: int) -> Iterator[Case]:
    """The campaigns of a family, one after the other through its kinds and channels."""
    if family.startswith("library"):
        yield from _hidden(family, LIBRARY, float(family.split()[1]), first, count)
    elif family == "younger":
        yield from _hidden(family, MORE, 20.0, first, count)
    elif family == "nameless":
        yield from _hidden(family, NAMELESS, 25.0, first, count)
    else:
        kinds = list(CLEAN) if family == "clean" else FAULTS
        for i in range(first, first + count):
            yield Case(family, 10_000 + i, kinds[i % len(kinds)])


def _hidden(family: str, kinds: dict, t: float, first: int, count: int) -> Iterator[Case]:
    every = [(name, sensor) for name, (sensors, *_) in kinds.items() for sensor in sensors]
    for i in range(first, first + count):
        name, sensor = every[i % len(every)]
        yield Case(family, 20_000 + i, name, f"{sensor}_{'xyz'[(i // len(every)) % 3]}", t)


def scored(case: Case) -> Scored:
    """One campaign diagnosed and judged."""
    if case.family == "clean":
        table, truth = campaign(case.seed, **CLEAN[case.name])
    elif case.family == "faults":
        table, truth = campaign(case.seed, fault=case.name)
    else:
        table, truth = campaign(case.seed, Hidden(case.name, case.channel, case.t))
    start = time.process_time()
    found = diagnose(table, SPEC)
    seconds = time.process_time() - start
    right, near, wrong, extra = _judged(case, found)
    return Scored(
        case,
        right,
        near,
        wrong,
        extra,
        tuple(_inside(case, found, truth.size)),
        said(found),
        seconds,
        _over(case, found),
        _own_t(case, table),
    )


def _own_t(case: Case, table: DwellTable) -> float:
    """Of the hidden effect, fitted beside what is declared; nan where these data do not tell it."""
    if not case.family.startswith("library"):
        return float("nan")
    ordered, _ = by_run(table)
    sensor: Sensor = "gyro" if case.channel.startswith("gyro") else "accelerometer"
    axis = "xyz".index(case.channel[-1])
    fits = fit_sensor(ordered, sensor, SPEC, effects=(*SPEC.effects, case.name), channels=(axis,))
    (fit,) = (f for f in fits if f.model.channel == axis)
    own = [c.effect == case.name and not c.parameter for c in fit.model.columns()]
    told = np.flatnonzero(np.array(own) & ~fit.fit.undetermined)
    sigma = np.sqrt(np.diag(fit.fit.covariance)[told])
    return float(np.max(np.abs(fit.theta[told]) / sigma, initial=-np.inf)) if len(told) else float("nan")


def _over(case: Case, found: UnitDiagnosis) -> bool:
    """Whether `exceeded` calls a spread of the unit too large where the budget is what it was drawn with."""
    truths = []
    for a in found.assumptions:
        sensor, error = a.error.split(".")
        noise = noise_of(case.seed, sensor.replace("accelerometer", "acc"))
        si = (np.pi / 180.0 if sensor == "gyro" else 9.80665) if error == "bias" else 1.0
        truth = {"bias": noise.level * si, "scale_factor": noise.scale}.get(error)
        truths += [replace(a, assumed=truth)] if a.part == "run_to_run" and truth else []
    return bool(exceeded(truths))


def said(found: UnitDiagnosis) -> str:
    """What is claimed, in a line."""
    parts = [f"{e.effect}[{' '.join(map(_short, e.channels))}] {e.strength:.1f}" for e in found.effects]
    parts += [
        f"?{u.varies_with}[{' '.join(map(_short, u.channels))}] {u.strength:.1f}" for u in found.unknown
    ]
    parts += [f"!{s.hypothesis} {s.strength:.1f}" for s in getattr(found, "reference_suspects", ())]
    parts += [
        f"({r.effect}[{' '.join(map(_short, r.channels))}] refused: {r.why[:60]})" for r in found.refused
    ]
    left = getattr(found, "rows_left_out", ())
    return "; ".join(parts) + (f" ({len(left)} rows out)" if left else "")


def _short(channel: str) -> str:
    return channel.replace("accelerometer", "acc")


def _judged(case: Case, found: UnitDiagnosis) -> tuple[bool, bool, bool, bool]:
    claims = {(e.effect, _short(c)) for e in found.effects for c in e.channels}
    rivals = {(r.effect, _short(c)) for e in found.effects for c in e.channels for r in e.rivals}
    unknown = {(u.varies_with, _short(c)) for u in found.unknown for c in u.channels}
    suspects = {s.hypothesis for s in getattr(found, "reference_suspects", ())}
    if case.family == "clean":
        quiet = not (claims or unknown or suspects)
        return quiet, quiet, not quiet, False
    if case.family == "faults":
        known = catalog.effects()
        blamed = any(not known[name].bench_only for name, _ in claims)
        expected = {"no_earth": "earth_rate", "wrong_run": "wrong_label"}.get(case.name, case.name)
        named = expected in suspects | {name for name, _ in claims}
        return named and not blamed, not blamed, blamed, False
    if case.family == "nameless":
        variables = NAMELESS[case.name][2]
        tabled = bool(claims) and claims <= {(name, case.channel) for name in TABLES.get(case.name, ())}
        right = not claims and any(c == case.channel and v in variables for v, c in unknown)
        return right or tabled, not claims or tabled, bool(claims) and not tabled, False
    truth = (case.name, case.channel)
    exact = claims == {truth} and not unknown and not suspects
    near = truth in claims or truth in rivals
    extra = truth in claims and bool(claims - {truth} or suspects)
    return exact, near, bool(claims) and not near, extra


def _inside(case: Case, found: UnitDiagnosis, size: float) -> Iterator[bool]:
    """Intervals of effects of one coefficient in the shape's own unit."""
    plain = {"g_squared_sensitivity", "temperature_rate", "ageing", "bias_step", "scale_factor_asymmetry"}
    si = {"gyro": np.pi / 180.0, "acc": 9.80665}
    per = {"g_squared_sensitivity": 9.80665**-2, "temperature_rate": 60.0, "ageing": 1.0 / 86400.0}
    for e in found.effects:
        if e.effect == case.name and e.effect in plain and case.channel in map(_short, e.channels):
            scale = si[case.channel[:-2]] * per.get(e.effect, 1.0)
            scale = 2.0 if e.effect == "scale_factor_asymmetry" else scale
            for term in e.terms:
                if not term.parameter and _short(term.channel) == case.channel:
                    yield term.low <= size * scale <= term.high


def interval(hits: int, n: int) -> str:
    """A share with its exact 95 % interval."""
    low, high = binomial_interval(hits, n, 0.025)
    return f"{hits}/{n} = {100 * hits / max(n, 1):.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


FAMILIES = ("clean", "library 6", "library 12", "younger", "nameless", "faults")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--family", action="append")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--all", action="store_true", help="print every campaign, not only those that fail")
    asked = parser.parse_args()
    with ProcessPoolExecutor(asked.workers) as pool:
        for family in asked.family or FAMILIES:
            every = list(cases(family, asked.first, asked.count))
            done = list(map(scored, every)) if asked.workers == 1 else list(pool.map(scored, every))
            for s in done:
                if asked.all or not s.right or s.wrong:
                    mark = "wrong" if s.wrong else "near" if not s.right else "right"
                    of = f"{s.case.seed} {s.case.name} {s.case.channel} (own t {s.own_t:.1f})"
                    print(f"  {mark:5s} {of}: {s.said}", flush=True)
            n = len(done)
            inside = [x for s in done for x in s.inside]
            true_budget = f"; over a true budget {interval(sum(s.over for s in done), n)}"
            print(
                f"{family}: right {interval(sum(s.right for s in done), n)}; "
                f"right or near {interval(sum(s.near for s in done), n)}; "
                f"wrong {interval(sum(s.wrong for s in done), n)}; "
                f"more beside the truth {interval(sum(s.extra for s in done), n)}; "
                f"intervals {interval(sum(inside), len(inside))}; "
                f"{np.mean([s.seconds for s in done]):.1f} s each{true_budget}",
                flush=True,
            )
            seen = [s for s in done if s.own_t >= s.case.t]
            if seen:
                print(
                    f"{family}, own t no less: right {interval(sum(s.right for s in seen), len(seen))}; "
                    f"right or near {interval(sum(s.near for s in seen), len(seen))}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
