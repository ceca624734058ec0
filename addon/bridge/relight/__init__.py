"""New light on the room: lights, exposure, preview, before and after, things set into it."""
