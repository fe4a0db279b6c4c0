"""Fixtures of the tests that start commands in processes of their own."""

from .processes import start, stubs

__all__ = ["start", "stubs"]
