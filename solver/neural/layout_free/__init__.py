"""The network that takes any number of markers anywhere on the body."""
