"""New light, exposure, cameras, things set in, before and after, export."""
