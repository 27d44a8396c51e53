"""A levelled plate: the unit, in a cube, is put down by hand on its faces (B, way 1)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle, islice

import numpy as np

from planner.benches._excitation import Bench, Motion, directions, pointing_up


class LevelledPlate(Bench):
    """Excites gravity and, with a chamber, temperature; it has no drive, so no rate."""

    name = "levelled_plate"
    excites = frozenset({"gravity", "temperature"})

    def motions(
        self,
        count: int,
        axes: int,
        *,
        calibrates: Sequence[str] = (),
        rate_limit_dps: float = np.inf,
        load_limit_g: float = np.inf,
    ) -> tuple[Motion, ...]:
        """The faces of a cube one after the other, as positions of an imagined table of two axes."""
        faces = [pointing_up(direction) for direction in directions()[:6]]
        return tuple(islice(cycle(faces), count))


KIND = LevelledPlate()
