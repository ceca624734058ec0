"""Finds flat mirrors by what they show."""
