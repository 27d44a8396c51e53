"""Accelerometers from rests in orientations that nobody measured: only |f| = g is known (B, way 2).

    a = K f + b,  |f| = g.   Start: the ellipsoid aᵀM̃a + 2 m̃ᵀa = 1, which is linear in its nine numbers:
    b = −M̃⁻¹m̃,  SᵀS = M̃/(1 + q),  q = m̃ᵀM̃⁻¹m̃,  K = S⁻¹/g    (B prints q without the inverse)
Then Gauss-Newton on |K⁻¹(a − b)| − g. The body's axes are those of the accelerometers themselves: K lower
triangular (x along accelerometer x, y in the plane of x and y), or symmetric. Six faces alone do not
determine nine numbers; six faces and twelve edges do. Where their misalignment is not determined it is
taken as zero within a degree (K 2.2.3: what mounting may be off), which the other intervals then hold.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array
from planner.solvers.least_squares import Factors, factors
from planner.units import STANDARD_GRAVITY_MPS2

Form = Literal["triangular", "symmetric"]
MISALIGNMENT = float(np.radians(1.0))
_STEPS = 60
_SQUARE = (0, 1, 2, 6, 7, 8)  # unknowns of axes that are square to each other: scale factors and biases
_RANK = 1e-6  # a combination of unknowns that changes |f| a million times less than others is not seen


@dataclass(frozen=True)
class FreeFit:
    """K (3, 3) and b (3,) m/s² of a = K f + b, with covariance (9, 9) of the unknowns and what is not seen.

    unknowns: (9,) diagonal of K − I, three lower off-diagonal numbers of K, b
    residual: (n,) |f| − g in m/s²; freedom: rows less the rank
    """

    K: Array
    b: Array
    covariance: Array
    undetermined: NDArray[np.bool_]
    residual: Array
    freedom: int
    condition: float
    square: bool = False  # the axes were taken as square to each other, for lack of orientations


def shapes(form: Form) -> Array:
    """(6, 3, 3) what each of the six numbers of K adds to the identity."""
    E = np.zeros((6, 3, 3))
    E[[0, 1, 2], [0, 1, 2], [0, 1, 2]] = 1.0
    for k, (i, j) in enumerate(((1, 0), (2, 0), (2, 1)), start=3):
        E[k, i, j] = 1.0
        if form == "symmetric":
            E[k, j, i] = 1.0
    return E


def free_orientations(a: Array, g: float = STANDARD_GRAVITY_MPS2, form: Form = "triangular") -> FreeFit:
    """Calibrate from mean readings a (n, 3) at rest, m/s²; g: local gravity, m/s².

    Raises ValueError with fewer than two rests.
    """
    if len(a) < 2:
        raise ValueError("one rest alone tells nothing of |f| = g")
    E = shapes(form)
    p, found = _descended(a, g, _start(a, g, form), E, np.zeros(9), tuple(range(9)))
    residual, _ = _linearised(a, g, p, E)
    if found.rank < 9:
        return _square_axes(a, g, E)
    fit = _fit(p, E, residual, found)
    return _square_axes(a, g, E) if _knows_less_than_the_mounting(fit) else fit


def ellipsoid(a: Array, g: float = STANDARD_GRAVITY_MPS2, form: Form = "triangular") -> FreeFit:
    """The ellipsoid through mean readings a (n, 3) at rest, m/s²: linear least squares (B 3.4, task 5).

    On it aᵀM̃a + 2m̃ᵀa − 1 is (|f| − g) times the same number at every rest, so that to first order in the
    noise its covariance is that of `free_orientations`.
    Raises ValueError where the rests make no ellipsoid.
    """
    p = _start(a, g, form)
    if not p.any():
        raise ValueError("the rests make no ellipsoid: nine attitudes are needed, faces and edges")
    residual, J = _linearised(a, g, p, shapes(form))
    return _fit(p, shapes(form), residual, factors(J, _RANK))


def _knows_less_than_the_mounting(fit: FreeFit) -> bool:
    """Faces alone, each a little tilted, make nine numbers of noise: misalignment is surer unmeasured."""
    sigma = np.sqrt(np.maximum(np.diag(fit.covariance)[3:6], 0.0))
    unsure = fit.freedom > 0 and sigma.max() > MISALIGNMENT / 2.0
    return bool(unsure or np.abs(fit.K - np.eye(3)).max() > 0.3)


def _descended(
    a: Array, g: float, p: Array, E: Array, prior: Array, free: tuple[int, ...]
) -> tuple[Array, Factors]:
    """Gauss-Newton over some of the unknowns; prior: (9,) weights of zero as a measurement of each."""
    index = list(free)
    for _ in range(_STEPS):
        residual, J = _linearised(a, g, p, E)
        found = factors(np.vstack([J, np.diag(prior)])[:, index], _RANK)
        step = np.zeros(9)
        if found.rank < len(index) and len(index) < 9:
            break
        step[index] = found.solve(-np.concatenate([residual, prior * p]))
        p = p + step
        if np.abs(J @ step).max() < 1e-12 * g:
            break
    return p, found


def _square_axes(a: Array, g: float, E: Array) -> FreeFit:
    """Scale factors and biases alone; then again with misalignment that is zero within `MISALIGNMENT`."""
    p, found = _descended(a, g, np.zeros(9), E, np.zeros(9), _SQUARE)
    unknown = np.ones(9, dtype=bool)
    if found.rank < len(_SQUARE) or np.abs(p[:3]).max() > 0.5:  # too few orientations for any of it
        p = np.zeros(9)
    else:
        unknown[list(_SQUARE)] = found.undetermined(1e-4)
    residual, _ = _linearised(a, g, p, E)
    freedom = len(residual) - found.rank
    covariance = np.full((9, 9), np.nan)
    if freedom > 0 and not unknown[list(_SQUARE)].any():
        sigma = max(float(np.sqrt(residual @ residual / freedom)), 1e-9 * g)
        prior = np.zeros(9)
        prior[3:6] = sigma / MISALIGNMENT
        p, both = _descended(a, g, p, E, prior, tuple(range(9)))
        residual, _ = _linearised(a, g, p, E)
        covariance = sigma**2 * both.to_coefficients @ both.to_coefficients.T
    return FreeFit(
        np.eye(3) + np.tensordot(p[:6], E, 1),
        p[6:],
        covariance,
        unknown,
        residual,
        freedom,
        found.condition,
        square=True,
    )


def _fit(p: Array, E: Array, residual: Array, found: Factors) -> FreeFit:
    freedom = len(residual) - found.rank
    variance = float(residual @ residual) / freedom if freedom > 0 else np.nan
    return FreeFit(
        K=np.eye(3) + np.tensordot(p[:6], E, 1),
        b=p[6:],
        covariance=variance * found.to_coefficients @ found.to_coefficients.T,
        undetermined=found.undetermined(1e-4),
        residual=residual,
        freedom=freedom,
        condition=found.condition,
    )


def _linearised(a: Array, g: float, p: Array, E: Array) -> tuple[Array, Array]:
    """|f| − g (n,) and its derivative (n, 9): −wᵀE_k f and −w, with w = K⁻ᵀ f/|f|."""
    inverse = np.linalg.inv(np.eye(3) + np.tensordot(p[:6], E, 1))
    f = (a - p[6:]) @ inverse.T
    size = np.linalg.norm(f, axis=1)
    w = (f / size[:, None]) @ inverse
    return size - g, -np.column_stack([np.einsum("ni,kij,nj->nk", w, E, f), w])


def _start(a: Array, g: float, form: Form) -> Array:
    """The ellipsoid's K and b where it is one and determined; otherwise no error at all."""
    nothing = np.zeros(9)
    x, y, z = (a / g).T
    H = np.column_stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z, 2 * x, 2 * y, 2 * z])
    found = factors(H, _RANK)
    if found.rank < 9:
        return nothing
    c = found.solve(np.ones(len(a)))
    M = np.array([[c[0], c[3], c[4]], [c[3], c[1], c[5]], [c[4], c[5], c[2]]])
    if np.linalg.eigvalsh(M).min() <= 0:
        return nothing
    centre = -np.linalg.solve(M, c[6:])
    A = M / (1.0 + float(c[6:] @ np.linalg.solve(M, c[6:])))
    K = np.linalg.inv(_reversed_cholesky(A) if form == "triangular" else _root(A))
    if np.abs(K - np.eye(3)).max() > 0.5 or np.abs(centre).max() > 0.5:
        return nothing
    return np.concatenate([np.diag(K) - 1.0, K[[1, 2, 2], [0, 0, 1]], centre * g])


def _reversed_cholesky(A: Array) -> Array:
    """Lower-triangular S with SᵀS = A."""
    return np.asarray(np.linalg.cholesky(A[::-1, ::-1])[::-1, ::-1].T)


def _root(A: Array) -> Array:
    """Symmetric S with S S = A."""
    value, vector = np.linalg.eigh(A)
    return np.asarray((vector * np.sqrt(value)) @ vector.T)
