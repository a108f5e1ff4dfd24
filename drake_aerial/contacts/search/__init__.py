"""The search for the maxima of J: starts, annealing, selection of distinct solutions."""
