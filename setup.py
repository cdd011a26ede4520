"""The packages of the wheel: this tree's folders under one import name. ``pyproject.toml`` holds everything else."""

from setuptools import find_namespace_packages, setup

PARTS = ("app", "solver", "widgets", "resources")
"""As in ``tools/links.py``."""

found = find_namespace_packages(include=[*PARTS, *(f"{part}.*" for part in PARTS)], exclude=["*.__pycache__"])
setup(packages=["markerscope", *(f"markerscope.{name}" for name in found)])
