"""What the paper says beside what its systems do here: experiments, figures, claims, and a moving picture."""
