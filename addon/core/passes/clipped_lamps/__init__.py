"""How bright lamps are that the sensor clipped."""
