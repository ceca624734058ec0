"""What glossy surfaces reflect onto the room beyond their L_d."""
