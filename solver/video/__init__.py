"""The ordinary video: its frames, the person in it, and what that says of the pose."""
