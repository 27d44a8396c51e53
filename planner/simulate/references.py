"""A bench's references as they truly are: drawn within its stated accuracy, while the table says the nominal.

level: the base is off by a small rotation about its two horizontal axes, the same for everything on the bench
mounting: the unit is off by a small rotation, drawn anew at every installation
rate: relative error of the table's rate; temperature: the unit's true temperature less the thermometer's
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from planner.campaign.design import Design
from planner.campaign.exposure import Exposure, Misplaced
from planner.nouns.array import Array
from planner.nouns.conditions import Conditions
from planner.simulate.processes import generator
from planner.spec.references import BenchAccuracy


@dataclass(frozen=True)
class TrueReferences:
    """How far the references of a campaign are off, SI.

    bench -> level (2,) rad, rate (relative), temperature (K); installation -> its bench and mounting (3,) rad
    """

    level: Mapping[str, Array]
    rate: Mapping[str, float]
    temperature: Mapping[str, float]
    mounting: Mapping[int, tuple[str, Array]]

    @property
    def by_name(self) -> dict[str, float]:
        """`rate_table.level_x`, `rate_table.rate`, `rate_table.mounting_x_1` of installation 1, …, SI."""
        found: dict[str, float] = {}
        for bench, angles in self.level.items():
            found |= _by_axis(f"{bench}.level_", angles)
        found |= {f"{bench}.rate": value for bench, value in self.rate.items()}
        found |= {f"{bench}.temperature": value for bench, value in self.temperature.items()}
        for number, (bench, angles) in self.mounting.items():
            found |= _by_axis(f"{bench}.mounting_", angles, f"_{number}")
        return found

    def true_conditions(self, design: Design, shown: Conditions) -> Conditions:
        """What the unit is truly exposed to where the bench shows `shown`; that itself on perfect benches."""
        if not self.by_name:
            return shown
        seen = self._exposures(design)
        warmer = np.array([self.temperature.get(bench, 0.0) for bench in design.bench.tolist()])
        return replace(
            shown,
            rate=np.array([e.rate for e in seen]),
            specific_force=np.array([e.specific_force for e in seen]),
            temperature_degc=shown.temperature_degc + warmer,
        )

    def _exposures(self, design: Design) -> list[Exposure]:
        """One a record; repeats of a motion in one installation are worked out once."""
        known: dict[tuple[object, ...], Exposure] = {}
        found = []
        places = zip(design.bench.tolist(), design.installation.tolist(), strict=True)
        for asked, (bench, number) in zip(design.asked, places, strict=True):
            key = (number, *asked.key)
            if key not in known:
                known[key] = asked.exposed(self._misplaced(bench, number))
            found.append(known[key])
        return found

    def _misplaced(self, bench: str, installation: int) -> Misplaced:
        _, mounting = self.mounting.get(installation, (bench, np.zeros(3)))
        return Misplaced(self.level.get(bench, np.zeros(2)), mounting, self.rate.get(bench, 0.0))


def drawn_references(design: Design, accuracies: Mapping[str, BenchAccuracy], seed: int) -> TrueReferences:
    """Normal draws of the stated sigmas; nothing is drawn where a bench is perfect, or not used."""
    installed = dict(zip(design.installation.tolist(), design.bench.tolist(), strict=True))
    used = {bench: accuracies[bench] for bench in dict.fromkeys(installed.values()) if bench in accuracies}

    def normal(sigma: float, size: int, *key: str) -> Array:
        return np.asarray(sigma * generator(seed, "reference", *key).normal(size=size))

    return TrueReferences(
        {b: normal(a.level, 2, "level", b) for b, a in used.items() if a.level > 0},
        {b: float(normal(a.rate, 1, "rate", b)[0]) for b, a in used.items() if a.rate > 0},
        {b: float(normal(a.temperature, 1, "warmer", b)[0]) for b, a in used.items() if a.temperature > 0},
        {
            number: (b, normal(used[b].mounting, 3, "mounting", b, str(number)))
            for number, b in installed.items()
            if b in used and used[b].mounting > 0
        },
    )


def _by_axis(name: str, angles: Array, ending: str = "") -> dict[str, float]:
    return {f"{name}{axis}{ending}": float(angle) for axis, angle in zip("xyz", angles, strict=False)}
