"""What the FMUs, the master and the commands cost."""
