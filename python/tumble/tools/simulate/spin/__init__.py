"""A spin: one unit on a wheeled robot that stands still, then turns on the spot."""
