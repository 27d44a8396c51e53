"""The flow after a campaign: calibrations and checks → accepted units, forecasts, recalibration."""
