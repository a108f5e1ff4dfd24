"""Point clouds: the value, its readers, mesh sampling and partial views. No surface features."""
