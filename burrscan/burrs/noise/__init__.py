"""How large the errors of vertices are, alone and shared with their neighbours."""
