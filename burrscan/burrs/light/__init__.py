"""Light as evidence: places where neither the brightness nor the depth is that of the surface."""
