"""From recordings to results: each procedure is a function, and the command line calls the same."""
