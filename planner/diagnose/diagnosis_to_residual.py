"""What was found → the residual of every channel before and after, on rows that the fit has not seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.calibrate.dwells_to_fit import readings_of
from planner.campaign.channel_model import channel_model
from planner.diagnose.channels.channel import Channel, channel, columns
from planner.diagnose.channels.prepared import referenced
from planner.diagnose.channels.unseen_runs import Folds, block_folds, cells_of, folds_of
from planner.diagnose.mean_squares import about_means, mean_square, noise_floor, squares, within
from planner.diagnose.noise.channel_noise import (
    ChannelNoise,
    Readings,
    channel_noise,
    plain_readings,
)
from planner.diagnose.noise.components import LEVEL
from planner.diagnose.noise.far_rows import drawn, far_rows, scale_scatter, without_far
from planner.diagnose.noise.whitened import moving
from planner.diagnose.search.shown_noise import with_leans
from planner.diagnose.weighed_fit import Shapes, Spreads, Strays, WeighedFit, weighed_fit
from planner.dwells.table_rows import by_run, rows_of
from planner.measurement import AXES
from planner.nouns.array import Array
from planner.nouns.diagnosis import FoundEffect, ResidualChange, UnitDiagnosis
from planner.nouns.dwell_table import DwellTable
from planner.protocols import SENSORS, Sensor
from planner.solvers.block_covariance import BlockCovariance
from planner.solvers.least_squares import factors
from planner.solvers.one_thread import one_thread
from planner.solvers.random_effects import Covariance, RandomEffects, covariance
from planner.spec.model import Spec

UNITS = {"gyro": "deg/s", "accelerometer": "g"}
MOST_ROWS = 20_000  # six channels with their designs then take 100 MB, and figures are sure to 1 %
_MUCH_LESS = 6.0  # times the variance: a held-out branch of three takes about half of the information away
SEVERAL = 2  # power-ons, of which levels have a variance: three without one left 18 sigma of clean channels
MOST_UNSURE = 4.0  # variance of a prediction over that of the record, above which it judges no model
ENOUGH = 0.5  # of the rows that should be held out, which must be predicted for the figure to stand for them
BY_THE_LOUDEST = (
    "; the loudest records alone raise the plain figure: weighed by the noise of each it falls, "
    "{:.3g} to {:.3g} sigma, of which 1 is noise alone"
)
SEES_LITTLE = "; the rows held out see {:.2g} of the {:.2g} sigma of what was found, and hardly speak of it"
_UNSEEN = 1e-6  # of a row's length that may lie outside what the other rows determine


@dataclass(frozen=True)
class ChannelFits:
    """One channel under the declared model, and with what was found on it; one and the same without.

    likely: (K,) its variances as REML found them: what is weighed by has none that is zero
    """

    sensor: Sensor
    channel: str
    y: Array
    before: WeighedFit
    after: WeighedFit
    found: tuple[FoundEffect, ...]
    likely: Array


@dataclass(frozen=True)
class UnitFits:
    """Every channel that has a reference, on the table with its rows run by run.

    share: of the rows that were given; less than 1 where there are too many for matrices
    """

    table: DwellTable
    starts: NDArray[np.int64]
    channels: tuple[ChannelFits, ...]
    share: float = 1.0


def unit_fits(table: DwellTable, spec: Spec, found: UnitDiagnosis) -> UnitFits:
    """Fit every channel of one unit's table under the declared model, and with what was found.

    Parameters (τ, the time of a step) are held at the values that were found. References that the table lacks
    are those of the search. Variances are those that REML finds once, beside what is declared and found, and
    serve both models.
    """
    full, sensors, *_ = referenced(table if found.kept is None else rows_of(table, found.kept))
    ordered, starts = by_run(_fewer_runs(full))
    channels = tuple(
        fits
        for sensor in SENSORS
        if sensor in sensors
        for fits in _sensor_fits(ordered, starts, sensor, spec, found)
    )
    return UnitFits(ordered, starts, channels, len(ordered) / len(table))


def _fewer_runs(table: DwellTable) -> DwellTable:
    """Every n-th power-on (or row, where one of them is too long) of a table too large for matrices."""
    if len(table) <= MOST_ROWS:
        return table
    step = -(-len(table) // MOST_ROWS)
    runs = np.unique(table.run)
    if len(runs) >= 20 * step:
        return rows_of(table, np.isin(table.run, runs[::step]))
    return rows_of(table, np.arange(0, len(table), step))


def _sensor_fits(
    table: DwellTable, starts: NDArray[np.int64], sensor: Sensor, spec: Spec, found: UnitDiagnosis
) -> list[ChannelFits]:
    """The three channels, with the variances that REML finds beside all that is declared and found."""
    readings = readings_of(table, sensor)
    assert readings is not None  # asked by the caller
    fits = []
    with one_thread():
        for axis in range(3):
            here = _found_on(found, sensor, axis)
            judged = _readings(table, starts, sensor, axis, readings[:, axis], spec, here)
            fits.append(_channel_fits(judged, channel_noise(judged), spec, here))
    return fits


def _found_on(found: UnitDiagnosis, sensor: Sensor, axis: int) -> tuple[FoundEffect, ...]:
    return tuple(
        e for e in found.fitted if e.sensor == sensor and any(c[-1] == AXES[axis] for c in e.channels)
    )


def _readings(
    table: DwellTable,
    starts: NDArray[np.int64],
    sensor: Sensor,
    axis: int,
    y: Array,
    spec: Spec,
    found: Sequence[FoundEffect],
) -> Readings:
    """What the noise of a channel is judged from; what was found are columns that the rows may follow.

    And leans that power-ons draw, as in the search: of 0.004 deg at 50 g a cross-coupling foresees nothing.
    """
    c = channel(sensor, axis, table.conditions(), y, tuple(spec.effects))
    blocks = tuple(columns(c, e.effect, e.nonlinear) for e in found)
    candidates = np.column_stack([np.empty((len(y), 0)), *blocks])
    cells, draws = cells_of(table.conditions()), (scale_scatter(spec.unit, c), drawn(spec.unit, c))
    plain = plain_readings(c, starts, table.duration, np.ones(len(y)))
    kept = without_far(plain, blocks, far_rows(plain, candidates, cells, *draws).rows)
    kept = kept if len(starts) >= kept.least_runs else replace(kept, least_runs=SEVERAL)
    return with_leans(kept, getattr(spec.unit, sensor)) if found else kept


def _channel_fits(
    r: Readings, noise: ChannelNoise, spec: Spec, found: tuple[FoundEffect, ...]
) -> ChannelFits:
    c, far = r.channel, r.weights < 1.0
    v, spreads, strays = _without_untold_draws(noise), _spreads(noise), _strays(c, noise)
    before = weighed_fit(c.model, c.y, v, spreads, far, strays=strays)
    after = before
    if found:
        wider = (*spec.effects, *(e.effect for e in found))
        model = channel_model(c.sensor, c.axis, c.model.conditions, wider)
        after = weighed_fit(model, c.y, v, spreads, far, _held(found), strays)
    likely = np.where(noise.variances.free, noise.variances.theta, 0.0)
    return ChannelFits(c.sensor, c.name, c.y, before, after, found, likely)


def _strays(c: Channel, noise: ChannelNoise) -> Strays:
    """The slopes of tables at their nodes that are felt beside the noise, as in the search.

    A scale factor of 0.1 %/K whose chamber strays by 0.1 K reads 0.05 deg/s at 500: unseen power-ons of a
    consumer unit had 0.13 deg/s within runs where 0.06 were noise, and "something without a name".
    """
    felt = moving(c, noise) & np.isfinite(c.most)
    return Strays(c.J[:, felt], c.most[felt])


def _without_untold_draws(noise: ChannelNoise) -> Covariance | BlockCovariance:
    """The covariance of the rows with draws, where REML finds none, no larger than what is left of the rows.

    The search gives them room. Of power-ons each at a temperature of its own nothing tells what their scale
    factors draw, 1e-4 of the input; the fit left that of turns, 7 sigma of channels that lack nothing.
    """
    effects, sample, theta = noise.covariance.effects, noise.sample, noise.covariance.theta.copy()
    a, b = len(effects.diagonals), len(effects.slopes)
    most = np.mean(sample.left**2) / np.maximum(np.mean(effects.slopes**2, axis=1), 1e-300)
    draws = theta[a : a + b]
    theta[a : a + b] = np.where(noise.variances.free[a : a + b], draws, np.minimum(draws, most))
    return covariance(effects, theta)


def _spreads(noise: ChannelNoise) -> Spreads:
    theta = dict(zip(noise.components, noise.variances.theta, strict=True))
    return Spreads(
        white=float(np.sqrt(theta["white"] + theta.get("constant", 0.0))),
        run=float(np.sqrt(theta.get(LEVEL, 0.0))),
        rate=float(np.sqrt(theta.get("rate_noise", 0.0))),
    )


def _held(found: Sequence[FoundEffect]) -> Shapes:
    return {e.effect: e.nonlinear for e in found if e.nonlinear}


# ---------------------------------------------------------------- held out


def residual_changes(fits: UnitFits) -> tuple[ResidualChange, ...]:
    """Before and after of every channel, on rows of power-ons (or blocks) that were held out."""
    conditions = fits.table.conditions()
    folds = folds_of(conditions, fits.starts)
    cells = cells_of(conditions)
    record = float(np.mean(fits.table.duration))
    if fits.share < 1.0:
        folds = replace(folds, how=f"{folds.how}; on {100 * fits.share:.0f} % of the rows, evenly taken")
    return tuple(_change(channel, folds, fits.starts, cells, record) for channel in fits.channels)


def _change(
    fits: ChannelFits, folds: Folds, starts: NDArray[np.int64], cells: NDArray[np.int64], record: float
) -> ResidualChange:
    if fits.found and folds.split == "branches" and not _told_by_others(fits, folds):
        folds = block_folds(len(fits.y), starts, "the other branches cannot tell what was found")
    left, unsure = {}, {}
    left["before"], unsure["before"] = _unseen_residual(fits.before, folds)
    left["after"], unsure["after"] = left["before"], unsure["before"]
    if fits.after is not fits.before:
        left["after"], unsure["after"] = _unseen_residual(fits.after, folds)
    far = fits.after.far
    rows = np.isfinite(left["before"]) & np.isfinite(left["after"]) & ~far
    held_out = bool(rows.sum() >= max(2.0, ENOUGH * (~far & (folds.fold >= 0)).sum()))
    if not held_out:
        left, rows = {"before": fits.before.residual, "after": fits.after.residual}, ~far
        unsure = {key: np.zeros(len(far)) for key in left}
    group = folds.group
    before, after = (mean_square(left[key][rows], group[rows]) for key in ("before", "after"))
    expected = _expected_within(fits, group)
    sigma = {key: np.sqrt((expected + unsure[key])[rows]) for key in unsure}
    moved = about_means((left["after"] - left["before"])[rows, None], group[rows])[:, 0]
    floor, floor_within = noise_floor(fits.after.residual[rows], group[rows], cells[rows])
    weighed = _weighed(fits.after, left, rows)
    change = ResidualChange(
        channel=fits.channel,
        unit=UNITS[fits.sensor],
        before=before[0],
        before_low=before[1],
        before_high=before[2],
        after=after[0],
        after_low=after[1],
        after_high=after[2],
        within_before=within(left["before"][rows], group[rows]),
        within_after=within(left["after"][rows], group[rows]),
        noise_floor=floor,
        rows=int(rows.sum()),
        runs=len(np.unique(group[rows])),
        held_out=held_out,
        how=_how(folds, fits, held_out, int(far.sum())),
        noise_floor_within=floor_within,
        sigma_before=within(left["before"][rows], group[rows], sigma["before"]),
        sigma_after=within(left["after"][rows], group[rows], sigma["after"]),
        white=fits.after.spreads.white,
        stray=fits.after.spreads.rate,
        record=record,
        split=folds.split if held_out else "none",
        foreseen=float(np.linalg.norm(moved / np.sqrt(expected[rows]))),
        falls=squares(left["before"][rows], group[rows], np.sqrt(expected[rows]))
        - squares(left["after"][rows], group[rows], np.sqrt(expected[rows])),
        weighed_before=weighed["before"],
        weighed_after=weighed["after"],
    )
    return explained(change, float(np.sqrt(sum(e.strength**2 for e in fits.found))))


def explained(r: ResidualChange, strength: float = 0.0) -> ResidualChange:
    """With words beside a plain figure that rises where the one by which names are judged falls.

    Or beside one that rises where its rows see hardly any of what was found, so many sigma by all rows.
    """
    more = BY_THE_LOUDEST.format(r.weighed_before, r.weighed_after) if r.rises_by_the_loudest else ""
    if r.held_out and r.after >= r.before and not r.weighed_falls and r.sees_little(strength):
        more += SEES_LITTLE.format(r.foreseen, strength)
    return replace(r, how=r.how + more)


def _weighed(fit: WeighedFit, left: Mapping[str, Array], rows: NDArray[np.bool_]) -> dict[str, float]:
    """Root mean square of some rows (n,) in units of the noise model: √(rᵀ V⁻¹ r / rows)."""
    white = _covariance_of(fit, rows).whiten(np.column_stack([left[key][rows] for key in left]))
    return dict(zip(left, np.sqrt(np.mean(white**2, axis=0)).tolist(), strict=True))


def _told_by_others(fits: ChannelFits, folds: Folds) -> bool:
    """Whether the rows of the other folds tell the found coefficients nearly as well as all rows do."""
    names = {e.effect for e in fits.found}
    mine = [i for i, c in enumerate(fits.after.model.columns()) if c.effect in names and not c.parameter]
    whole = _variances(fits.after, np.ones(len(fits.y), dtype=bool), mine)
    return all(
        np.all(_variances(fits.after, folds.fold != k, mine) < _MUCH_LESS * whole)
        for k in range(int(folds.fold.max(initial=-1)) + 1)
    )


def _variances(fit: WeighedFit, seen: NDArray[np.bool_], columns: list[int]) -> Array:
    """(k,) relative variances of some coefficients from some rows; infinite where they are not determined."""
    found = factors(fit.J[seen] / np.sqrt(fit.v.diagonal[seen])[:, None], tolerance=1e-9)
    variance = np.sum(found.to_coefficients**2, axis=1)
    return np.where(found.undetermined(), np.inf, variance)[columns]


def _how(folds: Folds, fits: ChannelFits, held_out: bool, far: int) -> str:
    how = (
        folds.how
        if held_out
        else "held-out figures cannot be had: the rows of the other folds do not determine the model; "
        "these are of the rows that were fitted"
    )
    if any(e.nonlinear for e in fits.found):
        how += "; nonlinear parameters held at the values that all rows gave"
    return how + (f"; {far} rows far off the others are left out" if far else "")


def _unseen_residual(fit: WeighedFit, folds: Folds) -> tuple[Array, Array]:
    """(n,) residual of each row under the coefficients of the other folds; (n,) their variance within a run.

    One step of Gauss-Newton from the fit of all rows, with its variances. NaN where the other folds cannot
    tell: a direction that they do not see, or a prediction that is less sure than a record itself.
    """
    left, within = np.full(len(fit.residual), np.nan), np.zeros(len(fit.residual))
    noise, design = fit.v.diagonal + fit.spreads.run**2, fit.design
    for k in range(int(folds.fold.max(initial=-1)) + 1):
        out = folds.fold == k
        if out.all() or not out.any():
            continue
        white = _whitened(fit, ~out)
        known = factors(white[:, :-1], tolerance=1e-9)
        step = known.to_coefficients @ (known.basis.T @ white[:, -1])
        mine = design[out]
        inside = _determined(mine, known.scale, known.null_space)
        predicted = mine @ known.to_coefficients
        inside &= np.sum(predicted**2, axis=1) <= MOST_UNSURE * noise[out]
        within[out] = np.sum(about_means(predicted, folds.group[out]) ** 2, axis=1)
        left[out] = np.where(inside, fit.residual[out] - mine @ step, np.nan)
    return left, within


def _expected_within(fits: ChannelFits, group: NDArray[np.int64]) -> Array:
    """(n,) variance about the mean of a power-on: of the row, and of what its input drives of a draw.

    A spread of which REML finds nothing is none here: five power-ons give it room for twice the noise.
    """
    effects = fits.after.v.effects
    a = len(effects.diagonals)
    drawn = about_means(effects.slopes.T, group) ** 2 @ fits.likely[a:] if len(effects.slopes) else 0.0
    return np.asarray(fits.likely[:a] @ effects.diagonals + drawn)


def _whitened(fit: WeighedFit, seen: NDArray[np.bool_]) -> Array:
    """V^(−1/2) [J, r] of the rows seen, of every power-on those that are left of it; and of the slopes."""
    rows = _covariance_of(fit, seen).whiten(np.column_stack([fit.design, fit.residual])[seen])
    return np.vstack([rows, fit.records_of_slopes])


def _covariance_of(fit: WeighedFit, seen: NDArray[np.bool_]) -> Covariance | BlockCovariance:
    """Covariance of the rows seen (n,), run by run."""
    e = fit.v.effects
    sizes = np.add.reduceat(seen.astype(np.int64), e.starts)
    sizes = sizes[sizes > 0]
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64)
    return covariance(RandomEffects(starts, e.diagonals[:, seen], e.slopes[:, seen]), fit.v.theta)


def _determined(J: Array, scale: Array, null_space: Array) -> NDArray[np.bool_]:
    """(m,) rows of J that lie in what the other rows determine."""
    scaled = J / scale
    outside = np.linalg.norm(scaled @ null_space, axis=1) if null_space.shape[1] else np.zeros(len(J))
    return np.asarray(outside <= _UNSEEN * np.maximum(np.linalg.norm(scaled, axis=1), 1e-300))
