"""What a bench can show, worked out from what it can excite, and the directions and levels of its motions.

An effect is observable when its regressors over everything the bench can do are not a mixture of those of
bias, scale factor and misalignment: a new effect needs no entry here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from functools import cache
from itertools import product
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from planner.catalog import effects
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.protocols import SENSORS, Effect, Group, Sensor
from planner.units import STANDARD_GRAVITY_MPS2

RATES_DPS = (10.0, 25.0, 50.0, 100.0, 200.0, 300.0, 400.0, 500.0)  # K 2.2.5
LOADS_G = (1.0, 2.0, 5.0, 10.0, 25.0, 50.0, 75.0, 100.0)  # K 2.2.5

_BASE: tuple[str, ...] = get_args(Group)  # every group is called after its plain effect
# share of an effect that the base must leave over; a cubic error at 1 g, 1/2500 of that at 50 g, is noise
_LEAST_SHARE = 1e-3


Motion = Mapping[str, float]


class Observable(Set[str]):
    """Errors, as `gyro.bias`, shown by a bench that excites some of rate, gravity, acceleration, temperature.

    Asked for one error, it imports and probes that effect alone.
    """

    def __init__(self, excites: frozenset[str]) -> None:
        self._excites = excites

    def __contains__(self, error: object) -> bool:
        sensor, _, name = str(error).partition(".")
        return any(_shown(self._excites, s, name) for s in SENSORS if s == sensor and name in effects())

    def __iter__(self) -> Iterator[str]:
        errors = (f"{s}.{name}" for s in SENSORS for name, effect in effects().items() if s in effect.sensors)
        return (error for error in errors if error in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @classmethod
    def _from_iterable(cls, errors: Iterable[str]) -> Set[str]:  # type: ignore[override]  # the base's is generic, this set holds str alone
        return frozenset(errors)  # what `&` and `|` give


class Bench:
    """What our kinds of bench have in common; each has a name and offers its motions."""

    excites: frozenset[str]

    @property
    def observes(self) -> Set[str]:
        """Errors, as `gyro.scale_factor`, that its records can show."""
        return Observable(self.excites)


@cache
def _shown(excites: frozenset[str], sensor: Sensor, name: str) -> bool:
    effect = effects()[name]
    return sensor in effect.sensors and _shows(_reachable(excites), _reachable(_EVERYTHING), sensor, effect)


def _shows(here: Conditions, anywhere: Conditions, sensor: Sensor, effect: Effect) -> bool:
    """Whether what the base cannot mimic of every term is a fair share of what the best bench would see."""
    others = [effects()[name] for name in _BASE if name != effect.name]
    base = np.concatenate([_column(other, sensor, here) for other in others], axis=1)
    columns, full = (_column(effect, sensor, conditions) for conditions in (here, anywhere))
    left = columns - base @ np.linalg.lstsq(base, columns, rcond=1e-12)[0]
    size = np.sqrt(np.mean(full**2, axis=0))
    return bool((np.sqrt(np.mean(left**2, axis=0)) > _LEAST_SHARE * size).all())


def _column(effect: Effect, sensor: Sensor, conditions: Conditions) -> Array:
    regressors = effect.regressors(sensor, conditions)
    return regressors.reshape(-1, regressors.shape[-1])


# degC and K/s; at no even distances, so that no curve over temperature is zero at all of them
_STEADY = ((20.0, 0.0), (-60.0, 0.0), (-37.0, 0.0), (-11.0, -0.02), (41.0, 0.0), (60.0, 0.03), (83.0, 0.01))
_RAMPS = tuple((t, rate) for t in (-58.0, -17.0, 3.0, 22.0, 44.0, 61.0) for rate in (0.02, -0.02))
_WARMTH = (*_STEADY, *_RAMPS)
_EVERYTHING = frozenset({"rate", "gravity", "acceleration", "temperature"})


@cache
def _reachable(excites: frozenset[str]) -> Conditions:
    """Everything the bench can do, one row a condition: faces × loads × turns × temperatures × times."""
    turns = (-500.0, 0.0, 100.0, 500.0) if "rate" in excites else (0.0,)
    every = (*(-r for r in RATES_DPS), *RATES_DPS) if "rate" in excites else ()
    loads = (0.0, 10.0, 50.0, 100.0) if "acceleration" in excites else (0.0,)
    warmth = _WARMTH if "temperature" in excites else _WARMTH[:1]
    ages = ((2.0, 0.0), (10.0, 0.0), (700.0, 3.0), (3000.0, 30.0))  # every bench can wait
    between = ((60.0, 1.0), (150.0, 7.0), (400.0, 15.0))  # the nodes of a measured curve lie no further apart
    faces = range(6) if "gravity" in excites else range(1)
    states = [
        *product(faces, turns, loads, warmth, ages),
        *product(faces, every, loads, warmth[:1], ages),
        *product(faces, turns, loads, warmth[:1], between),
    ]
    face = np.array([state[0] for state in states])
    turn, load = np.array([state[1:3] for state in states]).T
    warm, age = (np.array([state[k] for state in states]) for k in (3, 4))
    return Conditions(_turned(face, turn), _loaded(face, load), *warm.T, *age.T)


def _turned(face: NDArray[np.int64], rate_dps: Array) -> Array:
    """(n, 3) turning about the vertical, rad/s: the body axis of the face."""
    return np.asarray(np.radians(rate_dps)[:, None] * np.eye(3)[face % 3])


def _loaded(face: NDArray[np.int64], load_g: Array) -> Array:
    """(n, 3) gravity along the face, up or down, and the load of an arm across it, m/s²."""
    sign = np.where(face < 3, STANDARD_GRAVITY_MPS2, -STANDARD_GRAVITY_MPS2)
    return np.asarray(sign[:, None] * (np.eye(3)[face % 3] + load_g[:, None] * np.eye(3)[(face + 1) % 3]))


def chosen(levels: Sequence[float], count: int, limit: float) -> tuple[float, ...]:
    """`count` levels, evenly picked from those up to the limit; the highest one is always among them."""
    possible = [level for level in levels if level <= limit] or [limit]
    if count == 1:
        return (possible[len(possible) // 2],)
    picks = np.linspace(0, len(possible) - 1, count).round().astype(int)
    return tuple(float(possible[i]) for i in picks)


def directions() -> Array:
    """(26, 3) unit vectors to a cube's faces (z, −z, y, −y, x, −x), edges and corners."""
    half = [v for v in product((1.0, 0.0, -1.0), repeat=3) if v > (0.0, 0.0, 0.0)]
    ordered = sorted(half, key=lambda v: (sum(map(abs, v)), v))
    return np.array([np.array(v) * sign / np.linalg.norm(v) for v in ordered for sign in (1.0, -1.0)])


def pointing_up(direction: Array) -> Motion:
    """Positions of a two-axis table at which a body direction (3,) points up.

    Axis 1 carries the unit and is its z axis, axis 2 tilts axis 1 and is the unit's y axis at zero, so up is
    R_z(−p1) R_y(−p2) (0, 0, 1) = (−sin p2 cos p1, sin p2 sin p1, cos p2) in the body.
    """
    x, y, z = direction
    level = np.hypot(x, y) < 1e-12
    turn = 0.0 if level else float(np.degrees(np.arctan2(y, -x))) % 360.0
    return {
        "position_1_deg": round(turn, 6),
        "position_2_deg": round(float(np.degrees(np.arccos(np.clip(z, -1.0, 1.0)))), 6),
    }
