"""planner: the shortest calibration campaign of an inertial unit that provably suffices.

Every command is a function here, and those that begin with a spec are its methods:

    import planner

    spec = planner.load("spec.yaml")             # or the same mapping, built in Python
    plan = spec.plan()                           # planner.plan(spec), planner plan spec.yaml
    plan.time_s, plan.to_pandas(), plan.save("plans/spec")
    planner.verify(spec, plan).verdict

Nothing is imported before it is used. `__init__.pyi` beside this file tells editors the types.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

_VERBS = {  # verb -> the module that has it
    "load": "api.spec",
    "Spec": "api.spec",
    **dict.fromkeys(
        ("check", "plan", "sensitivity", "allow", "report", "schema"),
        "api.planning",
    ),
    **dict.fromkeys(("compare", "why", "afford"), "api.comparing"),
    **dict.fromkeys(("simulate", "simulate_signals"), "api.simulating"),
    **dict.fromkeys(("reduce", "look", "calibrate", "apply"), "api.data"),
    **dict.fromkeys(("diagnose", "update"), "api.diagnosing"),
    "verify": "api.promise",
    "migrate": "api.migrating",
    "sweep": "api.sweeping",
    "reproduce": "api.reproducing",
    **dict.fromkeys(("accept", "plan_check", "forecast", "recalibrate"), "api.fleet"),
    "export": "api.bench",
    **dict.fromkeys(("PlannerError", "InputError", "InfeasibleError", "StoppedEarly"), "errors"),
}
__all__ = ["__version__", *_VERBS]


def _verb(name: str) -> Any:
    return getattr(import_module(f"planner.{_VERBS[name]}"), name)


class _Room(ModuleType):
    """A subpackage whose name is a verb, as `planner.plan`: called, it is the function of that name."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return _verb(self.__name__.rpartition(".")[2])(*args, **kwargs)

    @property
    def __signature__(self) -> Any:
        from inspect import signature

        return signature(_verb(self.__name__.rpartition(".")[2]))

    @property
    def __doc__(self) -> Any:
        return _verb(self.__name__.rpartition(".")[2]).__doc__


class _Package(ModuleType):
    """This package: a subpackage that is imported stands here by its name, callable where that is a verb."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name in _VERBS and isinstance(value, ModuleType):
            value.__class__ = _Room
        super().__setattr__(name, value)


def __getattr__(name: str) -> Any:
    """Verbs, and `__version__`: importlib.metadata alone is a fifth of the time of `--help`."""
    if name in _VERBS:
        return _verb(name)
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("planner")
    except PackageNotFoundError:  # run from a checkout that was never installed
        return "0+unknown"


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


sys.modules[__name__].__class__ = _Package
