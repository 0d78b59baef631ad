"""How good a prior, a plan or a reconstruction is, measured by named protocols."""
