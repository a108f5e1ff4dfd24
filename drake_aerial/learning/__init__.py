"""Contact models learnt from one demonstration."""
