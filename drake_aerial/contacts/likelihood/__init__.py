"""The contact likelihood J and the query densities in it. No search."""
