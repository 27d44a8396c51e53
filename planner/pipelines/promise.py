"""The flow of a verification: plan → recount → Monte Carlo → answer."""
