"""Whether the calibration's fit holds a parameter where the search says that it is not.

A parameter that the data do not tell stays at its default in that fit. What settles in 20 s is hardly seen
by records that begin after a minute: held at 5 s it was 400 deg/s, give or take 140, of which e⁻¹¹ are left
then; 0.02 deg/s were true. The search has an interval of such a parameter, and the size beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from planner import catalog
from planner.diagnose.findings.declared_and_found import ChannelEstimates
from planner.diagnose.search.sensor import SensorFound


def held_elsewhere(
    s: SensorFound, last: Mapping[int, ChannelEstimates], blocks: Sequence[int]
) -> Iterator[tuple[int, str]]:
    """Channel and sentence where a default, at which a fit holds a parameter, lies outside its interval."""
    for b in blocks:
        block = s.found.pool.blocks[b]
        effect, axis = catalog.effects()[block.name], block.channels[0]
        told = {name for of, name in last[axis].parameters if of == block.name} if axis in last else set()
        held = [p for p in effect.parameters if p.name not in told and not p.stepped]
        if axis not in last or not held:
            continue
        known = {i.name: i for i in s.shape(b).parameters}
        for p in held:
            if not known[p.name].low <= p.default <= known[p.name].high:
                at = f"{p.name} of {block.name} at {p.shown(p.default)}"
                yield (
                    axis,
                    f"sizes are those of the search, not of the calibration's fit, which holds the {at}",
                )
