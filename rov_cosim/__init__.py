"""FMI co-simulation components that hold an underwater vehicle in place beside a structure."""
