"""What was measured: the room's mesh with its instances, and the posed HDR frames."""
