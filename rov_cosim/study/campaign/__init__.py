"""Many runs: drawn, run on workers, recorded as they come, and summed up."""
