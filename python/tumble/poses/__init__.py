"""What the turntable and the procedures by hand share: lists of poses, and the triads found at them."""
