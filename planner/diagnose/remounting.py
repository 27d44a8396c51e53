"""A unit that is mounted anew in the middle of a campaign: from one power-on on all axes are turned alike.

    y = (1 + κ) M (u + θ × u) + b   of every power-on from number k on; θ (3,) is of both sensors

The leans of six channels are twelve numbers, and a remounting gives them three: it is one where the three say
what the twelve would, beyond chance over all k. A sensor that is another one, or changed by itself, does not
keep to it. Sums over power-ons make every k as cheap as one,

    G(k) = Σ WᵀW − (Σ QᵀW)ᵀ(Σ QᵀW),   h(k) = Σ Wᵀz   over the power-ons from k on,

W the whitened columns, Q the declared model and what is believed, z the residual clear of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.diagnose.hypotheses.lack_of_fit import SHARED_MISFIT
from planner.diagnose.hypotheses.orthogonal import clear, orthonormal
from planner.diagnose.hypotheses.prepared import Prepared
from planner.diagnose.hypotheses.references import REFERENCES, at_rest, hypothesis, loaded
from planner.diagnose.hypotheses.sensor import SensorFound
from planner.diagnose.hypotheses.suspects import DEGREES, TWO_SIDED
from planner.measurement import sensed
from planner.nouns.array import Array
from planner.nouns.diagnosis import ReferenceSuspect
from planner.nouns.dwell_table import DwellTable
from planner.solvers.distributions import chi_square_tail
from planner.spec.references import BenchAccuracy

NAME = "mounting"
CHANCE = 1e-5  # over all power-ons from which on it may be: of what would be wrong with all channels at once
SIDE = 2  # power-ons on either side, of six or more: one that is off has a name of its own
LEAST_RUNS = 3  # power-ons: of two either is mounted otherwise than the other
UNLIKE = 1e-3  # p of what the twelve leans explain beside the three angles, above which they agree
OF_WHAT_IS_COMMON = 0.1  # which they may explain of a strong one: products that three angles miss
OF_ONE = 0.8  # of what the channels see: more by one alone is that channel's
SEEN = 1e-4  # of the best told angle's information, below which an angle is not told
MOST_RAD = 0.1  # 6 deg, beyond which θ × u is no rotation


@dataclass(frozen=True)
class Remounted:
    """From which power-on on by what angles. theta: (3,) rad, half: of their length's 95 % interval

    rests: whether it is so at rest alone, on a cube or a plate, and not in turns
    """

    run: int
    rests: bool
    theta: Array
    half: float
    channels: tuple[str, ...]
    p_value: float
    strength: float
    chance: float
    stated: float

    def right(self, table: DwellTable) -> DwellTable:
        """The table with the references that the unit had."""
        mine = table.run >= self.run
        mine &= at_rest(table.conditions()) if self.rests else ~loaded(table.conditions())
        turned = {}
        for name in ("ref_rate", "ref_acc"):
            u = getattr(table, name)
            if u is not None:
                turned[name] = u + np.where(mine[:, None], np.cross(self.theta, u), 0.0)
        return replace(table, **turned)

    @property
    def suspect(self) -> ReferenceSuspect:
        """As it is reported."""
        r, size = REFERENCES[NAME], float(np.linalg.norm(self.theta))
        angles = ", ".join(f"{x:+.2g}" for x in self.theta * DEGREES)
        where = "at rest, from" if self.rests else "from"
        check = (
            f"look up whether the unit was mounted anew before run {self.run}: {where} there on it is turned "
            f"by {angles} deg about x, y and z on all channels alike; {r.check}"
        )
        return ReferenceSuspect(
            NAME, size * DEGREES, (size - self.half) * DEGREES, (size + self.half) * DEGREES, "deg",
            self.channels, self.p_value, self.strength, check, self.strength, r.alias, r.record,
            self.stated * DEGREES, self.chance,
        )  # fmt: skip


@dataclass(frozen=True)
class _Steps:
    """What a channel says of the angles from each k on. gram: (g − 1, 3, 3), h: (g − 1, 3)"""

    name: str
    gram: Array
    h: Array


def remounted(
    found: Sequence[SensorFound], data: Prepared, benches: Sequence[BenchAccuracy]
) -> Remounted | None:
    """The one remounting that explains most, or None."""
    if len(data.starts) < LEAST_RUNS:
        return None
    every = (_best(found, data, rests, benches) for rests in (False, True))
    return max((one for one in every if one is not None), key=lambda one: one.strength, default=None)


def _best(
    found: Sequence[SensorFound], data: Prepared, rests: bool, benches: Sequence[BenchAccuracy]
) -> Remounted | None:
    steps = [_steps(s, axis, data, rests) for s in found for axis in s.found.pool.state]
    if len(steps) < 2:
        return None
    gram, h = np.sum([x.gram for x in steps], axis=0), np.sum([x.h for x in steps], axis=0)
    s2 = max(float(np.mean([w.mean_square for s in found for w in s.found.pool.state.values()])), 1.0)
    delta = _explained(gram, h) / s2
    side = min(SIDE, (len(delta) + 1) // LEAST_RUNS)
    k = side - 1 + int(np.argmax(delta[side - 1 : len(delta) - side + 1]))
    tests = 2.0 * len(delta)  # with and without those in turns
    p = float(min(1.0, tests * chi_square_tail(float(delta[k]), 3)))
    if (
        p > CHANCE
        or delta[k] < _misfit(found)
        or not _agree([(x.gram[k], x.h[k]) for x in steps], float(delta[k]), s2)
    ):
        return None
    way = _pseudo(gram[k])
    theta = way @ h[k]
    size = float(np.linalg.norm(theta))
    if size > MOST_RAD:
        return None
    variance = s2 * np.diag(way)
    half = TWO_SIDED * float(np.sqrt(theta**2 @ variance)) / max(size, 1e-300)
    stated = max(map(REFERENCES[NAME].stated, benches), default=0.0)
    square = float(np.sum(theta**2 / (stated**2 + variance))) if stated > 0.0 else 0.0
    return Remounted(
        int(data.table.run[data.starts[k + 1]]), rests, theta, half, tuple(x.name for x in steps), p,
        float(np.sqrt(delta[k])), float(chi_square_tail(square, 3)), float(stated),
    )  # fmt: skip


def _steps(s: SensorFound, axis: int, data: Prepared, rests: bool) -> _Steps:
    """Sums over the power-ons from each one on."""
    w, pool = s.found.pool.state[axis], s.found.pool
    conditions = w.channel.model.conditions
    here = at_rest(conditions) if rests else ~loaded(conditions)  # a centrifuge has a mounting of its own
    u = sensed(s.sensor, conditions) * here[:, None]
    across = np.column_stack([np.cross(e, u)[:, axis] * w.channel.lean for e in np.eye(3)])
    W = w.noise.whiten(across)
    mine = [pool.blocks[b].columns[axis] for b in _of_other_kinds(s, axis)]
    Q, z = w.Q, w.z
    if mine:
        more = orthonormal(clear(w.Q, w.noise.whiten(np.column_stack(mine))), 1e-6)
        Q, z = np.column_stack([Q, more]), clear(more, z)
    parts = [np.split(x, data.starts[1:]) for x in (Q, W, z)]
    each = [(b.T @ b, a.T @ b, b.T @ c) for a, b, c in zip(*parts, strict=True)]
    square, along, h = (_from_on(np.array([x[i] for x in each])) for i in range(3))
    return _Steps(w.channel.name, square - np.swapaxes(along, 1, 2) @ along, h)


def _misfit(found: Sequence[SensorFound]) -> float:
    """Δ that a strong effect of the bench may leave: its geometry is known roughly, its columns linear."""
    known = [(hypothesis(_name(s, b)), s.found.share(b).delta) for s in found for b in s.found.library]
    return max((max(h.misfit, SHARED_MISFIT) * delta for h, delta in known if h.bench_only), default=0.0)


def _name(s: SensorFound, b: int) -> str:
    return s.found.pool.blocks[b].name


def _of_other_kinds(s: SensorFound, axis: int) -> list[int]:
    """What is believed of a channel and does not go with the day: that may be the remounting itself."""
    blocks = s.found.pool.blocks
    return [
        b for b in s.found.library if axis in blocks[b].columns and "day" not in hypothesis(_name(s, b)).needs
    ]


def _from_on(each: Array) -> Array:
    """(g − 1, …) sums from the second power-on on, from the third, …, of (g, …)."""
    return np.asarray(np.cumsum(each[::-1], axis=0)[::-1][1:])


def _agree(each: Sequence[tuple[Array, Array]], common: float, s2: float) -> bool:
    """Whether the channels' own leans explain no more than the angles that they share, and not one alone."""
    own = np.array([float(_explained(g[None], h[None])[0]) for g, h in each]) / s2
    freedom = sum(_rank(g) for g, _ in each) - _rank(np.sum([g for g, _ in each], axis=0))
    between = float(own.sum()) - common
    if freedom < 1 or own.max() > OF_ONE * own.sum():
        return False
    return between <= OF_WHAT_IS_COMMON * common or bool(chi_square_tail(between, freedom) > UNLIKE)


def _explained(gram: Array, h: Array) -> Array:
    """(k,) Δ = hᵀ G⁺ h."""
    return np.asarray(np.einsum("ki,kij,kj->k", h, _pseudo(gram), h))


def _pseudo(gram: Array) -> Array:
    return np.asarray(np.linalg.pinv(gram, rcond=SEEN, hermitian=True))


def _rank(gram: Array) -> int:
    values = np.linalg.eigvalsh(gram)
    return int(np.count_nonzero(values > SEEN * values[-1])) if values[-1] > 0.0 else 0
