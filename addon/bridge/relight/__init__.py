"""New light on the room: lights, exposure, preview, before and after, virtual objects."""
