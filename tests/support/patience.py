"""Time after which a test waits for what never comes."""

PATIENCE = 900
"""s. It only ends what hangs, before `timeout` of pyproject.toml ends all tests of the process: no test is
fast or slow by it, on a busy computer neither."""
