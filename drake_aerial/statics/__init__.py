"""Statics of a hanging payload: equilibrium, tensions, load shares, lift. No search, no flight."""
