"""How far a result, anybody's, is from the truth."""
