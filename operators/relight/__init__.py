"""New light, exposure, cameras, virtual objects, before and after, export."""
