"""Constants of nature and of data sheets."""

from __future__ import annotations

from typing import Final

from tumble import _core

STANDARD_GRAVITY: Final = _core.STANDARD_GRAVITY
"""m/s^2, what one `g` of a data sheet means (3rd CGPM, 1901)."""
