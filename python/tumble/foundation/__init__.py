"""What everything else is built of: units, numbers, files, documents, recordings, results."""
