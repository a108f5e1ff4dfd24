"""Votes of salient features for the contact, and what they read from outline and heights."""
