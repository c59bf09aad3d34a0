"""Which columns to believe, and by how much other light may have moved them."""
