"""Contents of a log, and the procedures that it suits."""
