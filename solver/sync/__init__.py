"""The video's clock against the markers'."""
