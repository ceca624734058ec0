"""The demo: a room made up, rendered, recovered and compared with its truth."""
