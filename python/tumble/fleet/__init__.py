"""Fleets: one procedure over any number of recordings, on this machine or on a cluster of Ray."""
