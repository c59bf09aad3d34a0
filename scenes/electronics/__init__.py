"""Camera and projector electronics: from light to digital numbers, and from levels to light."""
