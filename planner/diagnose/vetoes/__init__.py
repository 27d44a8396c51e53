"""What refuses a claim: power-ons that it did not see, the form of its name, what the spec budgets."""
