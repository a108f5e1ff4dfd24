"""Surface features of a cloud: neighbourhoods, normals, curvature, frames, outline seen from above. No learning."""
