"""A spec for scripts: loaded, from a file or built in Python, with the verbs that begin with one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import MethodType
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar

from planner.api import comparing, fleet, planning, promise, simulating, sweeping
from planner.api.given import SpecLike, read
from planner.spec.load import LoadedSpec
from planner.spec.sensor_alone import sensor_spec_from_bytes

Asked = ParamSpec("Asked")
Found = TypeVar("Found")


class Verb(Generic[Asked, Found]):
    """A function whose first argument is a spec, as a method of the spec."""

    def __init__(self, function: Callable[Concatenate[SpecLike, Asked], Found]) -> None:
        self.function = function
        self.__doc__ = function.__doc__

    def __get__(self, spec: LoadedSpec, owner: type | None = None) -> Callable[Asked, Found]:
        return MethodType(self.function, spec)


@dataclass(frozen=True)
class Spec(LoadedSpec):
    """A spec that has been checked. `spec` is its typed content, SI; `text` is what stands in the file."""

    check = Verb(planning.check)
    plan = Verb(planning.plan)
    sensitivity = Verb(planning.sensitivity)
    allow = Verb(planning.allow)
    afford = Verb(comparing.afford)
    verify = Verb(promise.verify)
    simulate = Verb(simulating.simulate)
    sweep = Verb(sweeping.sweep)
    recalibrate = Verb(fleet.recalibrate)
    plan_check = Verb(fleet.plan_check)

    def having(self, changes: Mapping[str, Any]) -> Spec:
        """The spec with other values: {`requirement.0.limit`: `5 m`, `plan.confidence`: `99 %`}.

        Comments are lost. Raises InputError for a key that leads nowhere, and for a value that is wrong.
        """
        from planner.spec.yaml12 import read_yaml
        from planner.verify.vary import Variation, grid

        tree = read_yaml(self.data, str(self.path)).value
        (changed,) = grid(tree, [Variation(key, (value,)) for key, value in changes.items()], "")
        return _named(sensor_spec_from_bytes(changed.text.encode(), self.path))

    def __repr__(self) -> str:
        return f"Spec({self.spec.name!r}, {self.path})"

    def _repr_html_(self) -> str:
        from html import escape

        return f"<p><b>{escape(self.spec.name)}</b></p><pre>{escape(self.text)}</pre>"


def load(spec: str | Path | Mapping[str, Any]) -> Spec:
    """A spec from a YAML file, or from the same mapping built in Python.

    A spec of the sensor alone (`planner`, `unit`, `effects`) loads, and says so in `absent`; what needs more
    of it says what. Raises InputError with every fault at its place (`.faults`).
    """
    return _named(read(spec))


def _named(found: LoadedSpec) -> Spec:
    return Spec(**{field.name: getattr(found, field.name) for field in fields(found)})
