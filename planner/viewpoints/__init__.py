"""Which photos to take (paper section 3.3.2)."""
