"""Hostile input and bad days, as a command for developers: `python -m tests.hostile --help`."""
