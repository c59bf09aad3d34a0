"""Tests over scenes: what a handful of numbers says of their mean."""
