"""Attitude in numpy against scipy's Rotation: exponential map, its inverse, quaternions, matrices.

Run as `python benchmarks/bench_attitude.py`. Asserted before the time: both give the same to 1e-12. Only
the matrix of a rotation vector is quicker in scipy, and nothing in planner asks for that any more: it goes by
the quaternion. Ours has the components first, as the navigation of many flights has them; what it takes to
bring arrays into scipy's order and back is counted, for nobody can have the one without the other.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from planner.nouns.array import Array
from planner.physics import attitude, quaternion

ROUNDS = 7
Pair = tuple[Callable[[], Array], Callable[[], Array]]


def last(components_first: Array) -> Array:
    """(k, ...) -> (n, k)."""
    return np.moveaxis(components_first, 0, -1).reshape(-1, len(components_first))


def first(rows: Array, shape: tuple[int, ...]) -> Array:
    """(n, k) -> (k, ...), contiguous."""
    return np.ascontiguousarray(rows.T).reshape(-1, *shape)


def rodrigues(vector: Array) -> Array:
    """exp([φ×]) = I + sinφ/φ [φ×] + (1 - cosφ)/φ² [φ×]², (..., 3) -> (..., 3, 3)."""
    angle = np.sqrt(np.sum(vector * vector, axis=-1))
    weighted = (0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2)[..., None] * vector
    matrix: Array = weighted[..., :, None] * vector[..., None, :]
    diagonal = 1.0 - np.sum(weighted * vector, axis=-1)
    turn = np.sinc(angle / np.pi)[..., None] * vector
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        matrix[..., i, i] += diagonal
        matrix[..., k, j] += turn[..., i]
        matrix[..., j, k] -= turn[..., i]
    return matrix


def pairs(shape: tuple[int, ...]) -> Mapping[str, Pair]:
    """Name -> ours and scipy's."""
    rng = np.random.default_rng(1)
    theta = 0.01 * rng.normal(size=(3, *shape))
    p, q = (quaternion.from_rotation_vector(rng.normal(size=(3, *shape))) for _ in "pq")
    vector = np.ascontiguousarray(np.moveaxis(theta, 0, -1))
    matrix = rodrigues(vector)

    def turned(a: Array, b: Array) -> Array:
        made = Rotation.from_quat(last(a), scalar_first=True) * Rotation.from_quat(last(b), scalar_first=True)
        return first(made.as_quat(scalar_first=True), shape)

    return {
        "vector to quaternion": (
            lambda: quaternion.from_rotation_vector(theta),
            lambda: first(Rotation.from_rotvec(last(theta)).as_quat(scalar_first=True), shape),
        ),
        "vector to matrix": (
            lambda: rodrigues(vector),
            lambda: Rotation.from_rotvec(vector.reshape(-1, 3)).as_matrix().reshape(*shape, 3, 3),
        ),
        "matrix to vector": (
            lambda: attitude.rotation_vector_from_dcm(matrix),
            lambda: Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_rotvec().reshape(*shape, 3),
        ),
        "quaternion to matrix": (
            lambda: quaternion.to_matrix(p),
            lambda: Rotation.from_quat(last(p), scalar_first=True).as_matrix().reshape(*shape, 3, 3),
        ),
        "product of quaternions": (lambda: quaternion.product(p, q), lambda: turned(p, q)),
    }


def best(work: Callable[[], Array]) -> float:
    """Shortest time of some rounds, in s."""
    found = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        work()
        found.append(time.perf_counter() - start)
    return min(found)


def main() -> None:
    for shape in ((1,), (20, 50), (20, 6000)):
        print(f"{' × '.join(map(str, shape))} rotations")
        for name, (ours, scipys) in pairs(shape).items():
            a, b = ours(), scipys()
            same = np.minimum(np.abs(a - b), np.abs(a + b)) if "product" in name else np.abs(a - b)
            assert same.max() < 1e-12, name
            mine, theirs = best(ours), best(scipys)
            print(f"  {name:24} {1e6 * mine:9.1f} µs  scipy {1e6 * theirs:9.1f} µs  ({mine / theirs:.2f})")


if __name__ == "__main__":
    main()
