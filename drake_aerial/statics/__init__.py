"""Statics of a hanging payload: tensions, load shares, lift, equilibrium. No search, no simulation."""
