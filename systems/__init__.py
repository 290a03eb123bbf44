"""Systems of FMUs: their declarations, SSP archives, the master that runs them, and what is read off their results."""
