"""What makes a controller's gains, and what tells whether they work: the rule, the sampled loop, the theorem."""
