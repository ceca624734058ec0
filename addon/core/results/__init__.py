"""The result folder: what is finished, what an interface needs of it."""
