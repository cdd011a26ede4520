"""Networks that clean markers and solve motion: where their data come from, how they are trained, what they are."""
