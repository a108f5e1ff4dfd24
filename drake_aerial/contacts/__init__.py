"""Contacts on a new scan: query densities, search, feasibility, refinement, solutions. No flight."""
