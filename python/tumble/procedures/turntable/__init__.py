"""Targets on a turntable, calibrated against a co-mounted reference.

Read in this order: `matching` (which rest shows which pose), `reference` and `target` (what each unit
yields), `procedure` (all of it), `result`; then `calibration`, `messages`, `report/`, `summary`, `command`.
"""
