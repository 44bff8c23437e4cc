"""Procedures, a folder each; their rows are in `tumble/foundation/procedures.py`."""
