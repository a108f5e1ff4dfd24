"""Pictures and pages: what a cloud, a skill, contacts and a flight look like."""
