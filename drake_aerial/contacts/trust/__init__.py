"""How far a contact can be trusted: evidence from the scan, and a fitted probability."""
