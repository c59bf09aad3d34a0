"""From the cells of a profile to the first line through them."""
