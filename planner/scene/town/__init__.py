"""A made-up town block: parcels, buildings, bridge and trees as closed solids."""
