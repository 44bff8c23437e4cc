"""How accurate, how fast and how small Tumble is, measured; README.md says how each figure is defined."""
