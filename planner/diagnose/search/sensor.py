"""One sensor's three channels from the prepared table to what was found: noise, pool, flips, search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from planner import catalog
from planner.diagnose.channels.channel import Channel, channel
from planner.diagnose.channels.parameters import Range, ranges
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.channels.read_temperature import strays_of, with_read_temperature
from planner.diagnose.channels.unseen_runs import cells_of
from planner.diagnose.hypotheses.candidates import (
    Block,
    generic_blocks,
    library_blocks,
    reference_blocks,
)
from planner.diagnose.hypotheses.chance import Flips
from planner.diagnose.hypotheses.estimates import Shape, estimates, shape_of, slopes_of
from planner.diagnose.hypotheses.found import Found, Question, along, on
from planner.diagnose.hypotheses.lack_of_fit import DECISIVE
from planner.diagnose.hypotheses.nonlinear import refined
from planner.diagnose.hypotheses.pool import Pool, pool_of
from planner.diagnose.hypotheses.scores import score
from planner.diagnose.hypotheses.within_input import most_of_terms
from planner.diagnose.noise.channel_noise import Readings, channel_noise, plain_readings
from planner.diagnose.noise.far_rows import drawn, far_rows, scale_scatter, without_far
from planner.diagnose.noise.noise_of_triad import triad_noise
from planner.diagnose.noise.stated_spreads import with_stated
from planner.diagnose.noise.undriven import as_budgeted_at_rest
from planner.diagnose.noise.whitened import Cleared, Whitened, cleared, moving, whitened
from planner.diagnose.search.borne_by_triad import borne_by_triad
from planner.diagnose.search.hardly_driven import hardly_driven
from planner.diagnose.search.noise_columns import coarse, of_the_full_model
from planner.diagnose.search.shown_noise import alike, as_shown
from planner.diagnose.search.stepwise import search
from planner.diagnose.vetoes.refusals import AS_THE_SPEC_SAYS, refusals
from planner.diagnose.vetoes.told_together import told_together
from planner.diagnose.vetoes.unnamed import unname_where_unnamed_wins
from planner.diagnose.vetoes.verdicts import Veto, vetoed
from planner.effects._shaped import plain_names
from planner.nouns.array import Array
from planner.protocols import Sensor
from planner.solvers.one_thread import one_thread
from planner.spec.budget import ErrorBudget
from planner.spec.references import BenchAccuracy

FLIPS = 2999  # the least p by rank, of one of six families, is then ALPHA_FURTHER
STRONG = 60.0  # sigma; products are about 1 % of an effect
AGAIN = 2  # searches more: with what was found strong, and with what was strong beside that
SIGNS = 20  # power-ons, from which enough change sign for the flips to tell the p that is asked of them
SEGMENTS = 40  # that change sign together where there are too few power-ons

Fallen = Set[tuple[str, int]]


@dataclass(frozen=True)
class SensorFound:
    """What was found on one sensor, with what it rests on.

    channels: those that move at all; far: axis -> (n,) rows that were left out; sizes: axis -> (n,) sigma
    ranges: effect -> what its parameters can be in this table
    impossible: candidates that would have explained something by more than nature has of it
    refused: what was believed and the power-ons refuse; faint: effects whose input hardly acts in any record
    runs: (g,) number of every power-on in the table
    """

    sensor: Sensor
    channels: tuple[Channel, ...]
    found: Found
    far: dict[int, NDArray[np.bool_]]
    cuts: NDArray[np.int64]
    ranges: Mapping[str, tuple[Range, ...]]
    impossible: tuple[str, ...] = ()
    sizes: Mapping[int, Array] = field(default_factory=dict)
    refused: tuple[Veto, ...] = ()
    faint: tuple[str, ...] = ()
    runs: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    def shape(self, block: int) -> Shape:
        """The parameters of a found block with their intervals."""
        return _shape(self.found, block, self.channels, self.cuts, self.ranges)

    def slopes(self, block: int) -> Block | None:
        """What a found block adds, derived by its parameters; None where it has none."""
        name = self.found.pool.blocks[block].name
        return slopes_of(self.found, block, self.channels, self.ranges.get(name, ()))


def diagnose_sensor(
    data: Prepared,
    sensor: Sensor,
    declared: tuple[str, ...],
    seed: int,
    benches: Sequence[BenchAccuracy] = (),
    fallen: Fallen = frozenset(),
) -> SensorFound:
    """Search one sensor of a prepared table; again where what was found is so strong that products count,

    and again without what cannot be. benches: how well the spec says that the references are known
    fallen: (effect, axis) of which the fit of all coefficients left nothing
    """
    strong: tuple[str, ...] = ()
    impossible: tuple[str, ...] = ()
    with one_thread():
        s = _searched(data, sensor, declared, strong, impossible, seed, benches, fallen)
        for _ in range(AGAIN):
            now, cannot = _strong(s.found), _impossible(s.found)
            if set(now) <= set(strong) and not cannot:
                break
            impossible = (*impossible, *cannot)
            strong = tuple(n for n in dict.fromkeys((*strong, *now)) if n not in impossible)
            s = _searched(data, sensor, declared, strong, impossible, seed, benches, fallen)
    return replace(s, impossible=impossible)


def _impossible(found: Found) -> list[str]:
    """Effects and references of which more would be needed than there can be, beyond the interval."""
    names = []
    driven = next(iter(found.pool.state.values())).channel.model.conditions
    for e in estimates(found.pool, found.library):
        block = found.pool.blocks[e.block]
        if abs(e.value) - e.half > most_of_terms(block, driven)[e.term]:
            names.append(block.name)
    return list(dict.fromkeys(names))


def _strong(found: Found) -> list[str]:
    """Effects so far above the noise that their products with the declared ones are above it too."""
    names = []
    for b in found.library:
        block = found.pool.blocks[b]
        if not block.nonlinear and not block.reference and found.share(b).delta > STRONG**2:
            names.append(block.name)
    return names


def _searched(
    data: Prepared,
    sensor: Sensor,
    declared: tuple[str, ...],
    strong: tuple[str, ...],
    impossible: tuple[str, ...],
    seed: int,
    benches: Sequence[BenchAccuracy],
    fallen: Fallen,
) -> SensorFound:
    b = begin(data, sensor, declared, strong, impossible, benches, fallen)
    signs = np.random.default_rng([seed, 17]).choice([-1.0, 1.0], size=(FLIPS, len(b.cuts)))
    shown = {name: ranges(e, data.table) for name, e in catalog.effects().items() if e.parameters}

    def refine(p: Pool, believed: Sequence[int], i: int) -> tuple[Pool, int]:
        return refined(p, believed, i, b.channels, b.cuts, shown[p.blocks[i].name])

    def slopes(f: Found, i: int) -> Block | None:
        return slopes_of(f, i, b.channels, shown.get(f.pool.blocks[i].name, ()))

    faint = hardly_driven(b.pool, range(b.library))
    named = [i for i in range(b.library) if i not in faint]
    unnamed = range(b.library, len(b.pool.blocks))
    flips = Flips(signs, len(data.starts) < SIGNS)
    question = Question(tuple(named), tuple(unnamed), flips, refine, slopes)
    found = search(b.pool, question)
    told_together(found, b.cuts)
    _unname_the_undetermined(found, b.channels, b.cuts, shown)
    refused = refusals(found, data.starts, _budgets(data, sensor))
    if any(veto.why not in AS_THE_SPEC_SAYS for veto in refused):
        _unname_what_is_left(found, question, data.starts)
    return SensorFound(
        sensor,
        b.channels,
        found,
        b.far,
        b.cuts,
        shown,
        sizes=b.sizes,
        refused=refused,
        faint=tuple(dict.fromkeys(b.pool.blocks[i].name for i in faint)),
        runs=data.table.run[data.starts],
    )


@dataclass(frozen=True)
class Begun:
    """What a search begins with. library: how many of the pool's blocks, the first ones, have a name.

    channels, far, sizes, cuts: as in SensorFound
    """

    channels: tuple[Channel, ...]
    library: int
    pool: Pool
    cuts: NDArray[np.int64]
    far: dict[int, NDArray[np.bool_]]
    sizes: dict[int, Array]


def begin(
    data: Prepared,
    sensor: Sensor,
    declared: tuple[str, ...],
    strong: tuple[str, ...] = (),
    impossible: tuple[str, ...] = (),
    benches: Sequence[BenchAccuracy] = (),
    fallen: Fallen = frozenset(),
) -> Begun:
    """The declared fit taken off every channel, its noise judged, all candidates whitened by it."""
    table = data.table
    readings = table.gyro if sensor == "gyro" else table.acc
    assert readings is not None  # the caller asks for sensors that are there
    conditions = table.conditions()
    alive = [a for a in range(3) if np.ptp(readings[:, a]) > 0]  # a dead channel has no noise to judge by
    free = data.attitudes()[0] if sensor == "accelerometer" else None
    whole = [channel(sensor, a, conditions, readings[:, a], declared, strong, free) for a in alive]
    strays = strays_of(conditions, data.starts)
    mine = tuple(with_read_temperature(c, strays, data.starts) for c in whole)
    library = library_blocks(mine, table, (*plain_names(declared, sensor), *impossible), sensor)
    library += [b for b in reference_blocks(mine, table, sensor, benches) if b.name not in impossible]
    library = [b for b in library if fallen.isdisjoint((b.name, a) for a in b.columns)]
    blocks = [*library, *generic_blocks(mine, table, sensor)]
    triad, far, sizes = _readings(data, mine, blocks)
    cleared = _cleared(triad, blocks, _budgets(data, sensor))
    state = {axis: _whitened(r, cleared[axis]) for r in triad for axis in [r.channel.axis]}
    cuts = segments(state, data.starts)
    return Begun(mine, len(library), pool_of(state, blocks, cuts, cleared), cuts, far, sizes)


def _readings(
    data: Prepared, channels: Sequence[Channel], blocks: Sequence[Block]
) -> tuple[list[Readings], dict[int, NDArray[np.bool_]], dict[int, Array]]:
    """What the noise is judged from; axis -> (n,) rows that were left out, and (n,) sigma."""
    nothing = np.empty((len(data.table), 0))
    cells = cells_of(data.table.conditions())
    plains, triad, far, sizes = list[Readings](), list[Readings](), {}, {}
    for c in channels:
        full, hidden = of_the_full_model(blocks, c.axis, len(c.r), len(data.starts))
        few = np.column_stack([nothing, *coarse(blocks, c.axis)])
        draws = scale_scatter(data.unit, c), drawn(data.unit, c)
        plain = plain_readings(c, data.starts, data.table.duration, np.ones(len(c.r)))
        off = far_rows(plain, few, cells, *draws)
        far[c.axis], sizes[c.axis] = off.rows, off.size
        plain = without_far(plain, full, off.rows)
        if not full:  # a slope at each node would take all that tells the spread of few power-ons
            plain = replace(plain, moves=moving(c, channel_noise(_beside_the_strong(plain, blocks))))
        plain, whole = as_shown(plain, hidden, data.table.time_on, _budgets(data, c.sensor))
        plains.append(plain)
        triad.append(whole)
    return borne_by_triad(alike(plains), alike(triad)), far, sizes


def _beside_the_strong(plain: Readings, blocks: Sequence[Block]) -> Readings:
    """The readings beside what was found strong already, which is no noise that would hide a slope.

    A nonlinearity of 3 % hid those of a scale factor of 0.1 %/K, and the chamber's straying went for a scale
    factor that differs from power-on to power-on, by twice its budget.
    """
    c = plain.channel
    strong = [b.columns[c.axis] for b in blocks if b.name in c.found and c.axis in b.columns]
    return replace(plain, blocks=(*plain.blocks, *strong)) if strong else plain


def _budgets(data: Prepared, sensor: Sensor) -> Mapping[str, ErrorBudget]:
    return {} if data.unit is None else getattr(data.unit, sensor)


def _cleared(
    triad: Sequence[Readings], blocks: Sequence[Block], budgets: Mapping[str, ErrorBudget]
) -> dict[int, Cleared]:
    """Axis -> every column of its blocks, whitened by what the triad says of the noise."""
    found = {}
    for r, noise in zip(triad, triad_noise(triad), strict=True):
        axis = r.channel.axis
        c, known = as_budgeted_at_rest(r.channel, with_stated(noise, budgets), budgets)
        found[axis] = cleared(c, known, [b.columns[axis] for b in blocks if axis in b.columns])
    return found


def _whitened(r: Readings, all_columns: Cleared) -> Whitened:
    """A channel, beside the candidates under which its noise was judged."""
    return whitened(all_columns, all_columns.of(r.blocks))


def _unname_what_is_left(found: Found, question: Question, starts: NDArray[np.int64]) -> None:
    """A name that explained a channel better than any variable beside one that is refused may not alone.

    A walk over the days was a step and a hysteresis; the power-ons refuse the latter, and the step stood.
    """
    tried = found.tried(found.library)
    unname_where_unnamed_wins(tried, question)
    new = [u for u in tried.unknown if u not in found.unknown]
    if not new or any(vetoed(tried, u, starts) for u in new):
        return
    for u in new:
        names = [b for b in found.library if b not in tried.library and found.axes(b) == found.axes(u)]
        found.p[u] = min(found.p[b] for b in names)
    found.library, found.unknown = tried.library, tried.unknown


def _unname_the_undetermined(
    found: Found,
    channels: Sequence[Channel],
    cuts: NDArray[np.int64],
    shown: Mapping[str, tuple[Range, ...]],
) -> None:
    """An exponential of any time constant, from the shortest seen to the longest, is no warm-up.

    Nor is that an effect of which the data determine no coefficient: what rounding leaves of its columns,
    or a table whose end no record reaches. That something follows its variable may be sure all the same.
    """
    sizes = estimates(found.pool, found.all)
    told = {e.block for e in sizes if np.isfinite(e.half)}
    for b in [b for b in found.library if b not in told]:
        found.library.remove(b)
        _variable_instead(found, b, DECISIVE)
    for b in [b for b in found.library if found.pool.blocks[b].nonlinear]:
        intervals = _shape(found, b, channels, cuts, shown).parameters
        ranges_of = shown[found.pool.blocks[b].name]
        if not any(i.tells(r) for i, r in zip(intervals, ranges_of, strict=True)):
            found.library.remove(b)
            _variable_instead(found, b)


def _variable_instead(found: Found, b: int, least: float = -np.inf) -> None:
    """The best bins over an effect's variable in its place, of which the criterion is `least` or more."""
    pool, here = found.pool, found.without()
    same = on(pool, range(len(pool.blocks)), found.axes(b))
    scores = {g: score(here, [g]).criterion for g in same if pool.blocks[g].name == along(pool, b)}
    best = max((g for g in scores if pool.blocks[g].generic), key=lambda g: scores[g], default=None)
    if best is not None and scores[best] >= least and not set(scores) & set(found.unknown):
        found.unknown.append(best)
        found.p[best] = found.p[b]


def _shape(
    found: Found,
    b: int,
    channels: Sequence[Channel],
    cuts: NDArray[np.int64],
    shown: Mapping[str, tuple[Range, ...]],
) -> Shape:
    return shape_of(found, b, channels, cuts, shown.get(found.pool.blocks[b].name, ()))


# ---------------------------------------------------------------- segments that change sign together


def segments(state: dict[int, Whitened], starts: NDArray[np.int64]) -> NDArray[np.int64]:
    """First rows of what changes sign together: power-ons; where they are few, blocks within them.

    Blocks are five times as long as the remainder stays correlated, so that noise keeps its colour.
    """
    if len(starts) >= SIGNS:
        return starts
    n = len(next(iter(state.values())).remainder)
    lag = max(_correlation_rows(w.remainder) for w in state.values())
    length = int(min(max(5 * lag, n // SEGMENTS, 1), max(1, n // 12)))
    sizes = np.diff(np.append(starts, n))
    return np.concatenate([np.arange(s, s + size, length) for s, size in zip(starts, sizes, strict=True)])


def _correlation_rows(remainder: Array) -> int:
    """Rows after which the autocorrelation has fallen below a fifth."""
    n = len(remainder)
    power = float(remainder @ remainder)
    if n < 20 or power == 0.0:
        return 1
    for lag in range(1, n // 10):
        if float(remainder[:-lag] @ remainder[lag:]) < 0.2 * power:
            return lag
    return n // 10
