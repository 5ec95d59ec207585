"""The pneumatic tapping robot with its stimulator, simulated."""
