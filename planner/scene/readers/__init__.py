"""One reader a file format; each returns a :class:`planner.scene.readers.source.Source`."""
