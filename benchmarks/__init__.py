"""Benchmarks of accuracy, speed and size; README.md defines each figure."""
