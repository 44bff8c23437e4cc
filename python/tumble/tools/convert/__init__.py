"""A log in another format."""
