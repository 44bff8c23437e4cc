"""A QR code for the terminal."""

from __future__ import annotations

import io

import qrcode


def qr_code(text: str) -> str:
    """Returns the code of a text as half blocks, which terminals draw dark on light and light on dark."""
    code = qrcode.QRCode(border=2, error_correction=qrcode.constants.ERROR_CORRECT_L)
    code.add_data(text)
    drawn = io.StringIO()
    code.print_ascii(out=drawn, invert=True)
    return drawn.getvalue()
