"""Campaigns at even temperatures, from which every search begins."""

from __future__ import annotations

import numpy as np

from planner.information.offers import Offers
from planner.nouns.array import Array

MOST_TEMPERATURES = 9
INSET = 0.06  # of even temperatures from the ends of the range
MOST_REPEATS = 1000  # that stand for as many as one likes


def most_repeats(offers: Offers, n: Array) -> Array:
    """The campaign with as many repeats as the spec allows."""
    most = n.copy()
    for offer in offers.tests:
        if offer.fixed is None:
            most[offer.places] = np.where(n[offer.places] > 0, min(offer.most, MOST_REPEATS), 0)
    return most


def even(offers: Offers, N: int, main: str | None = None, inset: float = INSET) -> Array:
    """(g,) tests at N evenly spread temperatures of their places, with the fewest repeats.

    main: the only test that is made at all of them; the others are made at the one in the middle
    inset: the outermost of three and more from the ends, as a share of the range
    """
    n = np.zeros(len(offers.kinds))
    for offer in offers.tests:
        if offer.fixed is not None:
            n[offer.places] = offer.fixed
        elif offer.everywhere:
            n[offer.places] = offer.least
        else:
            share = (np.arange(N) + 0.5) / N if N < 3 else np.linspace(inset, 1.0 - inset, N)
            if main not in (None, offer.test):
                share = share[N // 2 : N // 2 + 1]
            chosen = np.round(share * (len(offer.places) - 1)).astype(int)
            n[offer.places[np.unique(chosen)]] = offer.least
    return n
