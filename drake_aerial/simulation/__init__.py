"""The transport station and flights with it: set-up, monitoring, recording, metrics. No study."""
