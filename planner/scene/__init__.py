"""What is known of the place: cloud, mesh, ground, box and frame."""
