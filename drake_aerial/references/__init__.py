"""Reference trajectories of the payload's tracked point, as values and as files; no dynamics."""
