"""Plan the drone flight that a high-quality aerial 3D reconstruction needs."""
