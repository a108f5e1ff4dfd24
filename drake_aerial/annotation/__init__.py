"""Making a demonstration: contacts given as numbers or clicked on the cloud in a browser."""
