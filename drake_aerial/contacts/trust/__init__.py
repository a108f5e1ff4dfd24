"""Trust in contacts: evidence from the scan, and a fitted probability."""
