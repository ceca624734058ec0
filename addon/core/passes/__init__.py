"""What the default method does beyond the paper's; each pass by itself in a folder."""
