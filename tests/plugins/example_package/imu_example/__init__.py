"""Plug-ins for planner: one module each, offered by the entry points in pyproject.toml."""
