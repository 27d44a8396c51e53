"""Small campaigns for the tests of the model: random conditions in power-ons, specs with chosen budgets."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from planner.campaign.model import ChannelCampaign
from planner.campaign.power_ons import PowerOns
from planner.measurement import Column
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.spec.load import load_spec
from planner.spec.model import Spec
from tests.specs import SHIPPED

EFFECTS = ("bias", "scale_factor", "misalignment", "g_sensitivity")


def power_ons(seed: int, runs: int = 9, records: int = 7, days: float = 0.0) -> PowerOns:
    """Turns about all axes and rests in all attitudes at several temperatures, gaps of some minutes."""
    rng = np.random.default_rng(seed)
    n = runs * records
    direction = rng.normal(size=(n, 3))
    force = 9.80665 * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    rate = rng.normal(size=(n, 3)) * (rng.uniform(size=(n, 1)) < 0.5)
    warm = np.repeat(rng.uniform(-40.0, 60.0, runs), records) + rng.uniform(0.0, 30.0, n)  # some ramps
    on = np.cumsum(rng.uniform(20.0, 300.0, (runs, records)), axis=1).ravel()
    day = np.repeat(np.sort(rng.uniform(0.0, days, runs)), records) if days else np.zeros(n)
    conditions = Conditions(rate, force, warm, np.zeros(n), on, day)
    return PowerOns(
        conditions,
        rng.uniform(10.0, 60.0, n),
        np.arange(runs) * records,
        np.ones(runs),
        np.full(n, "rate_table"),
    )


def spec_with(gyro: dict[str, Any], accelerometer: dict[str, Any], **more: Any) -> Spec:
    """The worked example with other budgets; noise 0.1 deg/sqrt(h) and 0.05 m/s/sqrt(h)."""
    spec = load_spec(SHIPPED / "close_the_loop.yaml").spec
    tree = {
        "noise": {"gyro": "0.1 deg/sqrt(h)", "accelerometer": "0.05 m/s/sqrt(h)"},
        "gyro": gyro,
        "accelerometer": accelerometer,
    }
    unit = type(spec.unit).model_validate(tree)
    return spec.model_copy(update={"unit": unit, "effects": EFFECTS, **more})


def drifting(storage: str = "0 deg/s") -> Spec:
    """Every kind of spread: over temperature, within the power-on with times of their own, over days."""
    return spec_with(
        {
            "bias": {
                "run_to_run": {"-40 degC": "0.004 deg/s", "60 degC": "0.001 deg/s"},
                "in_run": {"value": "0.002 deg/s", "correlation_time": "200 s"},
                "storage": storage,
            },
            "scale_factor": {
                "run_to_run": {"value": "0.02 %", "temperature_correlation": "15 K"},
                "in_run": "0.01 %",
            },
            "misalignment": {"run_to_run": "0.003 deg"},
            "g_sensitivity": {"run_to_run": "0.0003 deg/s/g", "in_run": "0.0002 deg/s/g"},
        },
        {"bias": {"run_to_run": "1 mg", "in_run": "0.5 mg"}, "scale_factor": {"run_to_run": "0.02 %"}},
    )


def counted(runs: PowerOns, counts: Array) -> PowerOns:
    """The same kinds of power-on, made as often as `counts` (g,) says."""
    return replace(runs, counts=counts)


@dataclass(frozen=True)
class Known:
    """What a campaign tells of the linear coefficients of one channel; sigma: standard errors."""

    columns: tuple[Column, ...]
    covariance: Array
    sigma: Array


def known(c: ChannelCampaign) -> Known:
    """M⁻¹ of the rows with the shared unknowns among them: these leave their part in the covariance."""
    rows, p = c.rows(), c.model.linear
    size = np.linalg.norm(rows, axis=0)
    root = np.linalg.pinv(rows / size) / size[:, None]
    covariance = (root @ root.T)[:p, :p]
    return Known(c.model.columns()[:p], covariance, c.sigma())
