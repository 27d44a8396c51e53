"""Whether what one channel lacks is its temperature's: the others then lack the same, by their own slopes.

What was found on channel c is s_c δT, where the unit was warmer by δT than its thermometer read, s = p'(T) +
κ'(T) v the slope of its curves; every other channel d is then to read s_d δT more, too:

    δT = s_c x_c / (s_c² + λ²)  or  β_c x_c,   x_c = G γ̂ what was found,   p_d = s_d δT,
    α = Σ_d p_dᵀ z_d / Σ_d p_dᵀ p_d,   one sigma of α: 1 / E,   E² = Σ_d p_dᵀ p_d

The second δT is of a name that took the place of a product: where a thermometer drifts, c lacks s_c(T) times
the day, and days alone are found. β_c is what channel c itself says of s_c x_c.

p, z in white rows clear of the declared model. One temperature has α = 1, or less where what was found has
not quite its course: x_c then strays, as an errors-in-variables regression has it (Fuller, Measurement Error
Models, 1987, 1.1). An effect of the sensor has α = 0: of 43 that followed time or temperature all were within
0.1 where E was above 10. It costs one look at six channels, and only such a name asks for it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from planner import catalog
from planner.diagnose.channels.orthogonal import clear, orthonormal
from planner.diagnose.channels.prepared import Prepared
from planner.diagnose.findings.lagging_thermometer import Seen, curves, degree_of, seen_of
from planner.diagnose.hypotheses.pool import inverse
from planner.diagnose.noise.whitened import SEEN, Whitened
from planner.diagnose.references.thermometer_offset import NAME, RECORD
from planner.diagnose.search.sensor import SensorFound
from planner.diagnose.vetoes.verdicts import LEAST_RUNS
from planner.nouns.array import Array
from planner.nouns.diagnosis import FoundEffect, ReferenceSuspect
from planner.nouns.sensor import channel_name
from planner.solvers.distributions import TWO_SIDED, chi_square_tail
from planner.temperature_table import GAP_K

COURSE = {"temperature_degc", "temperature_rate", "time_on", "day"}
AGREES = 0.4  # α from which it is one temperature; half way to nothing, and what strays lowers it
DENIED = 0.25  # α below which the others deny it
WITNESSES = 2  # a sensor that warms up does so on every channel: two of random sizes agree one time in four
SURE = 5.0  # sigma of the others together, either way
SHOWN = 3.5  # sigma of α, at which some of it is no chance
FLAT = 0.3  # λ of the root mean square slope: where a curve is flat a channel knows no temperature
STEP_K = 0.5  # on either side, for a slope
CHECK = (
    "what goes with {what} on {channels} is on the other channels as well, each by the slope of its curve "
    "over temperature: look up what the thermometer read, where it sits, and whether its log went astray"
)


@dataclass(frozen=True)
class OneTemperature:
    """share: α; sure: E, sigma at which the others would show a temperature; kelvin: δT, root mean square

    least, most: α of those that know it by themselves: each channel of the same sensor, all of the other one
    witnesses: how many these are; one alone may have an effect of its own of about that size
    """

    share: float = 0.0
    sure: float = 0.0
    kelvin: float = 0.0
    least: float = 0.0
    most: float = 0.0
    witnesses: int = 0

    @property
    def agreed(self) -> bool:
        """Whether the other channels show the same temperature, and none that knows it another one."""
        return self._more_than(SURE) and self.least >= AGREES and self.most <= 1.0 / AGREES

    @property
    def shared(self) -> bool:
        """Whether they show a part of it that is no chance, too little or too faint to agree on."""
        return self._more_than(SHOWN) and self.least > DENIED

    def _more_than(self, sigma: float) -> bool:
        return self.share * self.sure > sigma and self.witnesses >= WITNESSES

    @property
    def denied(self) -> bool:
        """Whether they would, and do not."""
        return self.sure > SURE and self.share < DENIED


def follows_the_course(effect: str) -> bool:
    """Whether an effect follows what a temperature does, and no input; a curve over it follows what it is."""
    needs = catalog.effects()[effect].needs
    return COURSE.issuperset(needs) and bool(needs - {"temperature_degc"})


def blocks_of(e: FoundEffect, found: Sequence[SensorFound]) -> Iterator[tuple[SensorFound, int]]:
    """The believed blocks that an effect is reported of."""
    for s in found:
        for b in s.found.library if s.sensor == e.sensor else ():
            block = s.found.pool.blocks[b]
            channels = {channel_name(s.sensor, axis) for axis in block.columns}
            if block.name == e.effect and channels <= set(e.channels):
                yield s, b


@dataclass(frozen=True)
class Temperatures:
    """The channels of a unit as thermometers of each other."""

    found: Sequence[SensorFound]
    data: Prepared
    _asked: dict[tuple[str, tuple[str, ...]], OneTemperature] = field(
        init=False, default_factory=dict, compare=False
    )

    def of(self, e: FoundEffect) -> OneTemperature:
        """What the other channels say most of an effect that follows the temperature's course."""
        key = e.effect, e.channels
        if key not in self._asked:
            self._asked[key] = self._said_of(e)
        return self._asked[key]

    def _said_of(self, e: FoundEffect) -> OneTemperature:
        few = len(self.data.starts) < LEAST_RUNS  # in one power-on every course is common to all channels
        if few or np.ptp(self.data.table.temperature_degc) <= GAP_K:
            return OneTemperature()
        found = list(self._contributions(e))
        each = [self._of([(c, shape(c, x)) for c, x in found]) for shape in (self._divided, self._times)]
        return max(each, key=lambda one: (one.agreed, one.share * one.sure))

    def _of(self, each: Sequence[tuple[str, Array]]) -> OneTemperature:
        """each: channels and the temperature (n,), K, that each says"""
        seen, known = dict[str, float](), dict[str, float]()
        for c, warmer in each:
            for other in self._each:
                who, (pz, pp) = self._knows(other, c), self._said(other, warmer)
                if other != c:
                    seen[who], known[who] = seen.get(who, 0.0) + pz, known.get(who, 0.0) + pp
        total = sum(known.values())
        if total <= 0.0:
            return OneTemperature()
        shares = [seen[who] / known[who] for who in known if known[who] > SURE**2 * len(each)]
        return OneTemperature(
            sum(seen.values()) / total,
            float(np.sqrt(total / len(each))),
            float(np.sqrt(np.mean([np.mean(x**2) for _, x in each]))),
            min(shares, default=0.0),
            max(shares, default=0.0),
            len(shares),
        )

    def _knows(self, other: str, channel: str) -> str:
        """Who says what another channel sees: itself, or the other sensor as a whole."""
        sensor = other.rsplit("_", 1)[0]
        return other if channel.startswith(sensor) else sensor

    def suspects(self, effects: Sequence[FoundEffect]) -> Iterator[ReferenceSuspect]:
        """The thermometer, by the effect of which the other channels say most, where they agree on one."""
        asked = [e for e in effects if follows_the_course(e.effect)]
        each = [(one, e) for e in asked if (one := self.of(e)).agreed]
        if each:
            one, e = max(each, key=lambda x: x[0].share * x[0].sure)
            strength = one.share * one.sure
            half = TWO_SIDED / strength * one.kelvin
            what, channels = e.effect.replace("_", " "), ", ".join(e.channels)
            yield ReferenceSuspect(
                NAME, one.kelvin, one.kelvin - half, one.kelvin + half, "K", e.channels,
                float(chi_square_tail(strength**2, 1)), strength, CHECK.format(what=what, channels=channels),
                strength, e.effect, RECORD,
            )  # fmt: skip

    @cached_property
    def _each(self) -> dict[str, tuple[Array, Array, Array, Whitened]]:
        """Channel -> (n,) slope, (n, q) basis of what is declared and of no temperature's course, (n,) z."""
        out = {}
        for s in self.found:
            blocks = s.found.pool.blocks
            other = [
                b for b in s.found.library if blocks[b].reference or not follows_the_course(blocks[b].name)
            ]
            for axis, w in s.found.pool.state.items():
                beside = [blocks[b].columns[axis] for b in other if axis in blocks[b].columns]
                own = w.noise.whiten(np.column_stack([np.empty((len(w.z), 0)), *beside]))
                Q = orthonormal(np.column_stack([w.Q, own]), SEEN)
                slope = _slope(seen_of(s, axis), self.data)
                out[channel_name(s.sensor, axis)] = slope, Q, clear(Q, w.z[:, None])[:, 0], w
        return out

    def _contributions(self, e: FoundEffect) -> Iterator[tuple[str, Array]]:
        """Each channel of an effect and what was found there, (n,) SI."""
        for s, b in blocks_of(e, self.found):
            k = s.found.pool.places[b]
            here, size = s.found.without(b), s.found.pool.size[k]
            gamma = inverse(here.grams(k)) @ here.h[k] / np.where(size > 0.0, size, np.inf)
            for axis, columns in s.found.pool.blocks[b].columns.items():
                yield channel_name(s.sensor, axis), columns @ gamma

    def _divided(self, channel: str, x: Array) -> Array:
        """(n,) K that make x (n,) of a channel's reading."""
        slope = self._each[channel][0]
        flat = FLAT**2 * float(np.mean(slope**2))
        return np.asarray(slope * x / (slope**2 + flat)) if flat > 0.0 else np.zeros(len(x))

    def _times(self, channel: str, x: Array) -> Array:
        """(n,) K that go as x (n,) does, of the size that the channel itself says."""
        p, z = self._seen(channel, x), self._each[channel][2]
        square = float(p @ p)
        return np.asarray(float(p @ z) / square * x) if square > 0.0 else np.zeros(len(x))

    def _seen(self, channel: str, warmer: Array) -> Array:
        """(n,) what a channel sees of a temperature (n,), K, in white rows."""
        slope, Q, _, w = self._each[channel]
        return clear(Q, w.noise.whiten((slope * warmer)[:, None]))[:, 0]

    def _said(self, other: str, warmer: Array) -> tuple[float, float]:
        """p z and p² of a channel, by the temperature (n,) that another one says."""
        p, z = self._seen(other, warmer), self._each[other][2]
        return float(p @ z), float(p @ p)


def _slope(one: Seen, data: Prepared) -> Array:
    """(n,) p'(T) + κ'(T) v of smooth curves through a channel's readings, SI per kelvin."""
    t, degree = data.table.temperature_degc, degree_of(data.table)
    X = np.column_stack([one.curved(curves(t, t, degree)), one.fixed[:, 1:]])
    beta = np.linalg.lstsq(X, one.fixed[:, 0], rcond=SEEN)[0]
    risen = (curves(t, t + STEP_K, degree) - curves(t, t - STEP_K, degree)) / (2.0 * STEP_K)
    p, kappa = np.split(beta[: 2 * risen.shape[1]], 2)
    return np.asarray(risen @ p + (risen @ kappa) * one.v)
