"""An adversary of the procedures: drawn imperfections, files as users have them, and one law of honesty."""
