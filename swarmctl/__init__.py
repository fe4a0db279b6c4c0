"""swarmctl: the planner that you study in ten thousand simulated runs is the planner that flies."""

__version__ = "0.1.0"
