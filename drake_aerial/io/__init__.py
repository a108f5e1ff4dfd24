"""Files: written whole, archives, YAML records, shipped models. Nothing of the method."""
