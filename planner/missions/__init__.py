"""Files that leave the planner, and the check that reads them back."""
