"""Noise of a sensor that stands still: Allan deviations, and the terms they show.

Read in this order: `samples` (what of a log stands still, without its gaps), `procedure`, `result`; then
`messages`, `keys` (what other programs call the terms), `report/`, `summary`, `command`.
"""
