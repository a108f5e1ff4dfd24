"""Making a demonstration without writing it: contacts given as numbers, or clicked on the cloud in a browser."""
