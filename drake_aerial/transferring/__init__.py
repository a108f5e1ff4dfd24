"""Transfer of a learnt contact to a new scan."""
