"""Laws for plug-ins of one's own: `check_effect(EFFECT)` in a package's tests says all that is wrong."""

from planner.testing.effect_laws import check_effect

__all__ = ["check_effect"]
