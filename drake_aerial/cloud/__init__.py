"""Point clouds: class, file readers, mesh sampling and partial views. No surface features."""
