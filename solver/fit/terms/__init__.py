"""The terms of the energy: one module each, with its residual, what it costs, and its slope."""
