"""A bench that is not there: a table and units that serve real sockets and lines while they move."""
