"""The gate: cells that have to keep their limits, for a pull request to pass or to fail."""
