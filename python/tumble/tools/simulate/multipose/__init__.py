"""One unit, held still in many orientations and turned by hand in between."""
