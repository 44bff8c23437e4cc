"""Text of PDF files."""

from __future__ import annotations

import shutil
import subprocess

import pytest


def text_of(content):
    """Text of a PDF as poppler reads it, lines joined; skips, and prints why, where poppler is absent."""
    if shutil.which("pdftotext") is None:
        pytest.skip("pdftotext (poppler) is not installed")
    done = subprocess.run(["pdftotext", "-layout", "-", "-"], input=content, capture_output=True, check=True)
    return " ".join(done.stdout.decode().replace("\N{MINUS SIGN}", "-").split())
