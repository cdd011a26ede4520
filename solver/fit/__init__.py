"""Fitting the body to the markers: energies and methods."""
