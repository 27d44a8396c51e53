"""A thermometer that reads otherwise in some power-ons: from one on, on one bench, on one day.

    T = T_read − δ   in these power-ons, one δ for all channels

A constant through all records nothing tells (`references.thermometer_offset`). In a part of them the curves
of every channel are read δ too far along, and where the same temperatures come again the channels differ,
each by the slope of its own curve: a step of the bias to one of them, a temperature to six. With smooth
curves p, κ of every channel over T, v the misaligned input,

    S(δ) = Σ_channels min |V^(−½) (y − p(T) − κ(T) v − …)|²,     C(δ) = N ln(S/N) + k ln N

(Schwarz, Ann. Stat. 6 (1978) 461), of the degree at which C is least. Which power-ons is asked by the slopes,
as one column D = p'(T) + κ'(T) v of these; sums over power-ons make every set as cheap as the first. It is a
finding where C falls beyond chance below that of any curves over T as read, the declared tables with their
straight lines included, where several channels say it by themselves, all agree as those of a thermometer that
lags (`agree_on_one`), and what is left is noise.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.findings.lagging_thermometer import (
    CHANCE,
    CHI2_999,
    MOST_DEGREE,
    Seen,
    agree_on_one,
    curves,
    seen_of,
    shifted,
)
from planner.diagnose.findings.suspects import FEW
from planner.diagnose.records.changed_power_ons import CHI2_95, LEAST_RUNS, SIDE, Span, sets_of
from planner.diagnose.references.bench_of_rows import MOST as MOST_BENCHES
from planner.diagnose.references.thermometer_offset import NAME
from planner.diagnose.search.sensor import SensorFound
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.solvers.distributions import TWO_SIDED, chi_square_tail
from planner.spec.references import BenchAccuracy
from planner.temperature_table import GAP_K, hats, temperature_nodes

MOST_ROWS = 20_000  # larger tables are recordings, not dwells
LEAST_POINTS = 3  # chamber points, of which a curve is told
MOST_K = 40.0  # that is no slip of a thermometer's zero but another file
STEP_K = 4.0  # between offsets that are tried first: curves over 120 K hardly bend within it
TRIED = 2  # sets of power-ons, of those whose slopes say most
SURE = 30.0  # by which C falls: 15 of the log of the odds, beside all sets that are asked
FINE = 4  # offsets on either side of the best of these
WIDE_K = 8.0  # beside it, where a channel that says another one may have its own least
SEVERAL = 3  # channels that must say it by themselves: two accelerometers that stood crooked did
LEFT = 1.5  # of the noise's square, that curves may leave of a channel: four power-ons of another unit left 4
GLIMPSED = 1e-6  # p of the slopes, below which S is asked over offsets
WITHIN_K = 1.0  # of a chamber's point: beyond the others' last one nothing is known of a curve
POINTS = 2  # of the power-ons, between those of the others: one may be met by chance
RANK = 1e-11  # of the largest direction of columns of one length
Which = Span | str  # a span of power-ons, or a bench by its name


@dataclass(frozen=True)
class OffThermometer:
    """K by which the thermometer reads too much in some power-ons; half: of the 95 % interval.

    which: how these are to be said; stated: of the benches' thermometers, one sigma, K
    """

    runs: NDArray[np.int64]
    which: Which
    value: float
    half: float
    channels: tuple[str, ...]
    strength: float
    stated: float

    def right(self, table: DwellTable) -> DwellTable:
        """The table with temperatures of one thermometer."""
        here = np.isin(table.run, self.runs)
        return replace(table, temperature_degc=table.temperature_degc - np.where(here, self.value, 0.0))

    @property
    def suspect(self) -> ReferenceSuspect:
        """As it is reported."""
        known = float(np.hypot(self.stated, self.half / TWO_SIDED))
        square = (self.value / known) ** 2 if self.stated > 0.0 else 0.0
        check = (
            f"compare the thermometer with a second one at the unit's own place: {self._where} it reads "
            f"{self.value:+.2g} K more than in the others, or in those so much less: these records do not "
            "tell which; they are judged as if it were right in the others"
        )
        return ReferenceSuspect(
            NAME, self.value, self.value - self.half, self.value + self.half, "K", self.channels,
            float(chi_square_tail(self.strength**2, 1)), self.strength, check, self.strength,
            stated=self.stated, chance=float(chi_square_tail(square, 1)),
        )  # fmt: skip

    @property
    def _where(self) -> str:
        first, last = int(self.runs[0]), int(self.runs[-1])
        if self.which == "on":
            return f"from run {first} on"
        if self.which == "day":
            return f"in runs {first} to {last}, those of one day,"
        named = ", ".join(map(str, self.runs[:FEW].tolist())) + (", …" if len(self.runs) > FEW else "")
        return f"on {self.which} (run {named})"


def thermometer_of_power_ons(
    found: Sequence[SensorFound], data: Prepared, benches: Sequence[BenchAccuracy]
) -> OffThermometer | None:
    """The power-ons in which the thermometer reads otherwise, and by how much; None where none says so."""
    table = data.table
    points = len(temperature_nodes(table.temperature_degc))
    if len(data.starts) < LEAST_RUNS * SIDE or len(table) > MOST_ROWS or points < LEAST_POINTS:
        return None
    sets, which = _sets(table, data.starts)
    fit = _fit_of(found, table, points)
    if not len(sets) or len(fit.channels) < 2:
        return None
    asked, best = [*dict.fromkeys(fit.glimpsed(data.starts, sets))], (np.inf, 0, 0.0)
    if not asked:
        return None
    as_read = min(float(fit.criterion(fit.as_read)[0]), fit.criterion_of_tables())
    offsets = np.arange(-MOST_K, MOST_K + STEP_K / 2.0, STEP_K)
    for k in asked:
        each = fit.criterion(fit.moved(_rows_of(sets[k], data)).grams(offsets))[0]
        best = min(best, (float(each.min()), k, float(offsets[each.argmin()])))
    if not as_read - best[0] > SURE + 2.0 * np.log(len(sets)):
        return None
    _, k, offset = best
    sized = fit.sized(_rows_of(sets[k], data), offset)
    if which[k] == "on":  # slopes tell the place only roughly, of curves that had the offset in them
        places = [i for i, one in enumerate(which) if one == "on"]
        k = places[int(np.argmin(fit.criterion(fit.moved_by(sized.value, data.starts, sets[places]))[0]))]
        sized = fit.sized(_rows_of(sets[k], data), sized.value)
    few = np.count_nonzero(sized.falls > CHI2_999) < SEVERAL
    if few or not sized.half < abs(sized.value) < MOST_K or sized.left.max() > LEFT:
        return None
    if not agree_on_one(sized.falls, sized.apart, CHANCE / len(sets)):
        return None
    if not _come_again(table.temperature_degc, _rows_of(sets[k], data) > 0.0, sized.value):
        return None
    told = tuple(c.name for c, fall in zip(fit.channels, sized.falls, strict=True) if fall > CHI2_95)
    return OffThermometer(
        table.run[data.starts[sets[k]]], which[k], sized.value, sized.half, told,
        float(np.sqrt(max(sized.falls.sum(), 0.0))), max((b.temperature for b in benches), default=0.0),
    )  # fmt: skip


def _come_again(temperature: Array, here: NDArray[np.bool_], offset: float) -> bool:
    """Whether two points of the power-ons, or their only one, are, put right, between those of the others.

    A campaign that goes from cold to hot once has none: the hot end pushed out by 24 K is another bend of
    every curve, and six channels of a plan's own campaign had it.
    """
    others, points = temperature[~here], temperature_nodes(temperature[here] - offset)
    between = (points >= others.min() - WITHIN_K) & (points <= others.max() + WITHIN_K)
    return bool(np.count_nonzero(between) >= min(POINTS, len(points)))


def sized_again(one: OffThermometer, found: Sequence[SensorFound], data: Prepared) -> OffThermometer:
    """The same with what a search of the table that was put right still finds of it.

    Rows that are far off for their temperature count less, and those are the ones that tell it: of 3.3 K the
    first answer was 2.7 +- 0.4.
    """
    here = np.isin(data.table.run, one.runs).astype(float)
    rest = _fit_of(found, data.table, len(temperature_nodes(data.table.temperature_degc))).sized(here, 0.0)
    return replace(one, value=one.value + rest.value, half=rest.half)


def _fit_of(found: Sequence[SensorFound], table: DwellTable, points: int) -> _Fit:
    seen = [seen_of(s, axis) for s in found for axis in s.found.pool.state]
    return _Fit(table, seen, int(np.clip(points - 1, 1, MOST_DEGREE)))


def _rows_of(runs: NDArray[np.bool_], data: Prepared) -> Array:
    """(n,) 1 in the rows of power-ons (g,)."""
    return np.repeat(runs, np.diff(np.append(data.starts, len(data.table)))).astype(float)


def _sets(table: DwellTable, starts: NDArray[np.int64]) -> tuple[NDArray[np.bool_], list[Which]]:
    """(w, g) power-ons that may have a thermometer of their own: from one on, of one day, on one bench."""
    every, spans = sets_of(table.day[starts], first_day=True)
    told = [(x, span) for x, span in zip(every, spans, strict=True) if span in ("on", "day")]
    sets: list[tuple[NDArray[np.bool_], Which]] = list(told)
    if table.bench is not None:
        bench = table.bench[starts]
        names = np.unique(bench).tolist()
        if 1 < len(names) <= MOST_BENCHES:
            sets += [(bench == name, str(name)) for name in names if np.count_nonzero(bench == name) >= SIDE]
    return np.array([x for x, _ in sets]), [name for _, name in sets]


# ---------------------------------------------------------------- curves at temperatures


@dataclass(frozen=True)
class _Sized:
    """An offset, half of its 95 % interval; (channels,) how far S falls, is above its least, and S itself."""

    value: float
    half: float
    falls: Array
    apart: Array
    left: Array


@dataclass(frozen=True)
class _Fit:
    """All channels under curves of one degree, up to the largest that the chamber's points tell."""

    table: DwellTable
    channels: Sequence[Seen]
    most: int

    @cached_property
    def columns(self) -> list[Array]:
        """(n, m) whitened A of every channel: curves of the largest degree as read, and all else."""
        t = self.table.temperature_degc
        basis = curves(t, t, self.most)
        return [np.column_stack([c.curved(basis), c.fixed]) for c in self.channels]

    @cached_property
    def as_read(self) -> list[Array]:
        """(m, m) AᵀA of every channel."""
        return [A.T @ A for A in self.columns]

    def moved(self, here: Array) -> _Moved:
        """The same where the rows of some power-ons, here (n,) 1, may have another temperature."""
        rows = here > 0.0
        parts = [A.T @ A for A in (A[rows] for A in self.columns)]
        t = self.table.temperature_degc
        return _Moved(t, self.most, [G - part for G, part in zip(self.as_read, parts, strict=True)], parts)

    def moved_by(self, offset: float, starts: NDArray[np.int64], sets: NDArray[np.bool_]) -> list[Array]:
        """(w, m, m) AᵀA of every channel where each of the sets of power-ons (w, g) has one offset."""
        t, each = self.table.temperature_degc, list[Array]()
        for A, G in zip(self.columns, self.as_read, strict=True):
            of_power_ons = np.array([part.T @ part for part in np.split(A, starts[1:])])
            here = np.tensordot(sets.astype(float), of_power_ons, axes=1)
            M = shifted(t, np.array([offset]), self.most, len(G))[0]
            each.append(G - here + M.T @ here @ M)
        return each

    def criterion(self, grams: Sequence[Array]) -> tuple[Array, NDArray[np.int64]]:
        """(…,) the least C of all degrees, and the degree, of products (…, m, m) of every channel."""
        degrees = range(1, self.most + 1)
        each = np.array([self._schwarz([self._left(G, d) for G in grams]) for d in degrees])
        return each.min(axis=0), np.asarray(1 + each.argmin(axis=0))

    def criterion_of_tables(self) -> float:
        """C of straight lines between the points at which the chamber was read."""
        t = self.table.temperature_degc
        basis = hats(t, temperature_nodes(t), GAP_K)
        stacked = (np.column_stack([c.curved(basis), c.fixed]) for c in self.channels)
        return float(self._schwarz([_regressed(A.T @ A, 2 * basis.shape[1]) for A in stacked]))

    def glimpsed(self, starts: NDArray[np.int64], sets: NDArray[np.bool_]) -> Iterator[int]:
        """The sets whose slopes say most, of curves as bent as is best and of less; none if by chance."""
        best = int(self.criterion(self.as_read)[1])
        for degree in sorted({best, (best + 1) // 2}):
            chosen = sets.astype(float)
            square, along = np.zeros(len(sets)), np.zeros(len(sets))
            for c, G in zip(self.channels, self.as_read, strict=True):
                s2 = max(float(self._left(G, degree)[0]) / len(self.table), 1.0)
                one, other = self._slopes(c, G, degree, starts, chosen)
                square, along = square + one / s2, along + other / s2
            delta = np.where(square > 0.0, along**2 / np.maximum(square, 1e-300), 0.0)
            order = np.argsort(-delta)[:TRIED].tolist()
            yield from (k for k in order if float(chi_square_tail(float(delta[k]), 1)) < GLIMPSED)

    def sized(self, here: Array, near: float) -> _Sized:
        """The offset at which curves leave least, about one (`near`) at which C is least."""
        moved = self.moved(here)
        degree = int(self.criterion(moved.grams(np.array([near])))[1][0])

        def left(*some: float) -> Array:
            return np.array([self._left(G, degree)[0] for G in moved.grams(np.array(some))]).T

        offsets, each, step = np.array([near]), left(near), STEP_K
        for _ in range(2):  # S is no parabola over all of a coarse step, where slopes of curves change
            best = float(offsets[np.argmin(each.sum(axis=1))])
            finer = best + np.linspace(-step, step, 2 * FINE + 1)
            offsets = np.append(offsets, finer)
            each = np.vstack([each, left(*finer.tolist())])
            step /= FINE
        finest = each[-(2 * FINE + 1) :].sum(axis=1)
        i = int(np.clip(np.argmin(finest), 1, 2 * FINE - 1))
        a, b, _ = np.polyfit(finer[i - 1 : i + 2] - finer[i], finest[i - 1 : i + 2], 2)
        value = float(finer[i] + np.clip(-b / (2.0 * a), -step, step)) if a > 0.0 else float(finer[i])
        now, as_read, *wide = left(value, 0.0, value - WIDE_K, value + WIDE_K)
        s2 = max(float(finest.min()) / self._freedom(degree), 1.0)
        least = np.minimum(now, np.vstack([each, wide]).min(axis=0))
        half = float(np.sqrt(CHI2_95 * s2 / a)) if a > 0.0 else np.inf
        return _Sized(value, half, (as_read - now) / s2, (now - least) / s2, now / len(self.table))

    def _slopes(
        self, c: Seen, G: Array, degree: int, starts: NDArray[np.int64], chosen: Array
    ) -> tuple[Array, Array]:
        """(w,) square of D clear of the curves, and its product with what they leave, of every set."""
        t = self.table.temperature_degc
        basis = curves(t, t, degree)
        A = np.column_stack([c.curved(basis), c.fixed])
        d = 2 * basis.shape[1]
        y, X = A[:, d], np.delete(A, d, axis=1)
        way = np.linalg.pinv(X.T @ X, rcond=RANK, hermitian=True)
        beta = way @ (X.T @ y)
        slope = (curves(t, t - 0.5, degree) - curves(t, t + 0.5, degree)) @ beta[:d].reshape(2, -1).T
        D = c.w.noise.whiten((slope[:, 0] + slope[:, 1] * c.v)[:, None])[:, 0]
        each = np.add.reduceat(np.column_stack([D * D, D * (y - X @ beta), X * D[:, None]]), starts, axis=0)
        of_sets = chosen @ each
        cross = of_sets[:, 2:]
        return np.maximum(of_sets[:, 0] - np.sum((cross @ way) * cross, axis=1), 0.0), of_sets[:, 1]

    def _left(self, G: Array, degree: int) -> tuple[Array, int]:
        """(…,) what curves of a degree leave of a channel, G (…, m, m) of the largest; how many columns."""
        n = self.most + 1
        keep = np.array([*range(degree + 1), *range(n, n + degree + 1), *range(2 * n, G.shape[-1])])
        return _regressed(G[..., keep[:, None], keep], 2 * (degree + 1))

    def _freedom(self, degree: int) -> int:
        columns = sum(2 * (degree + 1) + int(c.fixed.shape[1]) - 1 for c in self.channels)
        return max(len(self.channels) * len(self.table) - columns, 1)

    def _schwarz(self, each: Sequence[tuple[Array, int]]) -> Array:
        count = len(self.channels) * len(self.table)
        left, columns = np.sum([x for x, _ in each], axis=0), sum(k for _, k in each)
        return np.asarray(count * np.log(np.maximum(left, 1e-300) / count) + columns * np.log(count))


@dataclass(frozen=True)
class _Moved:
    """Products of columns where some power-ons may have another temperature: of the rest, and of those.

    Every offset has its own without a look at the rows (`shifted`).
    """

    degc: Array
    most: int
    rest: Sequence[Array]
    here: Sequence[Array]

    def grams(self, offsets: Array) -> list[Array]:
        """(k, m, m) AᵀA of every channel, A the columns at T − offset (k,) in those power-ons."""
        each = list[Array]()
        for rest, here in zip(self.rest, self.here, strict=True):
            M = shifted(self.degc, offsets, self.most, len(here))
            each.append(rest + np.swapaxes(M, 1, 2) @ here @ M)
        return each


def _regressed(G: Array, target: int) -> tuple[Array, int]:
    """(…,) what regression leaves of the square of one column of A by the others, G (…, m, m) AᵀA.

    And how many these are.
    """
    others = np.delete(np.arange(G.shape[-1]), target)
    size = np.sqrt(np.maximum(np.diagonal(G, axis1=-2, axis2=-1)[..., others], 1e-300))
    X = G[..., others[:, None], others] / (size[..., :, None] * size[..., None, :])
    h = G[..., others, target] / size
    taken = np.einsum("...i,...ij,...j->...", h, np.linalg.pinv(X, rcond=RANK, hermitian=True), h)
    return np.maximum(G[..., target, target] - taken, 0.0), len(others)
