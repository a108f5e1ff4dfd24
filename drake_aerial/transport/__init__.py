"""The transport station, one trial of it, and its metrics."""
