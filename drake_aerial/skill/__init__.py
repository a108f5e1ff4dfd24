"""The contact skill: a demonstration, the four models, and learning them. No transfer."""
