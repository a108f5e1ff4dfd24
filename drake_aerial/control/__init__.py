"""Controllers as LeafSystems: MPC, geometric laws, attitude loop, allocation; no plant."""
