"""The model predictive controller: horizon, condensed program, costs, the system itself."""
