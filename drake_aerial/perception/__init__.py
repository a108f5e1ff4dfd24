"""Point clouds and their surface features."""
