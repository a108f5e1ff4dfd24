"""Surface features: neighbourhoods, normals, curvature, frames, horizontal hull. No learning."""
