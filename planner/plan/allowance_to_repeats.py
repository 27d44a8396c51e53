"""Temperature points → repeats: every number that an error may choose, and the half-width d it reaches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planner.nouns.allowances import ErrorModel
from planner.nouns.choices import ErrorMenu, PointMenu, RepeatLevels, TemperaturePoints
from planner.plan.by_hand import fixed_repeats
from planner.plan.confidence import half_widths, quantile, spread_at
from planner.spec.model import Spec


def error_menus(
    spec: Spec, models: Sequence[ErrorModel], menus: Sequence[PointMenu]
) -> tuple[ErrorMenu, ...]:
    """Every number of repeats that each error may choose, for each of its temperature points.

    A test in whose records an error is unobservable is no choice for it.
    """
    by_name = {model.name: model for model in models}
    return tuple(
        ErrorMenu(
            menu.error,
            menu.test,
            menu.points,
            tuple(_levels(spec, by_name[menu.error], menu.test, points) for points in menu.points),
        )
        for menu in menus
        if np.isfinite(by_name[menu.error].within.get(menu.test, 0.0))
    )


def _levels(spec: Spec, model: ErrorModel, test: str, points: TemperaturePoints) -> RepeatLevels:
    plan, spread = spec.plan, spread_at(model, points.temperatures_degc, test)
    by_hand = fixed_repeats(spec, test)
    if by_hand is not None:
        repeats = np.broadcast_to(np.asarray(by_hand, dtype=np.int64), spread.shape)
        widths = half_widths(spec, model, test, points.temperatures_degc, repeats.tolist())
        return RepeatLevels(np.array([widths.max()]), repeats[None, :].copy())
    candidates = np.arange(plan.repeats.least, plan.repeats.most + 1)
    sigma, point_of = np.unique(spread, return_inverse=True)
    # (spreads, candidates) half-widths; every distinct one is a level that some point can be asked to reach
    widths = quantile(plan.confidence, plan.quantile, candidates) * sigma[:, None] / np.sqrt(candidates)
    reachable, first = widths[:, -1].max(), widths[:, 0].max()
    wanted = np.unique(widths[(widths >= reachable) & (widths <= first)])[::-1]
    wanted = wanted[np.isfinite(wanted)]
    index = np.array([np.searchsorted(-w, -wanted, side="left") for w in widths])
    return RepeatLevels(wanted, candidates[index].T[:, point_of])
