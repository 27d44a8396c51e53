"""Units, zeros and scales of a recording that does not say them: gravity at rest, gravity carried by turns.

accelerometers   |f| at rest is 1 g; with an offset rests lie on Σ ((reading_i − zero_i)/sensitivity_i)² = 1
gyros            between rests gravity turns by what the gyros turned by: df/dt = −ω × f
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.recordings.guess_roles import WINDOW
from planner.recordings.turns import Turn, apart, carried
from planner.units import STANDARD_GRAVITY_MPS2 as G

COMMON_G = (16384.0, 8192.0, 4096.0, 2048.0, 1024.0, 512.0, 256.0, 128.0, 64.0)  # counts in 1 g, data sheets
# counts in 1 deg/s: MPU, ITG-3200, and 4.375, 8.75, 17.5, 35, 70 mdeg/s a count of ST
COMMON_DPS = (131.0, 65.5, 32.8, 16.4, 14.375, 228.57, 114.29, 57.143, 28.571, 14.286, 131.072, 262.4, 1000.0)
NEAR = 0.08
LEAST_TURN = np.radians(20.0)
MOST_MISSED = np.radians(8.0)
ALIKE = np.radians(4.0)  # that two scales miss by, and tell nothing apart


@dataclass(frozen=True)
class Guess:
    """Unit, zero and counts in one unit of a triad; sure: the numbers say so; why: what they say."""

    unit: str
    zero: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sensitivity: tuple[float, float, float] | None = None
    sure: bool = True
    why: str = ""

    def applied(self, values: Array) -> Array:
        """(n, 3) values in `unit`."""
        size = np.ones(3) if self.sensitivity is None else np.array(self.sensitivity)
        return np.asarray((values - np.array(self.zero)) / size)


@dataclass(frozen=True)
class Rests:
    """Quiet stretches of a recording in windows of 20 samples: first … last − 1 of each."""

    bounds: tuple[tuple[int, int], ...]

    def means(self, windows: Array) -> Array:
        """(m, k) means over each stretch of (n, k) window means."""
        return np.array([windows[a:b].mean(axis=0) for a, b in self.bounds])


def windows_of(values: Array) -> Array:
    """(n, k) means of windows of 20 samples."""
    rows = len(values) // WINDOW
    return np.asarray(values[: rows * WINDOW].reshape(rows, WINDOW, values.shape[1]).mean(axis=1))


def rests_of(values: Array) -> Rests:
    """Stretches of at least three windows that are as quiet as the quieter third of (n, k) values."""
    rows = len(values) // WINDOW
    if rows < 4:
        return Rests(((0, rows),) if rows else ())
    scatter = values[: rows * WINDOW].reshape(rows, WINDOW, values.shape[1]).std(axis=1)
    floor = np.maximum(np.quantile(scatter, 0.3, axis=0), 1e-12)
    means = windows_of(values)
    apart = np.abs(np.diff(means, axis=0, prepend=means[:1]))
    quiet = (scatter < 2.5 * floor).all(axis=1) & (apart < 4 * floor).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]]).astype(int)))
    found = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 3]
    return Rests(tuple(found) or ((0, rows),))


# ---------------------------------------------------------------- accelerometers


def acceleration(rest: Array, said: str) -> Guess:
    """The unit of (m, 3) readings at rests; said: what the file says."""
    sizes = np.linalg.norm(rest, axis=1)
    size, spread = float(np.median(sizes)), float(np.ptp(sizes) / max(np.median(sizes), 1e-300))
    if spread < 0.35 or len(rest) < 7:
        for unit, one in (("m/s^2", G), ("g", 1.0), ("mg", 1000.0)):
            if abs(size / one - 1) < NEAR + spread / 2:
                return Guess(unit, why=f"at rest |f| is {size:.4g} {unit}")
        for counts in COMMON_G:
            if abs(size / counts - 1) < NEAR:
                return Guess("g", sensitivity=(counts,) * 3, why=f"at rest |f| is {size:.0f} counts")
    fitted = _ellipsoid(rest)
    if fitted is not None:
        return fitted
    if said:
        return Guess(said, sure=False, why=f"the file says so, but at rest |f| is {size:.4g}")
    one = float(f"{size:.4g}") or 1.0
    return Guess("g", sensitivity=(one,) * 3, sure=False, why=f"at rest |f| is {size:.4g} of its readings")


def _ellipsoid(rest: Array) -> Guess | None:
    """Zero and counts in 1 g from rests in many attitudes: Σ p_i x_i² + q_i x_i = 1 is linear in p and q."""
    middle, size = rest.mean(axis=0), float(np.abs(rest - rest.mean(axis=0)).max())
    if len(rest) < 7 or size == 0:
        return None
    x = (rest - middle) / size
    design = np.hstack([x**2, x])
    found, _, rank, singular = np.linalg.lstsq(design, np.ones(len(x)), rcond=None)
    p, q = found[:3], found[3:]
    if rank < 6 or singular[-1] < 1e-3 * singular[0] or (p <= 0).any():
        return None
    centre = -q / (2 * p)
    radius = np.sqrt((1 + (q**2 / (4 * p)).sum()) / p)
    missed = np.abs(np.linalg.norm((x - centre) / radius, axis=1) - 1).max()
    if missed > 0.05 or radius.max() > 1.5 * radius.min():
        return None
    zero, counts = centre * size + middle, radius * size
    return Guess(
        "g",
        _three(zero),
        _three(counts),
        why=f"|f| is then 1 g within {100 * missed:.1f} % at {len(rest)} rests",
    )


def _three(values: Array) -> tuple[float, float, float]:
    x, y, z = (float(f"{v:.6g}") for v in values)
    return x, y, z


# ---------------------------------------------------------------- gyros


def rate(rest: Array, said: str, carried: tuple[float, float] | None, is_whole: bool, with_si: bool) -> Guess:
    """The unit of gyros whose readings at rests are (m, 3).

    carried: (rad/s in one reading that carries gravity best, angle by which it misses), None without turns
    is_whole: every reading is a whole number; with_si: the accelerometers are in m/s^2
    """
    middle = np.median(rest, axis=0)
    zero = _three(np.round(middle)) if is_whole and np.abs(middle).max() > 200 else (0.0, 0.0, 0.0)
    if carried is not None and carried[1] < MOST_MISSED:
        return _by_turns(carried, zero)
    if said:
        return Guess(said, zero, why="the file says so")
    if is_whole:
        return Guess("deg/s", zero, (1.0,) * 3, False, "whole numbers, counts: see the data sheet")
    unit = "rad/s" if with_si else "deg/s"
    return Guess(unit, zero, sure=False, why="nothing turned in a way that would tell")


def _by_turns(carried: tuple[float, float], zero: tuple[float, float, float]) -> Guess:
    one, missed = carried
    said = f"turned by it, gravity misses the next rest by {np.degrees(missed):.1f} deg"
    for unit, factor in (
        ("rad/s", 1.0),
        ("deg/s", np.pi / 180),
        ("mdeg/s", np.pi / 180e3),
        ("rpm", np.pi / 30),
    ):
        if abs(one / factor - 1) < NEAR:
            return Guess(unit, zero, why=said)
    counts = np.pi / 180 / one
    near = min(COMMON_DPS, key=lambda c: abs(counts / c - 1))
    best = near if abs(counts / near - 1) < 0.015 else float(f"{counts:.4g}")
    return Guess("deg/s", zero, (best,) * 3, why=said)


def carried_by(gyro: Array, force: Array, time: Array, rests: Rests) -> tuple[float, float] | None:
    """rad/s in one reading with which gyros best carry gravity from rest to rest, and by how much it misses.

    gyro: (n, 3) window means; force: (n, 3) of any unit with the right zero; time: (n,) s. Tried over 1e-6 …
    10, then finer about the best. None with fewer than two turns of over 20 deg.
    """
    turns = list(_turns(gyro, force, time, rests))
    if len(turns) < 2:
        return None
    best = (1.0, np.pi)
    low, high, count = -6.0, 1.0, 350
    for _ in range(3):
        tried = np.logspace(low, high, count)
        missed = np.mean([_missed(turn, tried) for turn in turns], axis=0)
        # turns by quarters end alike with whole turns more: the least scale that does is meant
        place = int(np.flatnonzero(missed <= max(missed.min() + ALIKE, 1.5 * missed.min()))[0])
        near = slice(place, place + 10)
        place += int(np.argmin(missed[near]))
        best = (float(tried[place]), float(missed[place]))
        step = (high - low) / (count - 1)
        low, high, count = np.log10(best[0]) - 2 * step, np.log10(best[0]) + 2 * step, 41
    return best


def _turns(gyro: Array, force: Array, time: Array, rests: Rests) -> Iterator[Turn]:
    """(direction before, after, (m, 3) readings times seconds) between neighbouring rests."""
    for (a, b), (c, d) in zip(rests.bounds, rests.bounds[1:], strict=False):
        before, after = (force[i:k].mean(axis=0) for i, k in ((a, b), (c, d)))
        before, after = before / np.linalg.norm(before), after / np.linalg.norm(after)
        if np.arccos(np.clip(before @ after, -1, 1)) < LEAST_TURN or c - b > 400:
            continue
        part = slice(b - 1, c + 1)
        spacing = np.diff(time[b - 1 : c + 2])
        rate_ = gyro[part][: len(spacing)] - gyro[a:b].mean(axis=0)
        yield before, after, rate_ * spacing[:, None]


def _missed(turn: Turn, scales: Array) -> Array:
    """(s,) angles between gravity carried with each scale and gravity as it is."""
    before, after, small = turn
    direction = np.tile(before, (len(scales), 1))
    for w in small:
        size = float(np.linalg.norm(w))
        if size == 0:
            continue
        direction = carried(direction, w / size, (scales * size)[:, None])
    return apart(direction, after)


def whole_numbers(values: NDArray[np.float64]) -> bool:
    """Whether every reading is a whole number."""
    known = values[np.isfinite(values)]
    return bool(len(known)) and bool((known == np.round(known)).all())
