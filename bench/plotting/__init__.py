"""What pages draw with: plots in SVG, pictures as data URIs, the style sheet."""
