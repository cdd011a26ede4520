"""A person whose body and markers are known from a solved trial, found in other frames without names or a video."""
