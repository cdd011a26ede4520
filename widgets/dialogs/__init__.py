"""Dialogs and overlays; they ask, and leave the work to whoever listens."""
