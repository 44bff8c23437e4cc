"""How firmware of autopilots corrects its sensors, by the parameters that it keeps.

Read in this order: `correction` (the formula that both share), `rotations`, then `px4` and `ardupilot`.
"""
