"""In which order to fly (paper section 3.4)."""
