"""Wheels, finishes and scenes that come with the package."""
