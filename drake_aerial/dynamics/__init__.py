"""The payload model that controllers and estimators share: dynamics, linearisation, flatness. No control law."""
