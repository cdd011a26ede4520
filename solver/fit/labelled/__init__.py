"""The labelled baseline: markers whose places are known by name, fitted in two stages as MoSh++ does."""
