"""Line over a page until it has its socket, shown before any of its scripts has run."""

from __future__ import annotations

from html import escape
from pathlib import Path

from nicegui import ui

from tumble.foundation.file_reading import own_text

_SCRIPT = Path(__file__).parent / "static" / "connecting.js"
_STYLE = """
.connecting { position: fixed; inset: 0 0 auto 0; z-index: 9500; padding: 18px 28px;
  background: #fdf0d3; color: #7a4a00; font: 600 20px/1.4 system-ui, sans-serif; }
body.connected .connecting { display: none; }
@media (prefers-color-scheme: dark) { .connecting { background: #35270c; color: #ffc766; } }
"""


def add_connecting(text: str) -> None:
    """Shows a text, such as `Connecting …`, until the page is connected, and takes no clicks until then."""
    ui.add_head_html(f"<style>{_STYLE}</style><script>{own_text(_SCRIPT)}</script>")
    ui.add_body_html(f'<div class="connecting" role="status">{escape(text)}</div>')
