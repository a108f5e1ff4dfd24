"""Contacts for cable-suspended aerial transport: learn from one demonstration, transfer, and fly.

The names are listed in ``__init__.pyi`` and loaded at their first use, which keeps
``import drake_aerial`` fast.
"""

import lazy_loader

from drake_aerial._version import __version__ as __version__

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
