"""The promise of a plan checked: recount, Monte Carlo, sweeps."""
