"""The unit in which the spec speaks of an error: `deg/h`, `micro-g`, `ppm`, `arcsec`; chosen once per error.

Console, report, CSV and JSON show an error in it. Values are SI inside; only where they are written this
unit stands beside them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping

from planner import catalog
from planner.protocols import SENSORS, Sensor
from planner.spec.budget import ErrorBudget
from planner.spec.model import Spec
from planner.spec.part import SpecPart
from planner.units import Quantity


def own_unit(spec: Spec, sensor: Sensor, effect: str) -> str:
    """The unit of most figures of the error's budget, of several the first; the effect's without a budget."""
    budget = getattr(spec.unit, sensor).get(effect)
    usual = str(catalog.effects()[effect].units[sensor])
    return usual if budget is None else budget_unit(budget, usual)


def budget_unit(budget: ErrorBudget, usual: str) -> str:
    """The unit of most figures of a budget, of equally many the first; `usual` where it has none."""
    written = Counter(q.unit for q in _quantities(budget))
    return written.most_common(1)[0][0] if written else usual


def own_units(spec: Spec) -> Mapping[str, str]:
    """Error `<sensor>.<effect>` -> its unit, of every error that the spec gives a budget for."""
    return {
        f"{sensor}.{effect}": own_unit(spec, sensor, effect)
        for sensor in SENSORS
        for effect in getattr(spec.unit, sensor)
    }


def _quantities(part: object) -> Iterator[Quantity]:
    """Every quantity of a budget that has a unit, in the order of its keys."""
    if isinstance(part, Quantity):
        if part.unit:
            yield part
    elif isinstance(part, Mapping):
        for one in part.values():
            yield from _quantities(one)
    elif isinstance(part, tuple):
        for one in part:
            yield from _quantities(one)
    elif isinstance(part, SpecPart):
        yield from _quantities({name: getattr(part, name) for name in type(part).model_fields})
