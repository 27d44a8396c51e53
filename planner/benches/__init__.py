"""One file a kind of bench. A kind in a package of one's own builds on the names below."""

from planner.benches._excitation import Observable, chosen, directions, pointing_up

__all__ = ["Observable", "chosen", "directions", "pointing_up"]
