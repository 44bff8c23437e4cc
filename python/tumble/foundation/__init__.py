"""Shared foundation of all packages: units, numbers, files, documents, recordings, results."""
