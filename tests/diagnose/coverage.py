"""What a campaign hid, beside the intervals that its diagnosis gives: the ruler of their coverage."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planner.nouns.diagnosis import FoundEffect
from planner.units import from_si
from tests.calibrate.world import Hidden, Layout, campaign, sized
from tests.diagnose.worlds import whole

LAYOUT = Layout(later=(30.0,), rate_repeats=2, centrifuge=False)
STRENGTHS = (15.0, 30.0)
AXES = "xyz"

# effect -> term -> its true value in the display unit of the effect, per unit of `Hidden.size` (world.SHAPES)
Truth = Callable[[Hidden], dict[str, float]]
EFFECTS: dict[str, Truth] = {
    "g_sensitivity": lambda h: {
        h.channel[-1] + a: h.size * d for a, d in zip(AXES, h.direction, strict=True)
    },
    "g_squared_sensitivity": lambda h: {h.channel[-1]: h.size},
    "scale_factor_nonlinearity": lambda h: {h.channel[-1]: 0.01 * h.size},  # % at 500 deg/s
    "scale_factor_asymmetry": lambda h: {h.channel[-1]: 0.01 * h.size},  # % between + and −
    "temperature_rate": lambda h: {h.channel[-1]: h.size},
    "warm_up": lambda h: {h.channel[-1]: h.size, "time_constant": h.tau_s},
    "ageing": lambda h: {h.channel[-1]: h.size},
    "bias_step": lambda h: {h.channel[-1]: h.size, "day": h.step_day},
}


@dataclass(frozen=True)
class Campaign:
    """What was put in and what the diagnosis makes of it; found: None when the effect was not named there.

    strength: whitened, as an observer who knows the noise would have it
    """

    truth: dict[str, float]
    strength: float
    found: FoundEffect | None

    @property
    def covered(self) -> dict[str, bool] | None:
        """Term -> whether its 95 % interval holds the truth; terms of all channels under one name."""
        return None if self.found is None else _inside(self.found, self.truth)


def hidden_campaign(effect: str, seed: int) -> Campaign:
    """A campaign that hides the effect on a gyro, at a strength between STRENGTHS."""
    return hidden_together([effect], seed)[0]


def hidden_together(effects: Sequence[str], seed: int) -> list[Campaign]:
    """One campaign that hides each of up to three effects on a gyro of its own; what is found of each."""
    rng = np.random.default_rng([seed, 99])
    hidden, strengths = [], []
    for k, effect in enumerate(effects):
        tau_s, strength = float(rng.uniform(200.0, 900.0)), float(rng.uniform(*STRENGTHS))
        one = Hidden(effect, f"gyro_{AXES[(seed + k) % 3]}", tau_s=tau_s, step_day=20.0)
        hidden.append(sized(one, strength, seed, LAYOUT))
        strengths.append(strength)
    found = whole(replace(campaign(seed, hidden, LAYOUT), acc=None))
    out = []
    for h, strength in zip(hidden, strengths, strict=True):
        mine = [e for e in found.effects if e.effect == h.effect and h.channel in e.channels]
        out.append(Campaign(EFFECTS[h.effect](h), strength, mine[0] if len(mine) == 1 else None))
    return out


def _inside(found: FoundEffect, truth: dict[str, float]) -> dict[str, bool]:
    inside = {}
    for t in found.terms:
        if t.name in truth:
            low, high = (x if t.parameter else from_si(x, t.unit) for x in (t.low, t.high))
            name = t.name if t.parameter else f"coefficient {t.name[1:]}".strip()
            inside[name] = bool(low <= truth[t.name] <= high)
    return inside
