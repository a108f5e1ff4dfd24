"""The search for maxima of J: initial configurations, annealing, distinct solutions."""
