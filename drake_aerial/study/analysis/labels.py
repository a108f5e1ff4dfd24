"""Order and description of methods, beliefs and inertias in a report."""

METHOD_ORDER = (
    "task",
    "paper",
    "kopicki",
    "control",
    "registration",
    "obb",
    "centroid",
    "head",
    "middle",
    "thigh",
)
METHOD_WORDS = {
    "task": "this package's method: edges of the demonstrated object vote for the place of the "
    "gripper, relative to the object's size",
    "paper": "the paper's method as published: the same votes as rigid displacements, by sampling",
    "kopicki": "the baseline: the surface must look like the demonstrated one, anywhere on the "
    "object (Kopicki et al., 2016)",
    "control": "this package's method without its votes",
    "registration": "the demonstrated place, carried by a non-rigid registration of the two scans",
    "obb": "the demonstrated place in proportions of the object's bounding box",
    "centroid": "no learning: the surface point above the middle of the visible part",
    "head": "contact given: on the bunny's head",
    "middle": "contact given: on the middle of the bunny's back",
    "thigh": "contact given: on the bunny's thigh",
}
BELIEF_ORDER = ("below_contact", "geometric", "true")
BELIEF_WORDS = {
    "below_contact": "the controller assumes the centre of mass straight below the contact",
    "geometric": "the controller assumes the centre of mass in the middle of the scan's hull",
    "true": "the controller knows the true centre of mass",
}
INERTIA_ORDER = ("table", "mesh")
INERTIA_WORDS = {
    "table": "mass and moments of inertia of the paper's table, the same for every payload",
    "mesh": "moments of inertia of the payload's own shape, of uniform density",
}


def position(order: tuple[str, ...], name: str) -> tuple[int, str]:
    """Return a sorting key: the place in `order`; other names follow in alphabetical order."""
    return (order.index(name) if name in order else len(order), name)
