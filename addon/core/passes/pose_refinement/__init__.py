"""Puts frames right that lie beside what all of them show together."""
