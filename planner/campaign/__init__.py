"""The one model of a campaign: power-ons, columns of the errors, covariance, information, estimate."""
