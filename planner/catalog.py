"""Finds the plug-ins: every module of a plug-in package that has the constant by which it offers itself."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Mapping
from functools import cache
from typing import Any

from planner.protocols import Effect


@cache
def plugins(package: str, constant: str, *, every: bool = True) -> dict[str, Any]:
    """Plug-ins of `package` by their `name`, in the order of the names.

    `plugins("planner.effects", "EFFECT")` imports every module of that package once. A module whose name
    starts with an underscore is shared machinery, not a plug-in. Raises TypeError for a module that offers
    nothing (unless not `every` module is a plug-in) and for two plug-ins of one name.
    """
    root = importlib.import_module(package)
    found: dict[str, Any] = {}
    for info in pkgutil.iter_modules(root.__path__):
        if info.name.startswith("_"):
            continue
        module = importlib.import_module(f"{package}.{info.name}")
        plugin = getattr(module, constant, None)
        if plugin is None and not every:
            continue
        if plugin is None:
            raise TypeError(f"{module.__name__} offers no {constant}")
        if plugin.name in found:
            raise TypeError(f"two plug-ins of {package} are called {plugin.name}")
        found[plugin.name] = plugin
    return dict(sorted(found.items()))


def effects() -> Mapping[str, Effect]:
    """All effects by name."""
    return plugins("planner.effects", "EFFECT")


def bench_only() -> frozenset[str]:
    """Names of the effects of the bench or of its references: none of them flies."""
    return frozenset(name for name, effect in effects().items() if effect.bench_only)


def trajectories() -> dict[str, Any]:
    """All trajectory families by name."""
    return plugins("planner.trajectories", "FAMILY")


def benches() -> dict[str, Any]:
    """All kinds of bench by name."""
    return plugins("planner.benches", "KIND")


def exports() -> dict[str, Any]:
    """All export formats by name."""
    return plugins("planner.export", "FORMAT", every=False)


def readers() -> dict[str, Any]:
    """All formats of raw recordings by name."""
    return plugins("planner.readers", "READER")
