"""The page of a spin."""
