"""Sensor corrections of autopilot firmware, computed from its parameters.

Read in this order: `correction` (the formula that both share), `rotations`, then `px4` and `ardupilot`.
"""
