"""The run folder: write it, read it, draw it, sum it up, replay it."""
