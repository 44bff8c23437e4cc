"""Charts of recordings: what `tumble view` serves, and the screen Log of the bench mounts."""
