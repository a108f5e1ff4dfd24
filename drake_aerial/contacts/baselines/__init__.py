"""Contacts without densities: above the centroid, by bounding boxes, by registration."""
