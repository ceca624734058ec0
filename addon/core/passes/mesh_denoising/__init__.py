"""Takes a scan's noise out of its mesh."""
