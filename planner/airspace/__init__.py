"""Where the drone may be (paper section 3.3.1)."""
