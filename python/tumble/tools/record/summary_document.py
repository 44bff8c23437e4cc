"""JSON that `tumble record` prints."""

from __future__ import annotations

from tumble.foundation.printed import event_model
from tumble.tools.record.procedure import RecordStep

RecordEvent = event_model(RecordStep)
"""Event of a recording, one line each."""
