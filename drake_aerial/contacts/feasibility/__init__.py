"""Feasibility of contacts: checks, and the reasons why they fail."""
