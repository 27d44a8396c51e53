"""Units after the campaign: accepted, stored, forecast, calibrated again."""
