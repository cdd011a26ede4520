"""Set-up, and the scripts that made what ships; nothing of it is installed."""
