"""What glossy things reflect onto the room beyond what their L_d says."""
