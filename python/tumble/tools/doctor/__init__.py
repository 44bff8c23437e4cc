"""What of Tumble works on this machine, and how to get the rest."""
