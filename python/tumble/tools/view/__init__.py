"""Samples of recordings at any level of detail, their rests and turns, and spectra of sections."""
