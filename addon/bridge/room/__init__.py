"""The recovered room in the open file: brought in, as scanned, or updated by a later run."""
