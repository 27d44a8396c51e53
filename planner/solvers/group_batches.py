"""Groups of one size at a time: products of small matrices take a fifth of the time of sums over rows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.nouns.array import Array

_MANY = 50  # columns


@dataclass(frozen=True)
class Batch:
    """Groups of one size. places: (G,) their numbers; rows: (G, m)."""

    places: NDArray[np.int64]
    rows: NDArray[np.int64]

    @cached_property
    def together(self) -> bool:
        """Whether the groups follow one another: then nothing is copied to see what is theirs."""
        return bool(self.places[-1] - self.places[0] == len(self.places) - 1)

    @cached_property
    def _at(self) -> Any:
        return slice(self.rows[0, 0], self.rows[-1, -1] + 1) if self.together else self.rows

    @cached_property
    def _among(self) -> Any:
        return slice(self.places[0], self.places[-1] + 1) if self.together else self.places

    def of(self, A: Array) -> Array:
        """(G, m, …) what of rows (n, …) is theirs."""
        return np.asarray(A[self._at].reshape(*self.rows.shape, *A.shape[1:]))

    def of_groups(self, S: Array) -> Array:
        """(G, …) what of the groups' own S (g, …) is theirs."""
        return np.asarray(S[self._among])

    def put(self, out: Array, found: Array) -> None:
        """`found` (G, m, …) to its place among rows (n, …)."""
        out[self._at] = found.reshape(self.rows.size, *out.shape[1:]) if self.together else found

    def put_product(self, out: Array, factors: Array, A: Array) -> None:
        """Each group's factor (G, k, k) times what is theirs of rows A (n, m), to its place among rows."""
        if self.together:
            np.matmul(factors, self.of(A), out=self.of(out))
        else:
            self.put(out, factors @ self.of(A))

    def take(self, out: Array, found: Array) -> None:
        """`found` (G, m, …) taken off what is theirs among rows (n, …)."""
        out[self._at] -= found.reshape(self.rows.size, *out.shape[1:]) if self.together else found

    def put_groups(self, out: Array, found: Array) -> None:
        """`found` (G, …) to its place among what is the groups' own (g, …)."""
        out[self._among] = found


def batches_of(starts: NDArray[np.int64], sizes: NDArray[np.int64]) -> list[Batch]:
    """The groups of every size; starts: (g,) their first rows."""
    alike = (np.flatnonzero(sizes == m) for m in sorted(set(sizes.tolist())))
    return [Batch(at, starts[at][:, None] + np.arange(sizes[at[0]])) for at in alike]


def sums_of_groups(A: Array, starts: NDArray[np.int64], weights: Array | None = None) -> Array:
    """(g, k) sums over each group of rows (n, k), each row times its weight (n,).

    Of many columns a sixth of the time of `reduceat`, and the weights cost nothing.
    """
    from scipy.sparse import csr_array

    n, each = len(A), np.ones(len(A)) if weights is None else weights
    if A.shape[1] < _MANY:
        return np.asarray(np.add.reduceat(A if weights is None else each[:, None] * A, starts, axis=0))
    groups = csr_array((each, np.arange(n), np.append(starts, n)), shape=(len(starts), n))
    return np.asarray(groups @ A)
