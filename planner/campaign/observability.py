"""What a campaign leaves unobservable: all its tests, temperatures and repeats together.

With A the columns of all records, the noise made white, and the prior's pseudo-records below them, a
coefficient is observable when no combination of columns that it takes part in vanishes, and when its
standard error leaves it better known than it is without a calibration:

    1.96 √(M⁻¹)_ii <= the error's size in the spec,   M = AᵀA

What few power-ons draw is no want of records: by information, where the promise counts it, the size of an
error is taken with what two sigmas of its run to run add.

Two faces of a cube at every temperature separate bias and scale factor; one face at six temperatures and six
faces at the seventh do so at the seventh only, though each test alone looks as if it did.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner import catalog
from planner.campaign.model import DEGENERATE, Campaign, ChannelCampaign
from planner.campaign.noise import budget_of
from planner.campaign.out_of_range import out_of_range
from planner.measurement import Carried, ChannelModel, Column, sensed
from planner.nouns.array import Array
from planner.nouns.sensor import ErrorName
from planner.protocols import SENSORS, Sensor
from planner.solvers.distributions import TWO_SIDED
from planner.solvers.least_squares import factors

PARTNER = 0.1  # share of the strongest coefficient in a combination from which one takes part in it
BY_TEMPERATURE = frozenset(("temperature_degc",))
HIDDEN = 100.0  # times its uncalibrated size, to which an error that is hidden altogether shows by itself
NOTICEABLE = 0.01  # of the largest input, the order of a scale factor that nobody calibrated


@dataclass(frozen=True)
class Unobservable:
    """One term of an error on one channel that a campaign leaves unobservable.

    nodes_degc: the nodes of its table where that is so, none without a table; everywhere: it is so at all of
        them
    partners: the other errors of the combinations that hide it most; none when no record shows it at all
    """

    error: ErrorName
    term: str
    channel: int
    nodes_degc: tuple[float, ...]
    everywhere: bool
    partners: tuple[ErrorName, ...]


def unobservable(
    campaign: Campaign,
    asked: Collection[ErrorName],
    without: Collection[ErrorName] = (),
    beyond: float = 1.0,
) -> tuple[Unobservable, ...]:
    """Every term of the errors `asked` that the campaign does not separate from all that is declared.

    without: errors that are left out of the declared model
    beyond: times what an error is known to without a calibration, from which on it counts as told by nothing
    """
    carriers = {_carrier(error) for error in asked}
    return tuple(
        u
        for rows in _every_rows(campaign, without)
        for u in _unobservable(rows, carriers, campaign, beyond)
        if rows.columns
    )


def _carrier(error: ErrorName) -> ErrorName:
    """The error in whose temperature table another one stands; else the error itself."""
    effect = catalog.effects()[error.effect]
    of = effect.temperature_of if effect.tabled else None
    return error if of is None else ErrorName.of(error.sensor, of)


# ---------------------------------------------------------------- rows of channels that go together


@dataclass(frozen=True)
class _Place:
    """One coefficient: its channel (of a shared one the first) and its column."""

    channel: int
    error: ErrorName
    column: Column


@dataclass(frozen=True)
class _Rows:
    """White rows (n, P) of one channel, or of the three that share coefficients. columns: the first ones."""

    channels: tuple[ChannelCampaign, ...]
    columns: tuple[_Place, ...]
    X: Array


def _every_rows(campaign: Campaign, without: Collection[ErrorName]) -> Iterator[_Rows]:
    for sensor in SENSORS:
        mine = [
            replace(channel, model=model)
            for (s, _), channel in campaign.channels.items()
            if s == sensor and (model := _asked_model(channel.model, without)).carried
        ]
        if any(c.model.shares(column) for c in mine for column in _linear(c.model)):
            yield _stacked(sensor, mine)
        else:
            yield from (_stacked(sensor, [channel]) for channel in mine)


def _asked_model(model: ChannelModel, without: Collection[ErrorName]) -> ChannelModel:
    """The model without some errors, and without what its own tables take up.

    At the nodes a function of temperature and the table that it is added to are one and the same: nothing
    tells them apart, and nothing is lost, since the table takes it up.
    """
    tables = {c.effect.group for c in model.carried if c.nodes is not None}
    driving = {"bias": BY_TEMPERATURE, "scale_factor": BY_TEMPERATURE | {"rate", "specific_force"}}

    def stays(c: Carried) -> bool:
        taken_up = (
            c.nodes is None
            and c.effect.group in tables
            and "temperature_degc" in c.effect.needs
            and c.effect.needs <= driving.get(c.effect.group, frozenset())
        )
        return not taken_up and ErrorName.of(model.sensor, c.effect.name) not in without

    return replace(model, carried=tuple(c for c in model.carried if stays(c)))


def _linear(model: ChannelModel) -> tuple[Column, ...]:
    return model.columns()[: model.linear]


def _stacked(sensor: Sensor, channels: Sequence[ChannelCampaign]) -> _Rows:
    """Rows of the channels one below the other; a coefficient that they share has one column."""
    places: dict[tuple[int, Column], int] = {}
    own = []
    for c in channels:
        keys = [(-1 if c.model.shares(x) else c.model.channel, x) for x in _linear(c.model)]
        own.append([places.setdefault(key, len(places)) for key in keys])
    blocks = [c.rows() for c in channels]
    extra = [b.shape[1] - len(o) for b, o in zip(blocks, own, strict=True)]
    X = np.zeros((sum(map(len, blocks)), len(places) + sum(extra)))
    row, prior = 0, len(places)
    for block, mine, q in zip(blocks, own, extra, strict=True):
        X[row : row + len(block), [*mine, *range(prior, prior + q)]] = block
        row, prior = row + len(block), prior + q
    first = channels[0].model.channel if channels else 0
    columns = tuple(_Place(first if at < 0 else at, ErrorName.of(sensor, x.effect), x) for at, x in places)
    return _Rows(tuple(channels), columns, X)


# ---------------------------------------------------------------- what they leave unobservable


def _unobservable(
    rows: _Rows, asked: Collection[ErrorName], campaign: Campaign, beyond: float
) -> Iterator[Unobservable]:
    found = factors(rows.X, DEGENERATE)
    sigma = np.sqrt(np.sum(found.to_coefficients**2, axis=1))
    reach = TWO_SIDED * np.where(found.undetermined(), np.inf, sigma)
    useless: dict[tuple[int, ErrorName, str], list[int]] = {}
    for i, place in enumerate(rows.columns):
        needed = place.error in asked and place.column.term not in out_of_range(campaign.spec, place.error)
        if needed and reach[i] > beyond * _worth(rows, place, campaign):
            useless.setdefault((place.channel, place.error, place.column.term), []).append(i)
    for (channel, error, term), indices in useless.items():
        shown = [i for i in indices if _shows(rows, i, campaign, bool(np.isinf(reach[i])))]
        hidden = (_partners(rows, i) for i in shown)
        partners = dict.fromkeys(e for errors in hidden for e in errors if e != error)
        nodes = tuple(n for i in indices if not np.isnan(n := rows.columns[i].column.node_degc))
        every = sum((p.channel, p.error, p.column.term) == (channel, error, term) for p in rows.columns)
        yield Unobservable(error, term, channel, nodes, len(indices) == every, tuple(partners))


def _shows(rows: _Rows, i: int, campaign: Campaign, hidden: bool) -> bool:
    """Whether the records show column i, if it were alone: then others hide it."""
    size = float(np.linalg.norm(rows.X[:, i]))
    worth = _worth(rows, rows.columns[i], campaign) * (HIDDEN if hidden else 1.0)
    return size > 0.0 and size * worth >= TWO_SIDED


def _worth(rows: _Rows, place: _Place, campaign: Campaign) -> float:
    """How well an error is known without a calibration, SI; a hundredth of the input if nobody says."""
    budget = budget_of(campaign.spec.unit, place.error)
    if budget is not None and budget.whole_variation > 0.0:
        published = campaign.spec.planned_by == "published"
        return float(
            np.hypot(budget.whole_variation, 0.0 if published else TWO_SIDED * budget.run_to_run_largest)
        )
    model = next(c.model for c in rows.channels if c.model.channel == place.channel)
    effect = catalog.effects()[place.error.effect]
    if effect.group != "scale_factor":
        return float(np.finfo(np.float64).max)
    k = [t.name for t in effect.terms(model.sensor)].index(place.column.term)
    output = effect.regressors(model.sensor, model.conditions)[:, model.channel, k]
    most = float(np.abs(output).max(initial=0.0))
    largest = float(np.abs(sensed(model.sensor, model.conditions)[:, model.channel]).max(initial=0.0))
    return NOTICEABLE * largest / most if most > 0.0 else float(np.finfo(np.float64).max)


def _partners(rows: _Rows, i: int) -> tuple[ErrorName, ...]:
    """The errors of the combination that hides column i most."""
    size = np.linalg.norm(rows.X, axis=0)
    r = np.linalg.qr(rows.X / np.where(size > 0, size, 1.0), mode="r")
    _, s, vt = np.linalg.svd(r, full_matrices=True)
    s = np.concatenate([s, np.zeros(len(vt) - len(s))])
    hidden = vt[int(np.argmax(np.abs(vt[:, i]) / np.maximum(s, 1e-15 * s[0])))]
    hidden = hidden[: len(rows.columns)]
    strong = np.flatnonzero(np.abs(hidden) > PARTNER * np.abs(hidden).max()).tolist()
    return tuple(dict.fromkeys(rows.columns[j].error for j in strong))
