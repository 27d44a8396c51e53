"""Local level with drift by maximum likelihood: statsmodels' UnobservedComponents (Harvey 1989).

    level_t = level_{t-1} + drift + η_t,    y_t = level_t + ε_t        in steps of the usual interval

Missing weeks are missing values to the Kalman filter. Its intervals take the variances for known, so
Student's t with n − 3 degrees of freedom stands in for the normal law.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from planner.fleet.forecast._method import Forecast, Past, too_short
from planner.nouns.array import Array

_MOST_STEPS = 3000  # of the filter: daily values over eight years


class Structural:
    """The local level with drift of statsmodels."""

    name = "structural"
    least = 6
    slow = True
    needs = "statsmodels"

    def forecast(self, series: Sequence[Past], ahead: Sequence[Array]) -> list[Forecast | str]:
        """One per series, ahead (h,) days."""
        return [too_short(self, s) or _one(s, np.asarray(h)) for s, h in zip(series, ahead, strict=True)]


def _one(one: Past, ahead: Array) -> Forecast | str:
    from statsmodels.tsa.statespace.structural import UnobservedComponents

    step = float(np.median(np.diff(one.day)))
    place = np.round((one.day - one.day[0]) / step).astype(int)
    if len(set(place.tolist())) < len(place) or place[-1] > _MOST_STEPS:
        return "structural needs values at nearly equal intervals"
    size = float(np.std(one.value)) or 1.0
    grid = np.full(place[-1] + 1, np.nan)
    grid[place] = one.value / size
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a variance at zero is an answer here, not a fault
        fit = UnobservedComponents(grid, level="lldtrend").fit(disp=False)
        steps = max(1, int(np.ceil(ahead.max() / step)))
        later = fit.get_forecast(steps)
    noise = float(np.sqrt(max(fit.params[0], 0.0))) * size
    mean, variance = later.predicted_mean * size, later.var_pred_mean * size**2 - noise**2
    if not (np.isfinite(mean).all() and np.isfinite(variance).all()):
        return "structural: the likelihood has no maximum for this series"
    known = step * np.arange(1, steps + 1)
    scale = np.sqrt(np.maximum(np.interp(ahead, known, variance), 0.0))
    return Forecast(np.interp(ahead, known, mean), scale, noise, max(len(one) - 3.0, 1.0))


METHOD = Structural()
