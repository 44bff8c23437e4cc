"""Live sources, recorded together."""
