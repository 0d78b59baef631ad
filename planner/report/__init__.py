"""Numbers and pictures of a plan: the only room that draws."""
