"""One module for each version of the tables, which never changes once it is released."""
