"""The surface of the scene and how well each part of it is known (paper section 3.2)."""
