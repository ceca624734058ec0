"""What glossy things throw on the room beyond what their L_d says."""
