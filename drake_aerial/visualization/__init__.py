"""Drawings of the method's values and flights: images, plots, HTML pages. No results are computed."""
