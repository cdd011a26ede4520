"""Other answers for one limb: minima of the same energy that a descent does not reach from where it began."""
