"""A wheeled robot that stands still, then turns on the spot: biases of both sensors, whatever tilts.

Read in this order: `segments`, `motions` and `search` (rests and spins in a log), `turns`, `outputs` (what
the core found), `combination` (several spins), `procedure` and `live`, `result`; then `messages`,
`report/`, `summary`, `command`.
"""
