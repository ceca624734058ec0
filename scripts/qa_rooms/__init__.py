"""Rooms of several kinds, rendered with truth, to find out where the recovery fails."""
