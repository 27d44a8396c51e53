"""Forecasts of drift in store: one file a method, chosen by rolling origins, and the date that follows."""
