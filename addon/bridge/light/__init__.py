"""The captured light in an open file: its lamps, what comes from outside, what is where in the room."""
