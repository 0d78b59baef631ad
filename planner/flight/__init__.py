"""Along which curve to fly, and the proof that it is safe (paper section 3.4)."""
