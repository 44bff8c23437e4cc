"""Live sessions, tables, files of other programs, simulation: no procedure by name."""
