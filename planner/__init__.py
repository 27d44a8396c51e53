"""planner: the shortest calibration campaign of an inertial unit that provably suffices."""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("planner")
except PackageNotFoundError:  # run from a checkout that was never installed
    __version__ = "0+unknown"
