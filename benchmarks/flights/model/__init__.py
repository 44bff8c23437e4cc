"""A redundant set by one model, in numpy, before it becomes the core's.

`clock` finds delays, `window` averages readings, `error` holds the knowledge of a secondary, `test` compares
pairs beside `vibration`, `hypotheses` and `aiding` name the unit, and `monitor` ties them. All take many
flights of one length at once.
"""
