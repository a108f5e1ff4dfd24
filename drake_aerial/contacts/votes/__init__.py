"""Votes of salient features for where the contact would be, and what they read from the outline."""
