"""What lamps look like with their light off: a guess, as no frame shows it."""
