"""Every widget alone, on made-up data."""
