"""A primary unit that keeps its secondaries calibrated, replayed from logs.

Read in this order: `units` and `settings`, `logs`, `replay`, `store`, `procedure`, `result`; then
`messages`, `report/`, `explain`, `summary`, `command_files`, `command`.
"""
