"""What `world` drew for a unit, asked again: the coefficients that an estimator should find."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planner.calibrate.fit_to_calibration import coefficients_of
from planner.campaign.channel_model import channel_model
from planner.campaign.estimate import Estimate, estimate
from planner.campaign.power_ons import of_table
from planner.dwells.table_rows import by_run
from planner.nouns.calibration import Coefficient
from planner.nouns.dwell_table import DwellTable
from planner.protocols import Sensor
from planner.spec.load import load_spec
from planner.spec.model import Spec
from tests.calibrate import world
from tests.specs import SHIPPED

EFFECTS = ("bias", "bias_temperature", "scale_factor", "scale_factor_temperature", "misalignment")
# two temperatures, four power-ons at rest and two of turns about every axis at each
LAYOUT = world.Layout(
    temperatures=(0.0, 40.0),
    static_repeats=4,
    later=(),
    ramps=False,
    rate_repeats=2,
    rate_temperatures=(0.0, 40.0),
    centrifuge=False,
)
QUIET_RUNS = world.Noise(gyro_run=0.0, acc_run=0.0, scale_run=0.0)


def any_spec() -> Spec:
    return load_spec(SHIPPED / "close_the_loop.yaml").spec


def spec_without_walk() -> Spec:
    """The units of `world` do not change over the days: neither does its spec say so."""
    spec = any_spec()
    still = {
        sensor: {name: budget.model_copy(update={"storage": None}) for name, budget in budgets.items()}
        for sensor, budgets in (("gyro", spec.unit.gyro), ("accelerometer", spec.unit.accelerometer))
    }
    return spec.model_copy(update={"unit": spec.unit.model_copy(update=still)})


@dataclass(frozen=True)
class WorldTruth:
    """The unit of `world.campaign(seed, …)`; SI."""

    seed: int
    sensor: Sensor

    def of(self, c: Coefficient) -> float:
        """The true value of a coefficient."""
        gyro = self.sensor == "gyro"
        rng = np.random.default_rng([self.seed, 2 if gyro else 3])
        x = np.array([(c.temperature_degc or 0.0) / 60.0])
        bias = world._curve(x, rng, 0.03 if gyro else 0.01)[0] * (np.radians(1.0) if gyro else world.G)
        scale = world._curve(x, rng, 0.002 if gyro else 1e-3)[0]
        lean = np.radians(rng.uniform(-0.3, 0.3, (3, 3)))
        i = "xyz".index(c.channel)
        name = c.error.split(".")[1]
        if name == "misalignment":
            return float(lean[i, "xyz".index(c.term[1])])
        return float({"bias": bias, "scale_factor": scale}[name][i])


def fitted(
    table: DwellTable, sensor: Sensor, channel: int, spec: Spec, effects: tuple[str, ...] = EFFECTS
) -> Estimate:
    """One channel's fit."""
    ordered, _ = by_run(table)
    readings = ordered.gyro if sensor == "gyro" else ordered.acc
    model = channel_model(sensor, channel, ordered.conditions(), effects)
    return estimate(model, readings[:, channel], of_table(ordered), spec)


def coverage(
    campaigns: int, noise: world.Noise, layout: world.Layout = LAYOUT
) -> dict[tuple[str, str], list[bool]]:
    """(error, place) -> whether its interval holds the truth, campaign by campaign; one channel of each."""
    spec = spec_without_walk()
    found: dict[tuple[str, str], list[bool]] = {}
    for seed in range(campaigns):
        sensor: Sensor = ("gyro", "accelerometer")[seed % 2]
        fit = fitted(world.campaign(seed, layout=layout, noise=noise), sensor, seed // 2 % 3, spec)
        truth = WorldTruth(seed, sensor)
        for number, c in enumerate(coefficients_of(fit, spec)):
            assert c.status != "undetermined"
            name = c.error.split(".")[1]
            place = "" if c.temperature_degc is None else ("cold", "hot")[c.temperature_degc > 20.0]
            key = (name, place or str(number))
            found.setdefault(key, []).append(bool(c.low <= truth.of(c) <= c.high))
    return found
