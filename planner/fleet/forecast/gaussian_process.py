"""Gaussian process: a line, a Matérn-3/2 function on it, and noise; scikit-learn (Rasmussen, Williams 2006).

    k(t, t') = c₁ (1 + t t') + c₂ (1 + √3 d/ℓ) exp(−√3 d/ℓ) + σ² [t = t'],     d = |t − t'|

c₁, c₂, ℓ, σ by maximum likelihood; time in units of the history's length, values in units of their spread.
Student's t with n − 4 degrees of freedom pays for the four parameters.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np

from planner.fleet.forecast._method import Forecast, Past, too_short
from planner.nouns.array import Array


class GaussianProcess:
    """scikit-learn's Gaussian process regression."""

    name = "gaussian_process"
    least = 6
    slow = True
    needs = "sklearn"

    def forecast(self, series: Sequence[Past], ahead: Sequence[Array]) -> list[Forecast | str]:
        """One per series, ahead (h,) days."""
        return [too_short(self, s) or _one(s, np.asarray(h)) for s, h in zip(series, ahead, strict=True)]


def _one(one: Past, ahead: Array) -> Forecast:
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, DotProduct, Matern, WhiteKernel

    span = float(one.day[-1] - one.day[0])
    middle, size = float(np.mean(one.value)), float(np.std(one.value)) or 1.0
    kernel = (
        ConstantKernel(1.0, (1e-4, 1e4)) * DotProduct(1.0, "fixed")
        + ConstantKernel(0.3, (1e-6, 1e3)) * Matern(0.3, (0.02, 10.0), nu=1.5)
        + WhiteKernel(0.1, (1e-6, 1e2))
    )
    model = GaussianProcessRegressor(kernel, alpha=1e-10)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a parameter at its bound is an answer here, not a fault
        model.fit(((one.day - one.day[0]) / span)[:, None], (one.value - middle) / size)
        later = ((one.day[-1] - one.day[0] + ahead) / span)[:, None]
        mean, sigma = model.predict(later, return_std=True)
    noise = float(np.sqrt(model.kernel_.k2.noise_level))
    scale = np.sqrt(np.maximum(sigma**2 - noise**2, 0.0))
    return Forecast(middle + size * mean, size * scale, size * noise, max(len(one) - 4.0, 1.0))


METHOD = GaussianProcess()
