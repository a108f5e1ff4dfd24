"""Payload model for controllers and estimators; no control law lives here."""
