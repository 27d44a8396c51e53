"""Executes a plan on a bench: limits first, arrival polled, every finished step in a journal."""
