"""Votes of salient features for the contact; cuts and height profile of a scan."""
