"""The simulated world: wheels, burrs, finishes, light transport, electronics, and the truth."""
