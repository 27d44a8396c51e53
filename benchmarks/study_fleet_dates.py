"""Do dates in store neither waste nor endanger? Fleets of laws that planner.fleet does not know
(histories.py).

Of every law and length of history, over several fleets of 30 units: the share of units that pass the limit
before their date (exact binomial interval), the median date beside the median of one who knows the law and
the present truth (5 % first passage, capped at a year), how many later values lie within the 95 % band of
the forecast, and how many unmarked steps were found, truly and falsely.

    python benchmarks/study_fleet_dates.py                       # the laws on which it is judged
    python benchmarks/study_fleet_dates.py --tuned --fleets 2 --weeks 8,30 [law …]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks.histories import JUDGED, START, TUNED, YEAR, Law, lived, passed, possible, sheet
from planner.dwells.dwell_files import read_dwells
from planner.fleet.allowed_region import PARTS, reserve_of
from planner.fleet.history_sources import source_files
from planner.pipelines.fleet import Basis, ForecastOptions, basis_of, forecast_on
from planner.solvers.distributions import binomial_interval
from planner.spec.load import load_spec
from planner.units import unit_factor

SPEC = Path(__file__).parents[1] / "requirements_specs" / "recalibration.yaml"
WEEKS = (3, 5, 8, 15, 30, 60)
LEADS = (7, 28, 91)
UNITS = 30
KINDS = ("gyro.bias", "accelerometer.bias")


@dataclass
class Cell:
    """Counts of one law and length."""

    late: int = 0
    units: int = 0
    dates: list[float] = field(default_factory=list)
    possible: list[float] = field(default_factory=list)
    inside: int = 0
    values: int = 0
    true: int = 0
    steps: int = 0
    false: int = 0
    seconds: float = 0.0

    def add(self, other: Cell) -> None:
        """Take another cell in."""
        for name in ("late", "units", "inside", "values", "true", "steps", "false", "seconds"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.dates += other.dates
        self.possible += other.possible

    def line(self) -> str:
        """The figures."""
        low, high = binomial_interval(self.late, self.units, 0.025)
        date, best = np.median(self.dates), np.median(self.possible)
        return (
            f"late {self.late:3d}/{self.units:4d} ({100 * low:4.1f} … {100 * high:4.1f} %)  days {date:4.0f} "
            f"of {best:4.0f} = {date / max(best, 1e-9):4.2f}  inside "
            f"{100 * self.inside / max(self.values, 1):5.1f} %  steps "
            f"{self.true}/{self.steps}, false {self.false}/{self.units - self.steps}  {self.seconds:5.1f} s"
        )


def one_fleet(law: Law, weeks: int, seed: int, basis: Basis, method: str) -> Cell:
    """One fleet of 30 units, forecast as the command does it."""
    rng = np.random.default_rng(seed)
    region, places = basis.region, [i for i, t in enumerate(basis.region.terms) if t.error in KINDS]
    storage = {m.name: m.storage for m in basis.models}
    one = np.array([storage[region.terms[i].error] for i in places])
    kept = np.ones((len(region.terms), len(PARTS)))
    for part in ("estimate", "storage"):
        kept[places, PARTS.index(part)] = 0.0
    reserve = reserve_of(region, kept)

    def load(x: np.ndarray) -> np.ndarray:
        slope = region.constraints[0].steepest
        return np.asarray(
            (np.abs(x) @ (one * slope[places]) + slope @ reserve.sums) / region.constraints[0].limit
        )

    fleet = lived(law, UNITS, len(places), weeks, rng)
    names = [
        (
            region.terms[i].error,
            region.terms[i].term,
            region.terms[i].unit,
            s / unit_factor(region.terms[i].unit)[0],
        )
        for i, s in zip(places, one, strict=True)
    ]
    cell = Cell(units=UNITS)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "history.csv"
        path.write_text(sheet(fleet, weeks, names, rng, stated=bool(seed % 2)))
        started = time.perf_counter()
        read = source_files([str(path)], read_dwells)
        options = ForecastOptions(method=method, today=_today(weeks))
        found = forecast_on(read, basis, options, quiet, validated=False)
        cell.seconds = time.perf_counter() - started
    last = 7.0 * (weeks - 1)
    over = passed(fleet, weeks, load)
    for u, unit in enumerate(found.units):
        date = {"date": (unit.day or 0.0) - last, "kept": float(YEAR), "passed": 0.0}.get(
            unit.outcome, np.nan
        )
        cell.late += bool(over[u] < min(date, YEAR))
        cell.dates.append(0.0 if np.isnan(date) else date)
    cell.possible = possible(fleet, weeks, load, 400, seed + 1).tolist()
    fresh = np.random.default_rng(seed + 2)
    column = {(n[0], n[1]): c for c, n in enumerate(names)}
    for channel in found.channels:
        if channel.forecast is None:
            continue
        c, u = column[channel.series.error, channel.series.term], int(channel.series.unit[1:])
        half = channel.forecast.half_width(0.95)
        start = float(channel.series.day[-1])
        for lead in LEADS:
            true = fleet.value[u, c, int(last) + lead] + law.noise * fresh.normal()
            ahead = last + lead - start
            mean, wide = (np.interp(ahead, channel.ahead, v) for v in (channel.forecast.mean, half))
            cell.inside += bool(abs(true * one[c] - mean) <= wide)
            cell.values += 1
    said = {u for u in range(UNITS) if any(_names(n, f"u{u:02d}") for n in found.history.notes)}
    cell.steps = int(np.sum(fleet.step >= 0))
    cell.true = sum(fleet.step[u] >= 0 for u in said)
    cell.false = sum(fleet.step[u] < 0 for u in said)
    return cell


def _names(note: str, unit: str) -> bool:
    return "jumps on" in note and unit in note


def _today(weeks: int):
    from datetime import timedelta

    return START + timedelta(days=7 * (weeks - 1))


def quiet(message: str) -> None:
    del message


def main() -> None:
    """A line for every law and length, and all of them together."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--tuned", action="store_true")
    parser.add_argument("--fleets", type=int, default=2)
    parser.add_argument("--weeks", default=",".join(map(str, WEEKS)))
    parser.add_argument("--method", default="auto")
    parser.add_argument("laws", nargs="*")
    asked = parser.parse_args()
    laws = TUNED if asked.tuned else JUDGED
    basis = basis_of(load_spec(SPEC), None, quiet)
    weeks = [int(w) for w in asked.weeks.split(",")]
    total = Cell()
    by_length = {w: Cell() for w in weeks}
    for name in asked.laws or laws:
        for w in weeks:
            cell = Cell()
            for fleet in range(asked.fleets):
                cell.add(
                    one_fleet(
                        laws[name], w, (1000 if asked.tuned else 5000) + 10 * w + fleet, basis, asked.method
                    )
                )
            print(f"{name:18s}{w:3d} weeks  {cell.line()}", flush=True)
            total.add(cell)
            by_length[w].add(cell)
    for w, cell in by_length.items():
        print(f"{'all':18s}{w:3d} weeks  {cell.line()}")
    print(f"{'all':18s}           {total.line()}")


if __name__ == "__main__":
    main()
