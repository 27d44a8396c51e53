"""Quantiles and tails of the usual laws by scipy.special: scipy.stats takes half a second to import."""

from __future__ import annotations

from typing import Any

TWO_SIDED = 1.96  # sigmas within which 95 % of a normal variate lie


def normal_quantile(p: Any) -> Any:
    """x with P(X <= x) = p of N(0, 1); numbers or arrays."""
    from scipy.special import ndtri

    return ndtri(p)


def student_quantile(p: Any, freedom: Any) -> Any:
    """x with P(X <= x) = p of Student's t, normal at infinite freedom; NaN without any freedom."""
    from scipy.special import stdtrit

    return stdtrit(freedom, p)


def student_tail(x: Any, freedom: Any) -> Any:
    """P(X > x) of Student's t."""
    from scipy.special import stdtr

    return stdtr(freedom, -x)


def chi_square_quantile(p: Any, freedom: Any) -> Any:
    """x with P(X <= x) = p of χ², 2 P⁻¹(ν/2, p) by the incomplete gamma function; NaN without any freedom."""
    from scipy.special import gammaincinv

    return 2.0 * gammaincinv(0.5 * freedom, p)


def chi_square_tail(x: Any, freedom: Any) -> Any:
    """P(X > x) of χ²."""
    from scipy.special import chdtrc

    return chdtrc(freedom, x)


def binomial_interval(hits: int, of: int, tail: float) -> tuple[float, float]:
    """Exact interval of a binomial share, `tail` beyond each end (Clopper, Pearson, Biometrika 26, 1934)."""
    from scipy.special import betaincinv

    low = 0.0 if hits == 0 else float(betaincinv(hits, of - hits + 1, tail))
    high = 1.0 if hits == of else float(betaincinv(hits + 1, of - hits, 1.0 - tail))
    return low, high
