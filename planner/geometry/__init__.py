"""Geometry that knows only arrays: angles, frames, Bezier curves, voxels."""
