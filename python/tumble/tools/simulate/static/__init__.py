"""A unit that stands still: noise of known terms, for hours."""
