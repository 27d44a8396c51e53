"""Our REML against that of statsmodels, where MixedLM can do the same.

One variance of the rows, one of a random intercept or slope in unbalanced groups, or both, uncorrelated.
Standard errors are not compared: theirs come of coefficients and variances inverted together.
"""

from __future__ import annotations

import numpy as np
import pytest

from planner.solvers.mixed_model import mixed_fit
from planner.solvers.random_effects import RandomEffects
from planner.solvers.reml import reml

# both stop where the likelihood is flat: a log-likelihood within 1e-6 of its top leaves a variance within
# 1.5e-3 of its standard error, which here is a quarter of the variance; coefficients move by less
OF_A_VARIANCE, OF_A_COEFFICIENT = 1e-3, 1e-5


def unbalanced(seed: int, spread: float, slope: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """y (n,), regressor (n,), group (n,): 25 groups of three to fourteen rows."""
    rng = np.random.default_rng(seed)
    group = np.repeat(np.arange(25), rng.integers(3, 15, 25))
    x = rng.normal(size=len(group)) + 0.3 * rng.normal(size=25)[group]
    drawn = spread * rng.normal(size=25)[group] + slope * rng.normal(size=25)[group] * x
    return 2.0 - 0.7 * x + drawn + 0.5 * rng.normal(size=len(group)), x, group


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("spread", "slope"), [(0.8, 0.0), (0.0, 0.6), (0.8, 0.6)], ids=["intercept", "slope", "both"]
)
def test_variances_and_coefficients_are_those_of_statsmodels(spread: float, slope: float, seed: int) -> None:
    from statsmodels.regression.mixed_linear_model import MixedLM, MixedLMParams

    y, x, group = unbalanced(seed, spread, slope)
    one = np.ones_like(x)
    X = np.column_stack([one, x])
    Z = np.column_stack([z for z, size in ((one, spread), (x, slope)) if size])
    k = Z.shape[1]
    free = MixedLMParams.from_components(fe_params=np.ones(2), cov_re=np.eye(k))  # no correlation
    theirs = MixedLM(y, X, groups=group, exog_re=Z).fit(reml=True, free=free, method="bfgs", gtol=1e-9)
    effects = RandomEffects(np.flatnonzero(np.diff(group, prepend=-1)), one[None, :], Z.T.copy())
    found = reml(y, X, effects)
    ours = mixed_fit(y, X, effects, found)
    assert theirs.converged
    assert found.converged
    expected = [theirs.scale, *np.diag(np.asarray(theirs.cov_re))]
    np.testing.assert_allclose(found.theta, expected, rtol=OF_A_VARIANCE)
    np.testing.assert_allclose(ours.coefficients, theirs.fe_params, rtol=OF_A_COEFFICIENT)
