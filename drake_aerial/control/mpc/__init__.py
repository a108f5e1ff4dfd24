"""Model predictive controller: horizon, costs, condensed program, and the LeafSystem."""
