"""Light transport, traced once per scene: camera pixel × projector pixel, direct and interreflected apart."""
