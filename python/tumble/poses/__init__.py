"""Lists of poses and the triads found at them, for turntable and procedures by hand."""
