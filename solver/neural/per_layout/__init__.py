"""Networks for one layout of markers."""
