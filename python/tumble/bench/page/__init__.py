"""Screens of the bench, and the frame around them."""
