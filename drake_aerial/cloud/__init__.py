"""Point clouds: the value, its readers, samples of a mesh, partial views. No features of the surface."""
