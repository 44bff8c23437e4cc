"""What a log holds, and what it can serve."""
