"""The magnetometer of a unit: hard iron, soft iron and mounting, from the Earth's field alone.

Read in this order: `procedure` (a log becomes a calibration), `result`, `earth_field`; then `messages`,
`report/`, `summary`, `command`.
"""
