"""What the declared error model lacks: candidates scored on whitened residuals, one stage a file."""
