"""When a foot strikes and leaves the ground, and when a movement is repeated."""
