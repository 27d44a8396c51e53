"""A centrifuge: an arm that turns at a known rate and loads the unit at its end, a = R ω² (K 4.3.3).

Loads are signed along the unit's axis: a negative one means the unit turned round on the arm. Of two or more
axes, axis 2 turns the unit at the arm's end and brings its x, y, −x, −y outwards.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle, islice, product

import numpy as np

from planner.benches._excitation import LOADS_G, chosen, observable

Motion = Mapping[str, float]


class Centrifuge:
    """Excites acceleration together with rate, gravity (by mounting) and, with a chamber, temperature."""

    name = "centrifuge"
    excites = frozenset({"rate", "gravity", "acceleration", "temperature"})

    @property
    def observes(self) -> frozenset[str]:
        """Errors, as `gyro.scale_factor_acceleration`, that its records can show."""
        return observable(self.excites)

    def motions(
        self,
        count: int,
        axes: int,
        *,
        calibrates: Sequence[str] = (),
        rate_limit_dps: float = np.inf,
        load_limit_g: float = np.inf,
    ) -> tuple[Motion, ...]:
        """Loads of K 2.2.5 in both directions of the unit's axes, lowest first; one is a middle load."""
        if axes == 1:
            loads = chosen(LOADS_G, -(-count // 2), load_limit_g)
            motions: list[Motion] = [
                {"acceleration_g": sign * load} for load, sign in product(loads, (1.0, -1.0))
            ]
        else:
            loads = chosen(LOADS_G, -(-count // 4), load_limit_g)
            motions = [
                {"acceleration_g": load, "position_2_deg": position}
                for load, position in product(loads, (0.0, 90.0, 180.0, 270.0))
            ]
        return tuple(islice(cycle(motions), count))


KIND = Centrifuge()
