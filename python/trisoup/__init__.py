"""Photographs to a few thousand textured triangles: datasets, training, rendering, measuring (docs/python.md)."""

from ._trisoup import *  # noqa: F403
from ._trisoup import __version__ as __version__
