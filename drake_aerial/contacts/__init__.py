"""Contacts on a new scan: densities, search, feasibility, refinement, solutions. No flight."""
