"""Figures for papers: lines, bands and text on a page, as SVG and as PDF."""
