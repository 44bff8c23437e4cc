"""Recordings, rests, verdicts and parameters as files that Rerun, Foxglove and PlotJuggler open."""
