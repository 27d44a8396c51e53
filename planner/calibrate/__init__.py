"""Dwell tables → calibrations: the declared effects or a named method, and a calibration applied."""
