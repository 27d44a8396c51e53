"""Dwell table → one linear problem a channel: rows made ready, columns, what is told together."""
