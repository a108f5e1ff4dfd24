"""Files: atomic writes, archives, YAML and JSON, records, shipped models."""
