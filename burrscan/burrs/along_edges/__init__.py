"""Burrs along an edge that dark or mirroring flanks keep out of the depth, told by light."""
