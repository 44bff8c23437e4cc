"""A primary unit that keeps its secondaries calibrated, replayed from logs.

Read in this order: `units` and `settings`, `store`, `monitor`, `logs`, `replay`, `procedure`, `result`; then
`messages`, `report/`, `explain`, `summary`, `command_files`, `command`; beside running sensors `live`,
`command_dashboard`, `command_live`.
"""
