"""Files: whole writes, archives, YAML and JSON, records, shipped models. Nothing of the method."""
