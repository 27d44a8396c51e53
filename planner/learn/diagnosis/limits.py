"""Upper limits of the effects that were looked for in vain, and why others could not be looked for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planner import catalog
from planner.campaign.channel_model import EXCITING
from planner.diagnosis import NotFound, Untestable
from planner.learn.diagnosis.candidates import LEAST_DAYS, OF_THE_DAYS, lasts
from planner.learn.diagnosis.estimates import estimates
from planner.learn.diagnosis.noise import LEAST_RUNS
from planner.learn.diagnosis.pool import Pool, given
from planner.learn.diagnosis.prepared import Prepared
from planner.learn.diagnosis.sensor import SensorFound
from planner.protocols import Effect

NEEDS: Mapping[str, tuple[str, ...]] = {
    "warm_up": ("time_on_s",),
    "ageing": ("day",),
    "bias_step": ("day",),
    "bias_temperature": ("temp_degc",),
    "scale_factor_temperature": ("temp_degc",),
    "misalignment_temperature": ("temp_degc",),
    "temperature_rate": ("temp_rate_degc_min",),
}

A_COEFFICIENT = 3  # rows for each coefficient of the declared model, below which nothing more is told
IMPOSSIBLE = "what looks like it is more than the Earth turns"


def limits(
    s: SensorFound, data: Prepared, declared: tuple[str, ...]
) -> tuple[list[NotFound], list[Untestable]]:
    """Every effect of the library that exists on the sensor, is not declared and was not found."""
    pool = s.found.pool
    here = given(pool, s.found.all)
    known = {pool.blocks[b].name for b in s.found.library}
    not_found, untestable = [], []
    for name, effect in catalog.effects().items():
        if name in declared or name in known or s.sensor not in effect.sensors:
            continue
        why = IMPOSSIBLE if name in s.impossible else _missing(name, data) or _unseen(s, data, effect)
        most = 0.0 if why else _upper(here, name, effect)
        if most > 0.0 and np.isfinite(most):
            not_found.append(NotFound(name, s.sensor, most, effect.units[s.sensor]))
        else:
            untestable.append(Untestable(name, s.sensor, why or _why(name, data)))
    return not_found, untestable


def _unseen(s: SensorFound, data: Prepared, effect: Effect) -> str:
    """Why a limit would be a number without meaning: no turn drives the effect, or the rows are too few."""
    fitted = max(w.Q.shape[1] for w in s.found.pool.state.values())
    if len(data.table) < A_COEFFICIENT * fitted:
        return f"{len(data.table)} rows are too few beside the {fitted} coefficients of the declared model"
    if s.sensor == "gyro" and effect.group != "bias":
        fastest = float(np.abs(s.channels[0].model.conditions.rate).max())
        if fastest < EXCITING["gyro"]:
            return f"the gyros turn at {np.degrees(fastest):.2g} deg/s at most"
    return ""


def _upper(here: Pool, name: str, effect: Effect) -> float:
    """The largest |γ| + half-width over terms and channels that the data determine; 0 when none."""
    most = 0.0
    for b in _nearest_to_default(here, name, effect):
        for e in estimates(here, [b]):
            if np.isfinite(e.half):
                most = max(most, abs(e.value) + e.half)
    return most


def _nearest_to_default(here: Pool, name: str, effect: Effect) -> list[int]:
    mine = [i for i, b in enumerate(here.blocks) if b.name == name and not b.generic]
    if not effect.nonlinear:
        return mine
    ((parameter, default),) = effect.nonlinear.items()
    best: dict[tuple[int, ...], int] = {}
    for i in mine:
        axes = here.blocks[i].channels
        off = abs(np.log(max(here.blocks[i].nonlinear[parameter], 1e-9) / default))
        if axes not in best or off < abs(
            np.log(max(here.blocks[best[axes]].nonlinear[parameter], 1e-9) / default)
        ):
            best[axes] = i
    return list(best.values())


def _missing(name: str, data: Prepared) -> str:
    absent = [column for column in NEEDS.get(name, ()) if column in data.full.absent]
    if absent:
        return f"the table has no column {', '.join(absent)}"
    if not lasts(name, data.table):
        return f"the records span {np.ptp(data.table.day):.2g} days; {LEAST_DAYS:g} tell it from run-to-run"
    if name in OF_THE_DAYS and len(data.starts) < LEAST_RUNS:
        return f"{len(data.starts)} power-ons are fewer than the {LEAST_RUNS} that tell it from run-to-run"
    return ""


def _why(name: str, data: Prepared) -> str:
    needs = {
        "temperature_rate": ("the temperature never changes during a record", data.table.temperature_rate),
        "ageing": ("all records are of one day", data.table.day),
        "bias_step": ("all records are of one day", data.table.day),
    }
    if name in needs and np.ptp(needs[name][1]) == 0.0:
        return needs[name][0]
    if "temperature" in name and np.ptp(data.table.temperature_degc) < 1.0:
        return "all records are at one temperature"
    return "nothing in these records excites it, or the declared model takes it up whole"
