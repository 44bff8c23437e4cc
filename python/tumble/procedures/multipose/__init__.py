"""One IMU, held in many orientations and turned by hand in between: no equipment but gravity.

Read in this order: `procedure` (a log becomes a calibration), `result`; then `messages`, `report/`,
`summary`, `command`.
"""
