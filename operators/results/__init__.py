"""Results: the panels Results and Look, result folders that are moved, opened and cleared."""
