"""The permanent benchmark: each stage over its alternatives, with the paper's setting as baseline in the same run."""
